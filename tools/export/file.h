// Files that appear under their name only when they are complete, and that are
// written at several offsets side by side.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "tools/pending_file.h"

namespace enfilade {

// A file that gets its name in Finish(); without Finish() no file is left
// (PendingFile). All members throw DiskError. The constructor throws UsageError
// if the path is a device or a pipe, which cannot be written at several
// offsets.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void WriteAt(uint64_t offset, std::span<const std::byte> bytes);

  // Size so far: the end of the farthest write.
  [[nodiscard]] uint64_t Size() const { return size_; }

  // Makes all bytes durable and closes. No more can be written.
  void Close();

  // Closes, unless that is done, and gives the file its name.
  void Finish();

 private:
  [[noreturn]] void Fail(int error) const;

  std::filesystem::path path_;
  PendingFile pending_;
  int descriptor_ = -1;
  uint64_t size_ = 0;
};

// Appends to a run of bytes within a file through a small buffer. Flush() must
// be called before the file is finished. The file must outlive the writer.
class SectionWriter {
 public:
  SectionWriter(OutputFile& file, uint64_t offset)
      : file_(&file), offset_(offset) {}

  template <typename T>
  void Put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    PutBytes(std::as_bytes(std::span(&value, 1)));
  }

  void PutText(std::string_view text) {
    PutBytes(std::as_bytes(std::span(text)));
  }

  void PutBytes(std::span<const std::byte> bytes);
  void Flush();

  // Offset in the file of the next byte.
  [[nodiscard]] uint64_t Position() const { return offset_ + buffer_.size(); }

 private:
  OutputFile* file_;
  uint64_t offset_;
  std::vector<std::byte> buffer_;
};

}  // namespace enfilade
