#include "tools/study/lines.h"

#include "base/error.h"

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Whether the line has all that every run writes. Lines of other versions may
// not.
bool IsOfStudy(const Json& line) {
  const auto has = [&](const char* key, auto is_kind) {
    const auto at = line.find(key);
    return at != line.end() && is_kind(*at);
  };
  return line.is_object() && line.contains("key") &&
         has("method", [](const Json& j) { return j.is_string(); }) &&
         has("out_of_time", [](const Json& j) { return j.is_boolean(); }) &&
         has("exit_code", [](const Json& j) { return j.is_number_integer(); });
}

// Throws DiskError.
std::ifstream OpenStudy(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw DiskError(fmt::format("cannot read '{}': {}",
                                file.string(),
                                std::generic_category().message(errno)));
  }
  return in;
}

}  // namespace

std::vector<Json> LoadStudy(const std::filesystem::path& file) {
  std::vector<Json> lines;
  if (!std::filesystem::exists(file)) {
    return lines;
  }
  std::ifstream in = OpenStudy(file);
  for (std::string text; std::getline(in, text);) {
    Json line = Json::parse(text, nullptr, false);
    if (IsOfStudy(line)) {
      lines.push_back(std::move(line));
    }
  }
  return lines;
}

void CutTornLine(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) {
    return;
  }
  uintmax_t whole = 0;
  std::ifstream in = OpenStudy(file);
  for (std::string text; std::getline(in, text) && !in.eof();) {
    whole += text.size() + 1;
  }
  in.close();
  std::error_code failed;
  std::filesystem::resize_file(file, whole, failed);
  if (failed) {
    throw DiskError(
        fmt::format("cannot write '{}': {}", file.string(), failed.message()));
  }
}

double Number(const Json& line, const char* key) {
  const auto at = line.find(key);
  return at != line.end() && at->is_number() ? at->get<double>() : NAN;
}

std::string MethodOf(const Json& line) {
  return line.at("method").get<std::string>();
}

double ErrorOf(const Json& line) {
  const double verified = Number(line, "verified_error");
  return std::isfinite(verified) ? verified : Number(line, "rms_error");
}

bool EndedWithResult(int exit_code) {
  return exit_code == static_cast<int>(ExitCode::kSuccess) ||
         exit_code == static_cast<int>(ExitCode::kNotDone);
}

bool IsFinished(const Json& line) {
  return !line.at("out_of_time").get<bool>() &&
         EndedWithResult(line.at("exit_code").get<int>()) &&
         line.contains("links");
}

std::set<std::string> MethodsOf(const std::vector<Json>& lines) {
  std::set<std::string> methods;
  for (const Json& line : lines) {
    methods.insert(MethodOf(line));
  }
  return methods;
}

std::set<double> ValuesOf(const std::vector<Json>& lines) {
  std::set<double> values;
  for (const Json& line : lines) {
    values.insert(Number(line, "value"));
  }
  return values;
}

NumberOf NumberAt(const char* key) {
  return [key](const Json& line) { return Number(line, key); };
}

Groups Collect(const std::vector<Json>& lines,
               const std::function<std::string(const Json&)>& group,
               const NumberOf& x,
               const NumberOf& y) {
  Groups groups;
  for (const Json& line : lines) {
    if (IsFinished(line)) {
      groups[group(line)].emplace_back(x(line), y(line));
    }
  }
  return groups;
}

Groups RunsAt(double value, const std::vector<Json>& lines, const char* cost) {
  std::vector<Json> at;
  for (const Json& line : lines) {
    if (Number(line, "value") == value) {
      at.push_back(line);
    }
  }
  return Collect(at, MethodOf, NumberAt(cost), ErrorOf);
}

}  // namespace enfilade
