// The right to write a store: held by one process (and one store object) at a
// time through a lock on a small file beside it, which the system drops when
// the process ends in whatever way. The file is removed on a clean end; one
// left by a killed process is harmless.

#pragma once

#include <filesystem>

namespace enfilade::internal {

// `store_path` with a suffix, e.g. "-lock", "-wal".
std::filesystem::path Beside(const std::filesystem::path& store_path,
                             const char* suffix);

class WriteLock {
 public:
  // Throws DiskError if another holds it or the file cannot be made.
  explicit WriteLock(const std::filesystem::path& store_path);
  ~WriteLock();
  WriteLock(const WriteLock&) = delete;
  WriteLock& operator=(const WriteLock&) = delete;

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace enfilade::internal
