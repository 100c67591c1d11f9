// All that a store holds.

#pragma once

#include "base/hash.h"
#include "store/sqlite_store.h"

#include <cstdint>
#include <filesystem>
#include <map>

namespace enfilade {

// A hash of every block of every kind.
inline std::map<BlockKey, uint64_t> BlocksOf(
    const std::filesystem::path& path) {
  const auto store = OpenStore(path, StoreAccess::kRead);
  std::map<BlockKey, uint64_t> blocks;
  for (uint8_t kind = 0; kind < UINT8_MAX; ++kind) {
    store->ForEachKey(BlockKind{kind}, [&](const BlockKey& key) {
      blocks[key] = HashBytes(store->GetOrThrow(key));
    });
  }
  return blocks;
}

}  // namespace enfilade
