// Contents for stores under test, and a model in memory to compare one with.

#pragma once

#include "base/block_storage.h"
#include "base/random.h"
#include "store/sqlite_store.h"

#include <map>
#include <string>

#include "tests/temporary_folder.h"

namespace enfilade {

// Bytes with some order in them, so that they compress by a half or so.
inline Bytes TestContent(uint64_t seed, size_t size) {
  Random random(seed);
  Bytes content(size);
  for (auto& byte : content) {
    byte = static_cast<std::byte>(random.NextBelow(16));
  }
  return content;
}

// What a store should hold.
struct StoreModel {
  std::map<BlockKey, Bytes> blocks;
  std::map<std::string, std::string> meta;

  friend bool operator==(const StoreModel&, const StoreModel&) = default;
};

inline constexpr BlockKind kAllKinds[] = {BlockKind::kFaces,
                                          BlockKind::kCellPatches,
                                          BlockKind::kPortals,
                                          BlockKind::kVisibleSet,
                                          BlockKind::kCellTree,
                                          BlockKind::kLinks,
                                          BlockKind::kTrace,
                                          BlockKind::kScratch};

// All blocks of a store, and those of the named meta values that it has.
inline StoreModel ReadAll(const BlockStorage& store,
                          const std::map<std::string, std::string>& names) {
  StoreModel model;
  for (const BlockKind kind : kAllKinds) {
    store.ForEachKey(kind, [&](const BlockKey& key) {
      model.blocks[key] = store.GetOrThrow(key);
    });
  }
  for (const auto& [name, value] : names) {
    if (const auto found = store.Meta(name)) {
      model.meta[name] = *found;
    }
  }
  return model;
}

}  // namespace enfilade
