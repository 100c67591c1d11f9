// The store on disk: one SQLite file that is both catalogue and journal. The
// store knows no geometry.
//
// Every block is compressed (zstd) and has an XXH3 checksum of its content that
// is seeded by its key. A block that fails the check is never returned; a
// DamagedStoreError names it. Changes become durable together at Commit(); a
// process killed at any instant leaves the state of the last commit. One
// process may write a store at a time (a second one gets a DiskError), any
// number may read.
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

// Opens a store. Throws InputError if the file is not an Enfilade store or has
// another format version, DamagedStoreError if a block was lost, and DiskError
// if the file is missing, if another process is writing it (to write), or if
// part of it is in a journal that this user cannot use (to read).
std::unique_ptr<BlockStorage> OpenStore(const std::filesystem::path& path,
                                        StoreAccess access);

// A store in memory with the same checks, for tests.
std::unique_ptr<BlockStorage> CreateStoreInMemory();

}  // namespace enfilade
