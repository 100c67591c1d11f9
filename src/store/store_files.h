// Makes a new store under its name, and removes a store with all files beside
// it (docs/store-format.md).

#pragma once

#include "base/block_storage.h"

#include <filesystem>
#include <functional>
#include <memory>

namespace enfilade {

// Makes a store at a path that does not exist yet, with what `fill` puts into
// it, and opens it for writing. The store is made as PATH.part and renamed, so
// that from the first instant under its own name it holds all of that. Journals
// that a killed and removed store of this name left behind are deleted first,
// lest SQLite take them for the new store's. Throws DiskError, also if the path
// exists or another program is writing there.
std::unique_ptr<BlockStorage> MakeStore(
    const std::filesystem::path& path,
    const std::function<void(BlockStorage&)>& fill);

// Removes a store and the files beside it, as far as they exist.
void RemoveStoreFiles(const std::filesystem::path& path);

namespace internal {

// Removes the journals that a removed store left behind. Throws DiskError.
void RemoveJournals(const std::filesystem::path& path);

}  // namespace internal

}  // namespace enfilade
