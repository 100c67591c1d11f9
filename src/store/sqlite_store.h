// The store on disk: one SQLite file that is catalogue and journal at once.
// Knows no geometry.
//
// Every block is compressed (zstd) and carries an XXH3 checksum of its content
// bound to its key; a block that fails it is named in a DamagedStoreError and
// never returned. Changes become durable together at Commit(); a process
// killed at any instant leaves the state of the last commit. One process may
// write a store at a time (a second one gets a DiskError), any number may read.
//
// File format: docs/store-format.md.

#pragma once

#include "base/block_storage.h"

#include <filesystem>
#include <memory>

namespace enfilade {

enum class StoreAccess { kRead, kWrite };

// Creates a new store; an existing file at `path` is a DiskError.
std::unique_ptr<BlockStorage> CreateStore(const std::filesystem::path& path);

// Opens a store; one that is not Enfilade's, or of another format version, or
// that has lost a block, is an InputError or DamagedStoreError that says so.
std::unique_ptr<BlockStorage> OpenStore(const std::filesystem::path& path,
                                        StoreAccess access);

// A store in memory, with the same checks: for tests.
std::unique_ptr<BlockStorage> CreateStoreInMemory();

}  // namespace enfilade
