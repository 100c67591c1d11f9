// The right to write a store, which one process (and one store object) holds at
// a time by a lock on an empty file beside the store. The system drops the lock
// however the process ends. A clean end removes the file; one that a killed
// process leaves is harmless.

#pragma once

#include <filesystem>

namespace enfilade::internal {

// `store_path` with a suffix, e.g. "-lock", "-wal".
std::filesystem::path Beside(const std::filesystem::path& store_path,
                             const char* suffix);

class WriteLock {
 public:
  // Throws DiskError if the lock is taken or the file cannot be made.
  explicit WriteLock(const std::filesystem::path& store_path);
  ~WriteLock();
  WriteLock(const WriteLock&) = delete;
  WriteLock& operator=(const WriteLock&) = delete;

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace enfilade::internal
