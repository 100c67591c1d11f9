// How a store's database is made and opened.

#pragma once

#include "store/sqlite_db.h"
#include "store/sqlite_store.h"

#include <filesystem>
#include <memory>

namespace enfilade::internal {

// A new store in an empty file of its own. DiskError if the path is taken, or
// cannot be written.
std::unique_ptr<Database> CreateDatabase(const std::filesystem::path& path);

// DiskError if there is no such file; InputError if it cannot be a store. To be
// called before a lock is made beside it.
void RequireFile(const std::filesystem::path& path);

// That of a store that is there. InputError if it is no store, or of another
// format. A reader sees what is there now for as long as
// it lives.
std::unique_ptr<Database> OpenDatabase(const std::filesystem::path& path,
                                       StoreAccess access);

// A new store without a file.
std::unique_ptr<Database> CreateDatabaseInMemory();

}  // namespace enfilade::internal
