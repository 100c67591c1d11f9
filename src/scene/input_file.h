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

// The bytes of a file, decompressed if it is a gzip file whatever its name.
class InputFile {
 public:
  // Throws InputError if it cannot be opened.
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  InputFile(InputFile&&) = delete;
  InputFile& operator=(InputFile&&) = delete;

  // Fills the buffer as far as the file goes; returns the bytes read, 0 at the
  // end. Throws InputError for damaged compressed data.
  size_t Read(std::span<char> buffer);

  // How far the file has been read, in [0, 1], compressed bytes counted.
  [[nodiscard]] double Fraction() const;

  [[nodiscard]] const std::filesystem::path& Path() const { return path_; }

 private:
  std::filesystem::path path_;
  void* file_ = nullptr;
  uint64_t size_bytes_ = 0;
};

// Whether something is at the path, or a file. Neither is where that cannot be
// found out: a name may be too long for any file.
bool Exists(const std::filesystem::path& path);
bool IsFile(const std::filesystem::path& path);

// The bytes of a file once decompressed, one piece after the other. Throws
// InputError when it is longer than `most_bytes`.
void VisitFile(const std::filesystem::path& path,
               uint64_t most_bytes,
               const std::function<void(std::span<const char>)>& visit);

// The whole file; throws likewise.
std::string ReadWholeFile(const std::filesystem::path& path,
                          uint64_t most_bytes);

// Hands a text to a std::istream one logical line at a time: lines end with
// LF, CRLF or CR, a backslash at the end joins the next line unless the line is
// a comment (#), trailing blanks are cut, and comments behind numbers. So
// whoever parses the stream can ask which line it is at, and `check` sees each
// line before the parser does. Reading throws InputError for a line of more
// than 1 MiB, joined ones counted.
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
