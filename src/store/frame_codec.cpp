#include "store/frame_codec.h"

#include "base/check.h"
#include "base/error.h"
#include "base/hash.h"
#include "base/random.h"

#include <new>
#include <type_traits>

#include <fmt/format.h>
#include <zstd.h>

namespace enfilade::internal {
namespace {

constexpr int kLevel = 1;

void FreeCompressor(ZSTD_CCtx_s* context) {
  ZSTD_freeCCtx(context);
}

void FreeDecompressor(ZSTD_DCtx_s* context) {
  ZSTD_freeDCtx(context);
}

}  // namespace

uint64_t BlockChecksum(const BlockKey& key,
                       std::span<const std::byte> content) {
  uint64_t seed = MixKey(0, static_cast<uint64_t>(key.kind));
  seed = MixKey(seed, key.a);
  seed = MixKey(seed, key.b);
  seed = MixKey(seed, key.c);
  return HashBytes(content, seed);
}

void ThrowDamagedBlock(const BlockKey& key, const char* what) {
  throw DamagedStoreError(
      fmt::format("block '{}' of the store is damaged: {}; restore the store "
                  "from a copy or solve the scene again",
                  ToString(key),
                  what));
}

FrameCodec::FrameCodec() = default;
FrameCodec::~FrameCodec() = default;

template <typename Context>
std::unique_ptr<Context, void (*)(Context*)> FrameCodec::Take(
    Pool<Context>& pool) {
  {
    const std::lock_guard lock(mutex_);
    if (!pool.empty()) {
      auto context = std::move(pool.back());
      pool.pop_back();
      return context;
    }
  }
  std::unique_ptr<Context, void (*)(Context*)> context = [] {
    if constexpr (std::is_same_v<Context, ZSTD_CCtx_s>) {
      return std::unique_ptr<Context, void (*)(Context*)>(ZSTD_createCCtx(),
                                                          FreeCompressor);
    } else {
      return std::unique_ptr<Context, void (*)(Context*)>(ZSTD_createDCtx(),
                                                          FreeDecompressor);
    }
  }();
  if (context == nullptr) {
    throw std::bad_alloc();
  }
  return context;
}

RawBuffer FrameCodec::Compress(std::span<const std::byte> content) {
  auto context = Take(compressors_);
  RawBuffer frame(ZSTD_compressBound(content.size()));
  const size_t size = ZSTD_compressCCtx(context.get(),
                                        frame.All().data(),
                                        frame.All().size(),
                                        content.data(),
                                        content.size(),
                                        kLevel);
  if (ZSTD_isError(size) != 0) {
    throw std::bad_alloc();  // the only failure if the frame has room
  }
  frame.Shrink(size);
  const std::lock_guard lock(mutex_);
  compressors_.push_back(std::move(context));
  return frame;
}

Bytes FrameCodec::Decompress(const BlockKey& key,
                             std::span<const std::byte> frame,
                             uint64_t content_bytes,
                             uint64_t checksum) {
  if (content_bytes > kMaxContentBytes ||
      ZSTD_getFrameContentSize(frame.data(), frame.size()) != content_bytes) {
    ThrowDamagedBlock(key, "its size is not the one in the catalogue");
  }
  Bytes content(content_bytes);
  auto context = Take(decompressors_);
  const size_t size = ZSTD_decompressDCtx(context.get(),
                                          content.data(),
                                          content.size(),
                                          frame.data(),
                                          frame.size());
  {
    const std::lock_guard lock(mutex_);
    decompressors_.push_back(std::move(context));
  }
  if (ZSTD_isError(size) != 0 || size != content_bytes) {
    ThrowDamagedBlock(key, "it cannot be decompressed");
  }
  if (BlockChecksum(key, content) != checksum) {
    ThrowDamagedBlock(key, "its checksum does not fit its content");
  }
  return content;
}

}  // namespace enfilade::internal
