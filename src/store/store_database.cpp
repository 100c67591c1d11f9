#include "store/store_database.h"

#include "base/error.h"
#include "store/block_catalogue.h"
#include "store/store_files.h"
#include "store/write_lock.h"

#include <cerrno>
#include <cstdint>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace enfilade::internal {
namespace {

// Settings of a connection; page size and journal mode belong to the file.
void Configure(Database& database) {
  database.Execute(
      "PRAGMA mmap_size = 0;"
      "PRAGMA cache_size = -2048;"  // KiB
      "PRAGMA cache_spill = ON;"
      "PRAGMA secure_delete = OFF;"
      "PRAGMA cell_size_check = ON;"
      "PRAGMA trusted_schema = OFF;"
      // Every commit waits for the disk; commits are seconds apart.
      "PRAGMA synchronous = FULL;"
      "PRAGMA wal_autocheckpoint = 512;"         // pages: 16 MiB
      "PRAGMA journal_size_limit = 67108864;");  // bytes kept for reuse
}

void CreateSchema(Database& database) {
  database.Execute("BEGIN IMMEDIATE");
  database.Execute(fmt::format("PRAGMA application_id = {};"
                               "PRAGMA user_version = {};",
                               kApplicationId,
                               kFormatVersion)
                       .c_str());
  CreateTables(database);
  database.Execute("COMMIT");
}

// Makes an empty file, or throws DiskError if the path is taken.
void CreateFile(const std::filesystem::path& path) {
  const int file =
      open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) {
    const int error = errno;
    throw DiskError(
        error == EEXIST
            ? fmt::format("{}: exists already; name another store, resume this "
                          "one or delete it",
                          path.string())
            : fmt::format("{}: cannot create the store: {}",
                          path.string(),
                          std::generic_category().message(error)));
  }
  close(file);
}

void CheckFormat(Database& database, const std::filesystem::path& path) {
  int64_t application = 0;
  int64_t version = 0;
  try {
    application = database.QueryInteger("PRAGMA application_id");
    version = database.QueryInteger("PRAGMA user_version");
  } catch (const DamagedStoreError&) {
    throw DamagedStoreError(
        fmt::format("{}: is not an Enfilade store, or its beginning is "
                    "damaged; name a file that 'enfilade solve' made, or "
                    "restore this one from a copy",
                    path.string()));
  }
  if (application != kApplicationId) {
    throw InputError(fmt::format(
        "{}: is not an Enfilade store; name a file that 'enfilade solve' made",
        path.string()));
  }
  if (version != kFormatVersion) {
    throw InputError(
        fmt::format("{}: the store has format {}, this program reads format "
                    "{}; use the program that wrote it, or solve again",
                    path.string(),
                    version,
                    kFormatVersion));
  }
}

// Whether nothing is in the journal: the file alone is the store.
bool HasNoJournal(const std::filesystem::path& path) {
  std::error_code none_there;
  const auto bytes =
      std::filesystem::file_size(Beside(path, "-wal"), none_there);
  return none_there || bytes == 0;
}

// How a store is opened that is only read. Whoever may write beside the store
// takes part in the journal's locking. Others can do so only by a journal and
// an index that are there: those of a writer at work, or of one that was
// killed. Without them and with nothing in the journal, nobody has the store
// open, and the file is taken as frozen. Throws DiskError if the journal holds
// what this reader cannot get at.
OpenMode ReadMode(const std::filesystem::path& path) {
  const auto may = [](const std::filesystem::path& file, int what) {
    return access(file.c_str(), what) == 0;
  };
  const auto folder = std::filesystem::absolute(path).parent_path();
  if (may(path, W_OK) && may(folder, W_OK)) {
    return OpenMode::kReadWrite;
  }
  const std::filesystem::path journal = Beside(path, "-wal");
  if (may(journal, R_OK) && may(Beside(path, "-shm"), R_OK)) {
    return OpenMode::kReadOnly;
  }
  if (HasNoJournal(path)) {
    return OpenMode::kReadOnlyFrozen;
  }
  throw DiskError(fmt::format(
      "{}: part of the store is still in '{}', which only a user who may write "
      "the store and its folder can fold in; have one open it once ('enfilade "
      "info'), or copy both files to a folder of your own",
      path.string(),
      journal.filename().string()));
}

std::unique_ptr<Database> Open(const std::filesystem::path& path,
                               OpenMode mode) {
  auto database = std::make_unique<Database>(path, mode);
  CheckFormat(*database, path);
  Configure(*database);
  return database;
}

std::unique_ptr<Database> OpenSnapshot(const std::filesystem::path& path,
                                       OpenMode mode) {
  auto database = Open(path, mode);
  // One read transaction: the reader sees one snapshot as long as it lives.
  database->Execute("PRAGMA query_only = ON; BEGIN");
  static_cast<void>(database->QueryInteger("SELECT count(*) FROM digest"));
  return database;
}

}  // namespace

void RequireFile(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw DiskError(fmt::format("{}: there is no such store", path.string()));
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(fmt::format("{}: is not a file", path.string()));
  }
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    throw DiskError(fmt::format("{}: {}", path.string(), error.message()));
  }
  if (size == 0) {
    throw InputError(
        fmt::format("{}: the file is empty, not an Enfilade store; delete it "
                    "and solve the scene again",
                    path.string()));
  }
}

std::unique_ptr<Database> CreateDatabase(const std::filesystem::path& path) {
  CreateFile(path);
  RemoveJournals(path);
  auto database = std::make_unique<Database>(path, OpenMode::kReadWrite);
  database->Execute("PRAGMA page_size = 32768");
  Configure(*database);
  database->Execute("PRAGMA journal_mode = WAL");
  CreateSchema(*database);
  database->Execute("PRAGMA wal_checkpoint(TRUNCATE)");
  return database;
}

std::unique_ptr<Database> OpenDatabase(const std::filesystem::path& path,
                                       StoreAccess access) {
  if (access == StoreAccess::kWrite) {
    return Open(path, OpenMode::kReadWrite);
  }
  const OpenMode mode = ReadMode(path);
  try {
    return OpenSnapshot(path, mode);
  } catch (const DiskError&) {
    // Sharing with a writer takes a file beside the store, for which a full
    // disk has no room.
    if (mode != OpenMode::kReadWrite || !HasNoJournal(path)) {
      throw;
    }
  }
  return OpenSnapshot(path, OpenMode::kReadOnlyFrozen);
}

std::unique_ptr<Database> CreateDatabaseInMemory() {
  auto database =
      std::make_unique<Database>(std::filesystem::path(), OpenMode::kMemory);
  Configure(*database);
  database->Execute("PRAGMA journal_mode = MEMORY");
  CreateSchema(*database);
  return database;
}

}  // namespace enfilade::internal
