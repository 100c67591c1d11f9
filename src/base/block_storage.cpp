#include "base/block_storage.h"

#include <fmt/format.h>

namespace enfilade {
namespace {

std::string_view KindName(BlockKind kind) {
  switch (kind) {
    case BlockKind::kFaces:
      return "faces";
    case BlockKind::kCellPatches:
      return "patches";
    case BlockKind::kPortals:
      return "portals";
    case BlockKind::kVisibleSet:
      return "visible set";
    case BlockKind::kCellTree:
      return "element tree";
    case BlockKind::kLinks:
      return "links";
    case BlockKind::kTrace:
      return "trace chunk";
    case BlockKind::kScratch:
      return "scratch";
    case BlockKind::kSolveCells:
      return "solve table";
    case BlockKind::kCellCare:
      return "care of patches";
    case BlockKind::kReceived:
      return "received light";
    case BlockKind::kCellDelta:
      return "change of a cell's light";
    case BlockKind::kSourceWeights:
      return "what a cell sends at most";
  }
  return "unknown kind";
}

}  // namespace

std::string ToString(const BlockKey& key) {
  return fmt::format("{} {} {} {}", KindName(key.kind), key.a, key.b, key.c);
}

Bytes BlockStorage::GetOrThrow(const BlockKey& key) const {
  auto content = Get(key);
  if (!content) {
    ThrowDamaged(*this, fmt::format("has lost its block '{}'", ToString(key)));
  }
  return std::move(*content);
}

void ThrowDamaged(const BlockStorage& store, std::string_view what) {
  throw DamagedStoreError(
      fmt::format("{} {}; restore it from a copy or solve the scene again",
                  store.Name(),
                  what));
}

void internal::ThrowDamagedContent(const BlockStorage& store,
                                   const BlockKey& key,
                                   const DamagedStoreError& why) {
  ThrowDamaged(
      store,
      fmt::format("has a damaged block '{}': {}", ToString(key), why.what()));
}

void internal::ThrowDamagedContent(const BlockStorage& store,
                                   std::string_view meta_entry,
                                   const DamagedStoreError& why) {
  ThrowDamaged(
      store,
      fmt::format("has a damaged entry '{}': {}", meta_entry, why.what()));
}

}  // namespace enfilade
