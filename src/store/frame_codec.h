// Blocks as the store holds them: a zstd frame, and an XXH3 checksum of the
// content that is seeded by the block's key, so that changed bytes and blocks
// under a wrong key are both detected.

#pragma once

#include "base/block_storage.h"
#include "base/bytes.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace enfilade::internal {

inline constexpr uint64_t kMaxContentBytes = 64ULL << 20;

uint64_t BlockChecksum(const BlockKey& key, std::span<const std::byte> content);

// A buffer whose bytes are not initialized.
class RawBuffer {
 public:
  explicit RawBuffer(size_t size)
      : bytes_(std::make_unique_for_overwrite<std::byte[]>(size)),
        size_(size) {}

  [[nodiscard]] std::span<std::byte> All() { return {bytes_.get(), size_}; }

  [[nodiscard]] std::span<const std::byte> View() const {
    return {bytes_.get(), size_};
  }

  void Shrink(size_t size) { size_ = size; }

 private:
  std::unique_ptr<std::byte[]> bytes_;
  size_t size_;
};

// Compresses and decompresses. Between calls the codec keeps the library's
// contexts, one per thread that calls at the same time. Thread-safe.
class FrameCodec {
 public:
  FrameCodec();
  ~FrameCodec();
  FrameCodec(const FrameCodec&) = delete;
  FrameCodec& operator=(const FrameCodec&) = delete;

  [[nodiscard]] RawBuffer Compress(std::span<const std::byte> content);

  // The content of the frame. Throws DamagedStoreError naming the key if the
  // content does not have `content_bytes` and `checksum`.
  [[nodiscard]] Bytes Decompress(const BlockKey& key,
                                 std::span<const std::byte> frame,
                                 uint64_t content_bytes,
                                 uint64_t checksum);

 private:
  template <typename Context>
  using Pool = std::vector<std::unique_ptr<Context, void (*)(Context*)>>;

  template <typename Context>
  std::unique_ptr<Context, void (*)(Context*)> Take(Pool<Context>& pool);

  std::mutex mutex_;
  Pool<ZSTD_CCtx_s> compressors_;
  Pool<ZSTD_DCtx_s> decompressors_;
};

[[noreturn]] void ThrowDamagedBlock(const BlockKey& key, const char* what);

}  // namespace enfilade::internal
