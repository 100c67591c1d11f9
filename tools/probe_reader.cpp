#include "base/error.h"
#include "scene/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <string_view>

#include "tools/probe_points.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr size_t kMostLineBytes = size_t{64} << 10;

constexpr size_t kFields = 6;
constexpr double kMostCoordinateM = 1e9;
constexpr std::array<const char*, kFields> kNames = {
    "x", "y", "z", "nx", "ny", "nz"};
constexpr const char* kResultColumns = "irradiance_r,irradiance_g,irradiance_b";

std::string_view Trim(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  const size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

// Splits off the field up to the next comma. Returns nothing if none is left.
std::optional<std::string_view> TakeField(
    std::optional<std::string_view>& rest) {
  if (!rest) {
    return std::nullopt;
  }
  const size_t comma = rest->find(',');
  const std::string_view field = Trim(rest->substr(0, comma));
  if (comma == std::string_view::npos) {
    rest.reset();
  } else {
    rest = rest->substr(comma + 1);
  }
  return field;
}

// The columns of a line. A comma within quotes belongs to its field; quotes
// count in fields that begin with one: others are marks of inches.
size_t CountColumns(std::string_view line) {
  size_t columns = 1;
  bool is_new = true;  // nothing but blanks in the field so far
  bool has_quotes = false;
  bool is_open = false;
  for (const char c : line) {
    if (c == ',' && !is_open) {
      ++columns;
      is_new = true;
      has_quotes = false;
    } else if (c == '"' && (is_new || has_quotes)) {
      has_quotes = true;
      is_open = !is_open;
      is_new = false;
    } else {
      is_new = is_new && (c == ' ' || c == '\t');
    }
  }
  return columns;
}

bool BeginsWithNumber(const std::string& line) {
  std::optional<std::string_view> rest = line;
  const auto field = TakeField(rest);
  return field && IsNumber(*field);
}

}  // namespace

ProbeReader::ProbeReader(std::istream& input, std::string name)
    : input_(&input), name_(std::move(name)), buffer_(kMostLineBytes + 1) {}

// Reads the next line without its end. The last line may have no end.
bool ProbeReader::ReadLine(std::string* line) {
  input_->getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  const auto count = static_cast<size_t>(input_->gcount());
  if (count + 1 == buffer_.size() && input_->fail() && !input_->eof()) {
    throw InputError(
        fmt::format("{}:{}: a line of more than {} KiB: is this a "
                    "file of points?",
                    name_,
                    line_number_ + 1,
                    kMostLineBytes >> 10));
  }
  if (input_->fail()) {
    return false;
  }
  ++line_number_;
  line->assign(buffer_.data(), input_->eof() ? count : count - 1);
  return true;
}

std::optional<std::string> ProbeReader::NextLine() {
  std::string line;
  while (ReadLine(&line)) {
    if (line_number_ == 1 && line.starts_with("\xef\xbb\xbf")) {
      line.erase(0, 3);  // byte order mark
    }
    const std::string_view trimmed = Trim(line);
    if (!trimmed.empty() && !trimmed.starts_with('#')) {
      return std::string(trimmed);
    }
  }
  if (input_->bad()) {
    throw DiskError(fmt::format("cannot read the points '{}'", name_));
  }
  return std::nullopt;
}

// Columns are read by position, so a header may give them other names. Throws
// InputError if a known name is at another position, if columns are missing, if
// a name is a number, or if the header begins like a number but is none.
void ProbeReader::CheckHeader(const std::string& header) const {
  bool fits = std::string_view("+-.0123456789").find(header.front()) ==
              std::string_view::npos;
  std::optional<std::string_view> rest = header;
  size_t fields = 0;
  for (size_t i = 0; rest; ++i) {
    const std::string_view name = *TakeField(rest);
    const auto* const known = std::find(kNames.begin(), kNames.end(), name);
    const auto place = static_cast<size_t>(known - kNames.begin());
    fits = fits && !IsNumber(name) && (known == kNames.end() || place == i);
    ++fields;
  }
  if (!fits || fields < kNames.size()) {
    throw InputError(
        fmt::format("{}:{}: the columns must be x,y,z,nx,ny,nz in this order, "
                    "with commas between them",
                    name_,
                    line_number_));
  }
}

std::string ProbeReader::Header() {
  pending_ = NextLine();
  if (pending_ && !BeginsWithNumber(*pending_)) {
    CheckHeader(*pending_);
    columns_ = CountColumns(*pending_);
    std::string header = *pending_ + "," + kResultColumns;
    pending_ = NextLine();
    return header;
  }
  columns_ = std::max(kFields, pending_ ? CountColumns(*pending_) : 0);
  std::string header;
  for (size_t i = 0; i < columns_; ++i) {
    header += i < kFields ? std::string(kNames[i]) + ","
                          : fmt::format("column_{},", i + 1);
  }
  return header + kResultColumns;
}

std::optional<ProbeLine> ProbeReader::Next() {
  const auto line = pending_ ? std::exchange(pending_, {}) : NextLine();
  if (!line) {
    return std::nullopt;
  }
  return Parse(*line);
}

ProbeLine ProbeReader::Parse(const std::string& line) const {
  std::array<double, kFields> values{};
  std::optional<std::string_view> rest = line;
  for (size_t i = 0; i < kFields; ++i) {
    const auto field = TakeField(rest);
    if (!field) {
      throw InputError(fmt::format(
          "{}:{}: a point needs six numbers, x,y,z,nx,ny,nz; this line has {}",
          name_,
          line_number_,
          i));
    }
    const auto value = ToNumber(*field);
    if (!value) {
      throw InputError(fmt::format("{}:{}: {} is '{}', not a finite number",
                                   name_,
                                   line_number_,
                                   kNames[i],
                                   *field));
    }
    values[i] = *value;
  }
  if (CountColumns(line) != columns_) {
    throw InputError(
        fmt::format("{}:{}: this line has {} columns, those before it have {}; "
                    "the results would stand under other names",
                    name_,
                    line_number_,
                    CountColumns(line),
                    columns_));
  }
  if (!std::all_of(values.begin(), values.begin() + 3, [](double value) {
        return std::abs(value) <= kMostCoordinateM;
      })) {
    throw InputError(
        fmt::format("{}:{}: the point ({}, {}, {}) is farther than {:.0e} m "
                    "from the origin",
                    name_,
                    line_number_,
                    values[0],
                    values[1],
                    values[2],
                    kMostCoordinateM));
  }
  ProbeLine result;
  result.text = line;
  result.receiver.position = {values[0], values[1], values[2]};
  const Vec3 normal{values[3], values[4], values[5]};
  const double length = Length(normal);
  if (!(length > 0) || !std::isfinite(length)) {
    throw InputError(
        fmt::format("{}:{}: the normal ({}, {}, {}) has no direction",
                    name_,
                    line_number_,
                    normal.x,
                    normal.y,
                    normal.z));
  }
  result.receiver.normal = normal / length;
  return result;
}

}  // namespace enfilade
