#include "bench/store_layout.h"

#include "base/block_storage.h"
#include "store/sqlite_store.h"

#include "bench/segment_layout.h"

namespace enfilade::bench {
namespace {

class OneFileLayout final : public Layout {
 public:
  explicit OneFileLayout(std::unique_ptr<BlockStorage> store)
      : store_(std::move(store)) {}

  void Put(uint32_t key, std::span<const std::byte> content) override {
    store_->Put(KeyOf(key), content);
  }

  [[nodiscard]] std::optional<Bytes> Get(uint32_t key) const override {
    return store_->Get(KeyOf(key));
  }

  void Commit() override { store_->Commit(); }

 private:
  static BlockKey KeyOf(uint32_t key) { return {BlockKind::kLinks, key, 0, 0}; }

  std::unique_ptr<BlockStorage> store_;
};

}  // namespace

const char* NameOf(LayoutKind kind) {
  switch (kind) {
    case LayoutKind::kOneFile:
      return "one file (the store)";
    case LayoutKind::kSegments:
      return "segments, append only";
    case LayoutKind::kSegmentsReused:
      return "segments, reused";
  }
  return "";
}

std::unique_ptr<Layout> CreateLayout(LayoutKind kind,
                                     const std::filesystem::path& folder) {
  if (kind == LayoutKind::kOneFile) {
    return std::make_unique<OneFileLayout>(CreateStore(folder / "store.enf"));
  }
  CreateSegmentCatalogue(folder);
  return OpenLayout(kind, folder);
}

std::unique_ptr<Layout> OpenLayout(LayoutKind kind,
                                   const std::filesystem::path& folder) {
  if (kind == LayoutKind::kOneFile) {
    return std::make_unique<OneFileLayout>(
        OpenStore(folder / "store.enf", StoreAccess::kWrite));
  }
  return OpenSegmentLayout(folder, kind == LayoutKind::kSegmentsReused);
}

}  // namespace enfilade::bench
