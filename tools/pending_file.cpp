#include "tools/pending_file.h"

#include "base/error.h"

#include <cerrno>
#include <fstream>
#include <iostream>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Fail(const fs::path& path, const std::string& reason) {
  throw DiskError(fmt::format("cannot write '{}': {}", path.string(), reason));
}

// Whether the path is a device or a pipe. /dev/stdout, /dev/stderr and /dev/fd
// count as such even if they lead to a file, because that file is already open
// and must not be replaced. Files below /dev/shm are ordinary files.
bool IsStreamAt(const fs::path& path) {
  std::error_code failed;
  const std::string name = fs::absolute(path, failed).lexically_normal();
  return name == "/dev/stdout" || name == "/dev/stderr" ||
         name.starts_with("/dev/fd/") ||
         (fs::exists(path, failed) && !fs::is_regular_file(path, failed));
}

// The file that a path leads to, symbolic links followed. The file need not
// exist yet.
fs::path TargetOf(fs::path path) {
  constexpr int kMostLinks = 40;  // as many as Linux follows
  std::error_code failed;
  for (int links = 0; fs::is_symlink(path, failed) && !IsStreamAt(path);
       ++links) {
    if (links == kMostLinks) {
      Fail(path, "its symbolic links lead in a circle");
    }
    path = path.parent_path() / fs::read_symlink(path);
  }
  return path;
}

// The stream of the process that the path names, if it names one. Opened anew,
// a file that the stream leads to would be written from its beginning, over
// what the program has printed.
std::ostream* StandardStreamAt(const fs::path& path) {
  if (path == "/dev/stdout" || path == "/dev/fd/1") {
    return &std::cout;
  }
  return path == "/dev/stderr" || path == "/dev/fd/2" ? &std::cerr : nullptr;
}

// Waits until the content is on the disk, where the file system can: otherwise
// a power failure could leave the new name on an empty file.
void Sync(const fs::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) {
    Fail(path, std::generic_category().message(errno));
  }
  const int error = fsync(file) == 0 ? 0 : errno;
  close(file);
  if (error != 0 && error != EINVAL && error != EROFS) {
    Fail(path, std::generic_category().message(error));
  }
}

}  // namespace

PendingFile::PendingFile(const fs::path& path)
    : target_(TargetOf(path)), part_(target_) {
  RequireWritable(path);
  if (!IsStreamAt(target_)) {
    part_ += ".part";
  }
}

PendingFile::~PendingFile() {
  if (!kept_ && !IsStream()) {
    std::error_code ignored;
    fs::remove(part_, ignored);
  }
}

void PendingFile::Keep() {
  if (!IsStream()) {
    Sync(part_);
    std::error_code failed;
    fs::rename(part_, target_, failed);
    if (failed) {
      Fail(target_, failed.message());
    }
  }
  kept_ = true;
}

void WriteFileInOneStep(const fs::path& path,
                        const std::function<void(std::ostream&)>& write) {
  if (std::ostream* stream = StandardStreamAt(path)) {
    write(*stream);
    stream->flush();
    if (!*stream) {
      Fail(path, "the stream is closed or full");
    }
    return;
  }
  PendingFile pending(path);
  std::ofstream file(pending.Path(), std::ios::binary | std::ios::trunc);
  int error = errno;
  if (file) {
    write(file);
    file.flush();
    error = errno;
    file.close();
  }
  if (!file) {
    Fail(path, std::system_category().message(error));
  }
  pending.Keep();
}

void RequireWritable(const fs::path& path) {
  const fs::path target = TargetOf(path);
  std::error_code failed;
  if (fs::is_directory(target, failed)) {
    Fail(path, "it is a folder");
  }
  if (IsStreamAt(target)) {
    return;
  }
  const fs::path folder =
      target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, failed)) {
    Fail(
        path,
        fmt::format("there is no folder '{}'; make it first", folder.string()));
  }
  if (access(folder.c_str(), W_OK) != 0) {
    Fail(path, std::generic_category().message(errno));
  }
}

}  // namespace enfilade
