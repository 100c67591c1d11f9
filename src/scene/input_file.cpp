#include "scene/input_file.h"

#include "base/error.h"
#include "base/stop.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>
#include <zlib.h>

namespace enfilade {
namespace {

constexpr size_t kChunkBytes = size_t{1} << 16;
constexpr unsigned kMostReadBytes = 1U << 30;

// Fits a face of 40,000 corners with texture and normal indices. Parsing a line
// takes up to sixty times its bytes for a while, which nobody charges.
constexpr size_t kMostLineBytes = size_t{1} << 20;

gzFile AsGz(void* file) {
  return static_cast<gzFile>(file);
}

void CutBlanksAtEnd(std::string& line) {
  const size_t last = line.find_last_not_of(" \t");
  line.resize(last == std::string::npos ? 0 : last + 1);
}

bool IsBlank(char c) {
  return c == ' ' || c == '\t';
}

// Whether numbers follow the key. After other keys a name may hold a '#'.
bool IsKeyOfNumbers(std::string_view key) {
  constexpr std::array<std::string_view, 15> kKeys = {"v",
                                                      "vn",
                                                      "vt",
                                                      "vp",
                                                      "f",
                                                      "l",
                                                      "p",
                                                      "s",
                                                      "Ka",
                                                      "Kd",
                                                      "Ks",
                                                      "Ke",
                                                      "d",
                                                      "Tr",
                                                      "Ns"};
  return std::find(kKeys.begin(), kKeys.end(), key) != kKeys.end();
}

// Cuts the comment that a '#' after a blank begins, in lines of numbers only.
void CutComment(std::string& line) {
  const auto begin = std::find_if_not(line.begin(), line.end(), IsBlank);
  const auto end = std::find_if(begin, line.end(), IsBlank);
  if (!IsKeyOfNumbers({begin, end})) {
    return;
  }
  const auto comment = std::adjacent_find(
      end, line.end(), [](char a, char b) { return IsBlank(a) && b == '#'; });
  line.erase(comment, line.end());
}

// A comment is never continued: a path in it may end with a backslash.
bool IsComment(const std::string& line) {
  const size_t begin = line.find_first_not_of(" \t");
  return begin != std::string::npos && line[begin] == '#';
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& path) : path_(path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) {
    throw InputError(
        fmt::format("{}: is a folder; give a file", path.string()));
  }
  if (std::filesystem::exists(path, code) &&
      !std::filesystem::is_regular_file(path, code)) {
    throw InputError(
        fmt::format("{}: is a device or a pipe; input is read more than once: "
                    "save it as a file first",
                    path.string()));
  }
  file_ = gzopen(path.c_str(), "rb");
  if (file_ == nullptr) {
    throw InputError(fmt::format(
        "{}: cannot be opened; check that the file exists and is readable",
        path.string()));
  }
  gzbuffer(AsGz(file_), kChunkBytes);
  size_bytes_ = std::filesystem::file_size(path, code);
  if (code) {
    size_bytes_ = 0;  // Fraction() stays 0
  }
}

InputFile::~InputFile() {
  gzclose(AsGz(file_));
}

size_t InputFile::Read(std::span<char> buffer) {
  ThrowIfStopRequested();
  const auto wanted =
      static_cast<unsigned>(std::min<size_t>(buffer.size(), kMostReadBytes));
  const int got = gzread(AsGz(file_), buffer.data(), wanted);
  int code = Z_OK;
  const char* message = gzerror(AsGz(file_), &code);
  if (code == Z_ERRNO) {
    throw DiskError(
        fmt::format("{}: cannot be read: {}", path_.string(), message));
  }
  if (got < 0 || (code != Z_OK && code != Z_STREAM_END)) {
    throw InputError(fmt::format(
        "{}: cannot be read: {}; the file may be cut off or damaged",
        path_.string(),
        message));
  }
  return static_cast<size_t>(got);
}

double InputFile::Fraction() const {
  const auto at = static_cast<double>(gzoffset(AsGz(file_)));
  return size_bytes_ == 0
             ? 0.0
             : std::min(1.0, at / static_cast<double>(size_bytes_));
}

bool Exists(const std::filesystem::path& path) {
  std::error_code code;
  return std::filesystem::exists(path, code);
}

bool IsFile(const std::filesystem::path& path) {
  std::error_code code;
  return std::filesystem::is_regular_file(path, code);
}

void VisitFile(const std::filesystem::path& path,
               uint64_t most_bytes,
               const std::function<void(std::span<const char>)>& visit) {
  InputFile file(path);
  uint64_t length = 0;
  std::array<char, kChunkBytes> chunk{};
  while (const size_t got = file.Read(chunk)) {
    length += got;
    if (length > most_bytes) {
      throw InputError(
          fmt::format("{}: longer than {} MiB, which is not "
                      "plausible for this kind of file",
                      path.string(),
                      most_bytes >> 20));
    }
    visit(std::span(chunk).first(got));
  }
}

std::string ReadWholeFile(const std::filesystem::path& path,
                          uint64_t most_bytes) {
  std::string text;
  uint64_t length = 0;
  VisitFile(path, most_bytes, [&](std::span<const char> chunk) {
    length += chunk.size();
  });
  text.reserve(length);  // a growing string takes up to three times as much
  VisitFile(path, most_bytes, [&](std::span<const char> chunk) {
    text.append(chunk.data(), chunk.size());
  });
  return text;
}

LineStream::LineStream(InputFile& file, LineCheck check)
    : file_(&file), check_(std::move(check)), chunk_(kChunkBytes, '\0') {}

int LineStream::NextByte() {
  if (chunk_at_ == chunk_size_) {
    chunk_size_ = file_->Read(chunk_);
    chunk_at_ = 0;
    if (chunk_size_ == 0) {
      return traits_type::eof();
    }
  }
  return static_cast<unsigned char>(chunk_[chunk_at_++]);
}

bool LineStream::ReadPhysicalLine(std::string& line) {
  line.clear();
  int byte = NextByte();
  if (byte == traits_type::eof()) {
    return false;
  }
  while (byte != traits_type::eof() && byte != '\n' && byte != '\r') {
    if (line.size() == kMostLineBytes) {
      ThrowTooLong(physical_lines_ + 1);
    }
    line.push_back(static_cast<char>(byte));
    byte = NextByte();
  }
  if (byte == '\r') {
    const int next = NextByte();
    if (next != '\n' && next != traits_type::eof()) {
      --chunk_at_;
    }
  }
  if (++physical_lines_ == 1 && line.starts_with("\xef\xbb\xbf")) {
    line.erase(0, 3);  // byte order mark
  }
  CutBlanksAtEnd(line);
  return true;
}

void LineStream::ThrowTooLong(uint64_t line) const {
  throw InputError(
      fmt::format("{}:{}: the line is longer than {} MiB, which no face needs; "
                  "break it up, or give a file that is text",
                  file_->Path().string(),
                  line,
                  kMostLineBytes >> 20));
}

LineStream::int_type LineStream::underflow() {
  current_.clear();
  if (!ReadPhysicalLine(physical_)) {
    return traits_type::eof();
  }
  line_ = physical_lines_;
  current_ = physical_;
  const bool is_comment = IsComment(current_);
  while (!is_comment && current_.ends_with('\\') &&
         ReadPhysicalLine(physical_)) {
    current_.back() = ' ';
    if (current_.size() + physical_.size() > kMostLineBytes) {
      ThrowTooLong(line_);
    }
    current_ += physical_;
  }
  CutComment(current_);
  CutBlanksAtEnd(current_);
  check_(current_);
  current_.push_back('\n');
  setg(current_.data(), current_.data(), current_.data() + current_.size());
  return traits_type::to_int_type(current_.front());
}

}  // namespace enfilade
