// A file descriptor that is closed by its destructor. Reads and writes are
// complete or throw.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <utility>

namespace enfilade::bench {

// All members throw DiskError with the path.
class RawFile {
 public:
  RawFile(std::filesystem::path path, int flags);
  ~RawFile();

  RawFile(RawFile&& other) noexcept
      : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}

  RawFile& operator=(RawFile&&) = delete;
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;

  void WriteAt(uint64_t offset, std::span<const std::byte> bytes);
  // Fills `bytes`; throws DiskError if the file ends before.
  void ReadAt(uint64_t offset, std::span<std::byte> bytes) const;
  void Sync();
  void Truncate(uint64_t bytes);
  // Asks the system to drop the file's pages from its cache. Pages that are not
  // on the disk yet stay.
  void DropCache();

  [[nodiscard]] const std::filesystem::path& Path() const { return path_; }

 private:
  [[noreturn]] void Fail(const char* doing, int error) const;

  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace enfilade::bench
