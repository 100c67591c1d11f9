#include "tools/export/spool.h"

#include "base/error.h"

#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>

#include "tools/temporary_path.h"
#include <fmt/format.h>
#include <unistd.h>

namespace enfilade {
namespace {

[[noreturn]] void Fail(const char* what, int error) {
  throw DiskError(fmt::format(
      "cannot {} a temporary file in '{}': {}; make room there, or name "
      "another folder in the environment variable TMPDIR",
      what,
      TemporaryPath().string(),
      std::generic_category().message(error)));
}

}  // namespace

Spool::Spool(size_t record_bytes) : record_bytes_(record_bytes) {
  std::string name = TemporaryPath() / "enfilade_XXXXXX";
  descriptor_ = mkstemp(name.data());
  if (descriptor_ < 0) {
    Fail("create", errno);
  }
  unlink(name.c_str());
}

Spool::~Spool() {
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
}

Spool::Spool(Spool&& other) noexcept
    : record_bytes_(other.record_bytes_),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

void Spool::Write(uint64_t first, std::span<const std::byte> records) {
  auto offset = static_cast<off_t>(first * record_bytes_);
  while (!records.empty()) {
    const ssize_t written =
        pwrite(descriptor_, records.data(), records.size(), offset);
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written <= 0) {
      Fail("write", written < 0 ? errno : ENOSPC);
    }
    records = records.subspan(static_cast<size_t>(written));
    offset += written;
  }
}

void Spool::Read(uint64_t first, std::span<std::byte> records) const {
  auto offset = static_cast<off_t>(first * record_bytes_);
  while (!records.empty()) {
    const ssize_t got =
        pread(descriptor_, records.data(), records.size(), offset);
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0) {
      Fail("read back", got < 0 ? errno : EIO);
    }
    records = records.subspan(static_cast<size_t>(got));
    offset += got;
  }
}

}  // namespace enfilade
