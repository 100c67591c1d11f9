#include "tools/export/file.h"

#include "base/error.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace enfilade {
namespace {

constexpr size_t kBufferBytes = 64 << 10;

}  // namespace

OutputFile::OutputFile(std::filesystem::path path)
    : path_(std::move(path)), pending_(path_) {
  if (pending_.IsStream()) {
    throw UsageError(fmt::format(
        "'{}' is a device or a pipe; give the name of a file", path_.string()));
  }
  descriptor_ = open(
      pending_.Path().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0) {
    Fail(errno);
  }
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
}

void OutputFile::Fail(int error) const {
  throw DiskError(fmt::format("cannot write '{}': {}",
                              path_.string(),
                              std::generic_category().message(error)));
}

void OutputFile::WriteAt(uint64_t offset, std::span<const std::byte> bytes) {
  size_ = std::max<uint64_t>(size_, offset + bytes.size());
  while (!bytes.empty()) {
    const ssize_t written = pwrite(
        descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written <= 0) {
      Fail(written < 0 ? errno : ENOSPC);
    }
    bytes = bytes.subspan(static_cast<size_t>(written));
    offset += static_cast<uint64_t>(written);
  }
}

void OutputFile::Close() {
  if (descriptor_ < 0) {
    return;
  }
  // A full disk may show only now.
  if (fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) {
    Fail(errno);
  }
  const int closed = close(descriptor_);
  descriptor_ = -1;
  if (closed != 0) {
    Fail(errno);
  }
}

void OutputFile::Finish() {
  Close();
  pending_.Keep();
}

void SectionWriter::PutBytes(std::span<const std::byte> bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) {
    Flush();
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void SectionWriter::Flush() {
  file_->WriteAt(offset_, buffer_);
  offset_ += buffer_.size();
  buffer_.clear();
}

}  // namespace enfilade
