// A store in memory for tests of visibility: a map without limits.

#pragma once

#include "base/block_storage.h"

#include <map>
#include <memory>
#include <mutex>

namespace enfilade::test {

class MapStorage : public BlockStorage {
 public:
  void SetMeta(std::string_view name, std::string_view value) override {
    meta_[std::string(name)] = value;
  }

  [[nodiscard]] std::optional<std::string> Meta(
      std::string_view name) const override {
    const auto it = meta_.find(std::string(name));
    return it == meta_.end() ? std::nullopt : std::optional(it->second);
  }

  uint64_t Put(const BlockKey& key,
               std::span<const std::byte> content) override {
    const std::lock_guard lock(*mutex_);
    blocks_[key] = Bytes(content.begin(), content.end());
    return content.size();
  }

  [[nodiscard]] std::optional<Bytes> Get(const BlockKey& key) const override {
    const std::lock_guard lock(*mutex_);
    ++gets_;
    const auto it = blocks_.find(key);
    return it == blocks_.end() ? std::nullopt : std::optional(it->second);
  }

  void Erase(const BlockKey& key) override { blocks_.erase(key); }

  void EraseAll(BlockKind kind) override {
    std::erase_if(blocks_, [&](const auto& b) { return b.first.kind == kind; });
  }

  void EraseAll(BlockKind kind, uint32_t a) override {
    std::erase_if(blocks_, [&](const auto& b) {
      return b.first.kind == kind && b.first.a == a;
    });
  }

  void EraseAll(BlockKind kind, uint32_t a, uint32_t b) override {
    std::erase_if(blocks_, [&](const auto& block) {
      const BlockKey& k = block.first;
      return k.kind == kind && k.a == a && k.b == b;
    });
  }

  [[nodiscard]] uint64_t Count(BlockKind kind) const override {
    uint64_t count = 0;
    ForEachKey(kind, [&](const BlockKey&) { ++count; });
    return count;
  }

  [[nodiscard]] uint64_t StoredBytes(BlockKind /*kind*/) const override {
    return 0;
  }

  [[nodiscard]] uint64_t Count(BlockKind kind,
                               uint32_t a,
                               uint32_t b) const override {
    uint64_t count = 0;
    ForEachKey(kind, [&](const BlockKey& k) {
      count += k.a == a && k.b == b ? 1 : 0;
    });
    return count;
  }

  void ForEachKey(
      BlockKind kind,
      const std::function<void(const BlockKey&)>& visit) const override {
    for (const auto& [key, content] : blocks_) {
      if (key.kind == kind) {
        visit(key);
      }
    }
  }

  void Commit() override {}

  uint64_t VerifyAll(
      const std::function<void(double)>& /*progress*/) const override {
    return 0;
  }

  [[nodiscard]] StoreStats Stats() const override { return {}; }

  [[nodiscard]] uint64_t FileBytes() const override { return 0; }

  // Number of blocks read so far.
  [[nodiscard]] uint64_t Gets() const { return gets_; }

  [[nodiscard]] const std::map<BlockKey, Bytes>& Blocks() const {
    return blocks_;
  }

 private:
  std::map<BlockKey, Bytes> blocks_;
  std::map<std::string, std::string> meta_;
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();
  mutable uint64_t gets_ = 0;
};

}  // namespace enfilade::test
