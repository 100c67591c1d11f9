// How a store's database is made and opened.

#pragma once

#include "store/sqlite_db.h"
#include "store/sqlite_store.h"

#include <filesystem>
#include <memory>

namespace enfilade::internal {

// Makes a new file with an empty store. Throws DiskError if the path is taken
// or cannot be written.
std::unique_ptr<Database> CreateDatabase(const std::filesystem::path& path);

// Throws DiskError if there is no such file, InputError if the file cannot be a
// store. Call before a lock is made beside the file.
void RequireFile(const std::filesystem::path& path);

// Opens the database of an existing store. Throws InputError if it is another
// program's or of another format, DamagedStoreError if it is no database. A
// reader sees the present state for as long as it lives.
std::unique_ptr<Database> OpenDatabase(const std::filesystem::path& path,
                                       StoreAccess access);

// Makes a new store in memory, without a file.
std::unique_ptr<Database> CreateDatabaseInMemory();

}  // namespace enfilade::internal
