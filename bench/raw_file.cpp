#include "bench/raw_file.h"

#include "base/error.h"

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace enfilade::bench {

RawFile::RawFile(std::filesystem::path path, int flags)
    : path_(std::move(path)),
      file_(open(path_.c_str(), flags | O_CLOEXEC, 0666)) {
  if (file_ < 0) {
    Fail("open", errno);
  }
}

RawFile::~RawFile() {
  if (file_ >= 0) {
    close(file_);
  }
}

void RawFile::Fail(const char* doing, int error) const {
  throw DiskError(fmt::format("{}: cannot {}: {}",
                              path_.string(),
                              doing,
                              std::generic_category().message(error)));
}

void RawFile::WriteAt(uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n =
        pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) {
      continue;
    }
    if (n <= 0) {
      Fail("write", n < 0 ? errno : ENOSPC);
    }
    offset += static_cast<uint64_t>(n);
    bytes = bytes.subspan(static_cast<size_t>(n));
  }
}

void RawFile::ReadAt(uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t n =
        pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) {
      continue;
    }
    if (n <= 0) {
      Fail("read", n < 0 ? errno : ENODATA);
    }
    offset += static_cast<uint64_t>(n);
    bytes = bytes.subspan(static_cast<size_t>(n));
  }
}

void RawFile::Sync() {
  if (fsync(file_) != 0) {
    Fail("sync", errno);
  }
}

void RawFile::Truncate(uint64_t bytes) {
  if (ftruncate(file_, static_cast<off_t>(bytes)) != 0) {
    Fail("truncate", errno);
  }
}

void RawFile::DropCache() {
  const int error = posix_fadvise(file_, 0, 0, POSIX_FADV_DONTNEED);
  if (error != 0) {
    Fail("drop the cache of", error);
  }
}

}  // namespace enfilade::bench
