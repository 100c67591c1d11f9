#include "store/write_lock.h"

#include "base/error.h"

#include <cerrno>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace enfilade::internal {
namespace {

std::string SystemMessage(int error) {
  return std::generic_category().message(error);
}

// Whether the path still names the open file: the last owner of the lock may
// have removed the file between open() and flock().
bool IsStillAt(int file, const std::filesystem::path& path) {
  struct stat opened {};

  struct stat named {};

  return fstat(file, &opened) == 0 && stat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

std::filesystem::path Beside(const std::filesystem::path& store_path,
                             const char* suffix) {
  std::filesystem::path path = store_path;
  path += suffix;
  return path;
}

WriteLock::WriteLock(const std::filesystem::path& store_path)
    : path_(Beside(store_path, "-lock")) {
  while (true) {
    file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file_ < 0) {
      const std::filesystem::path folder = path_.parent_path();
      std::error_code failed;
      if (!folder.empty() && !std::filesystem::is_directory(folder, failed)) {
        throw DiskError(
            fmt::format("{}: there is no folder '{}'; make it first",
                        store_path.string(),
                        folder.string()));
      }
      throw DiskError(fmt::format("{}: cannot write beside the store: {}",
                                  path_.string(),
                                  SystemMessage(errno)));
    }
    if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      close(file_);
      throw DiskError(
          error == EWOULDBLOCK
              ? fmt::format("{}: another program is writing this store; wait "
                            "until it is done, or stop it",
                            store_path.string())
              : fmt::format("{}: cannot lock: {}",
                            path_.string(),
                            SystemMessage(error)));
    }
    if (IsStillAt(file_, path_)) {
      return;
    }
    close(file_);
  }
}

WriteLock::~WriteLock() {
  unlink(path_.c_str());
  close(file_);
}

}  // namespace enfilade::internal
