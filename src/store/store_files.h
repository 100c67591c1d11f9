// The files of a store: how a new one comes to be under its name, and how one
// goes with all that lies beside it (docs/store-format.md).

#pragma once

#include "base/block_storage.h"

#include <filesystem>
#include <functional>
#include <memory>

namespace enfilade {

// Makes a store under a name that nothing has, with what `fill` puts into it,
// and opens it to be written: from the first instant that it is there, all of
// that is in it. Made as PATH.part and renamed; what a store of this name that
// was killed and removed has left behind goes first, lest it be taken for the
// new one's. Throws DiskError, and where another program is at it.
std::unique_ptr<BlockStorage> MakeStore(
    const std::filesystem::path& path,
    const std::function<void(BlockStorage&)>& fill);

// Removes a store and what may lie beside it; none need be there.
void RemoveStoreFiles(const std::filesystem::path& path);

namespace internal {

// Removes the journals beside a store that is not there. Throws DiskError.
void RemoveJournals(const std::filesystem::path& path);

}  // namespace internal

}  // namespace enfilade
