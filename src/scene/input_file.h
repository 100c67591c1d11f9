// Reading input files: plain or gzipped, whole or line by line.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <streambuf>
#include <string>
#include <string_view>

namespace enfilade {

// The bytes of a file; a gzip file of any name is decompressed.
class InputFile {
 public:
  // Throws InputError if the file cannot be opened.
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  InputFile(InputFile&&) = delete;
  InputFile& operator=(InputFile&&) = delete;

  // Fills the buffer as far as the file goes; returns the bytes read, 0 at the
  // end. Throws InputError for damaged compressed data, DiskError if the disk
  // fails.
  size_t Read(std::span<char> buffer);

  // The fraction of the file's (compressed) bytes that were read, in [0, 1].
  [[nodiscard]] double Fraction() const;

  [[nodiscard]] const std::filesystem::path& Path() const { return path_; }

 private:
  std::filesystem::path path_;
  void* file_ = nullptr;
  uint64_t size_bytes_ = 0;
};

// Whether anything exists at the path (Exists), or a regular file (IsFile).
// Both are false if the system cannot tell, as for a name too long for any
// file.
bool Exists(const std::filesystem::path& path);
bool IsFile(const std::filesystem::path& path);

// Passes the decompressed bytes of a file to `visit`, piece by piece. Throws
// InputError if there are more than `most_bytes`.
void VisitFile(const std::filesystem::path& path,
               uint64_t most_bytes,
               const std::function<void(std::span<const char>)>& visit);

// The whole decompressed file; throws as VisitFile does.
std::string ReadWholeFile(const std::filesystem::path& path,
                          uint64_t most_bytes);

// Hands a text to a std::istream one logical line at a time. Lines end with LF,
// CRLF or CR; a backslash at the end joins the next line unless the line is a
// comment (#); trailing blanks and comments after numbers are cut. The parser
// of the stream can thus ask for the current line number, and `check` sees each
// line before the parser does. Reading throws InputError if a line, joined
// lines included, is longer than 1 MiB.
class LineStream : public std::streambuf {
 public:
  using LineCheck = std::function<void(std::string_view line)>;

  LineStream(InputFile& file, LineCheck check);

  // 1-based number of the first physical line of the line last handed out.
  [[nodiscard]] uint64_t Line() const { return line_; }

 protected:
  int_type underflow() override;

 private:
  bool ReadPhysicalLine(std::string& line);
  int NextByte();
  [[noreturn]] void ThrowTooLong(uint64_t line) const;

  InputFile* file_;
  LineCheck check_;
  std::string chunk_;
  size_t chunk_at_ = 0;
  size_t chunk_size_ = 0;
  std::string current_;
  std::string physical_;
  uint64_t line_ = 0;
  uint64_t physical_lines_ = 0;
};

}  // namespace enfilade
