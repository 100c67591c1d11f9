#include "store/store_files.h"

#include "base/check.h"
#include "base/error.h"
#include "store/sqlite_db.h"
#include "store/sqlite_store.h"
#include "store/store_database.h"
#include "store/write_lock.h"

#include <string>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace enfilade {
namespace {

using internal::Beside;

// The message without its remedy, which is meant for stores that hold work.
std::string Cause(const DiskError& error) {
  const std::string what = error.what();
  return what.substr(0, what.find(';'));
}

// Moves all commits from the journal into the main file. Closing does so too,
// but does not report a failure.
void FoldJournal(const std::filesystem::path& path) {
  const auto database = internal::OpenDatabase(path, StoreAccess::kWrite);
  const bool is_busy =
      database->QueryInteger("PRAGMA wal_checkpoint(TRUNCATE)") != 0;
  if (is_busy) {
    throw DiskError(fmt::format("{}: another program reads it", path.string()));
  }
}

// Makes the names in a file's folder durable, where the file system can: what
// is committed under a name later must not be found under the old one after a
// power failure.
void SyncFolderOf(const std::filesystem::path& path) {
  const std::filesystem::path folder =
      path.has_parent_path() ? path.parent_path() : ".";
  const int descriptor =
      open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    fsync(descriptor);
    close(descriptor);
  }
}

// Renames a store that is closed and whose journal is empty.
void RenameOrThrow(const std::filesystem::path& from,
                   const std::filesystem::path& to) {
  std::error_code absent;
  const auto journal_bytes =
      std::filesystem::file_size(Beside(from, "-wal"), absent);
  ENFILADE_CHECK(absent || journal_bytes == 0,
                 "{} has a journal of {} bytes",
                 from.string(),
                 journal_bytes);
  std::error_code failed;
  std::filesystem::rename(from, to, failed);
  if (failed) {
    RemoveStoreFiles(from);
    throw DiskError(fmt::format(
        "cannot make the store '{}': {}", to.string(), failed.message()));
  }
  SyncFolderOf(to);
}

}  // namespace

std::unique_ptr<BlockStorage> MakeStore(
    const std::filesystem::path& path,
    const std::function<void(BlockStorage&)>& fill) {
  {
    const internal::WriteLock lock(path);
    // A dangling link counts as existing: the rename would replace it.
    if (std::filesystem::exists(std::filesystem::symlink_status(path))) {
      throw DiskError(fmt::format(
          "'{}' exists; remove it, or give another name", path.string()));
    }
    internal::RemoveJournals(path);
    const std::filesystem::path part = Beside(path, ".part");
    RemoveStoreFiles(part);
    try {
      const auto store = CreateStore(part);
      fill(*store);
      store->Commit();
      FoldJournal(part);
    } catch (const DiskError& error) {
      RemoveStoreFiles(part);
      throw DiskError(
          fmt::format("cannot make the store '{}': {}; nothing of it is kept",
                      path.string(),
                      Cause(error)));
    } catch (...) {
      RemoveStoreFiles(part);
      throw;
    }
    RenameOrThrow(part, path);
  }
  return OpenStore(path, StoreAccess::kWrite);
}

void RemoveStoreFiles(const std::filesystem::path& path) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal", "-lock"}) {
    std::error_code ignored;
    std::filesystem::remove(Beside(path, suffix), ignored);
  }
}

void internal::RemoveJournals(const std::filesystem::path& path) {
  for (const char* suffix : {"-wal", "-shm", "-journal"}) {
    const std::filesystem::path journal = Beside(path, suffix);
    std::error_code failed;
    std::filesystem::remove(journal, failed);
    if (failed) {
      throw DiskError(fmt::format(
          "cannot remove '{}', which a store that is gone has left behind: {}",
          journal.string(),
          failed.message()));
    }
  }
}

}  // namespace enfilade
