#include "tools/commands/options.h"

#include "base/error.h"
#include "scene/number_text.h"
#include "solver/solve.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <system_error>

#include "tools/pending_file.h"
#include "tools/pipeline_state.h"
#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace enfilade {
namespace {

std::optional<uint64_t> ToWholeNumber(const std::string& text) {
  uint64_t number = 0;
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, number);
  return read.ec == std::errc() && read.ptr == end ? std::optional(number)
                                                   : std::nullopt;
}

// The bytes of a size such as 256M, 1.5G (binary multiples) or 300000; nullopt
// if `text` is no size.
std::optional<double> ToBytes(const std::string& text) {
  double number = 0;
  const char* end = text.data() + text.size();
  const auto read =
      std::from_chars(text.data(), end, number, std::chars_format::fixed);
  if (read.ec != std::errc() || !std::isfinite(number)) {
    return std::nullopt;
  }
  std::string one = '1' + std::string(read.ptr, end);
  try {
    if (!CLI::AsSizeValue(false)(one).empty()) {
      return std::nullopt;
    }
  } catch (const CLI::Error&) {
    return std::nullopt;
  }
  const auto unit = ToWholeNumber(one);
  return unit ? std::optional(std::floor(number * static_cast<double>(*unit)))
              : std::nullopt;
}

// Replaces a size by its number of bytes and the word `none` by 0. Returns an
// error message, or an empty string if `text` was valid.
std::string ReadMemorySize(std::string& text) {
  const std::string given = text;
  if (given == "none") {
    text = "0";
    return {};
  }
  constexpr double kLeastBytes = 0x1p20;  // smaller: the unit is missing
  constexpr double kMostBytes = 0x1p60;
  const std::optional<double> bytes = ToBytes(given);
  if (!bytes || *bytes <= 0 || *bytes > kMostBytes) {
    return fmt::format("'{}' is no size such as 256M, 1.5G, or none", given);
  }
  if (*bytes < kLeastBytes) {
    return fmt::format(
        "'{}' is {} bytes, in which nothing runs; write a size such as 256M or "
        "1G",
        given,
        *bytes);
  }
  text = fmt::format("{}", static_cast<uint64_t>(*bytes));
  return {};
}

const std::map<std::string, double>& MetresPerUnit() {
  static const std::map<std::string, double> units = {{"mm", 0.001},
                                                      {"cm", 0.01},
                                                      {"m", 1},
                                                      {"km", 1000},
                                                      {"in", 0.0254},
                                                      {"ft", 0.3048}};
  return units;
}

}  // namespace

void AddCommonOptions(CLI::App& command, CommonOptions& options) {
  options.limits.threads = HardwareThreads();
  command
      .add_option("--memory",
                  options.limits.memory_cap_bytes,
                  "Cap on the memory of the whole process: 256M, 1G, or none")
      ->transform(CLI::Validator(ReadMemorySize, ""))
      ->type_name("SIZE")
      ->default_str("1G");
  command
      .add_option(
          "--threads", options.limits.threads, "Threads that compute at once")
      ->check(CLI::Range(1, 4096).description(""))
      ->type_name("N")
      ->capture_default_str();
  AddReportOption(command, options.report);
  command.add_flag(
      "-v,--verbose", options.verbose, "Log to standard error what is done");
}

CLI::Validator AboveZero() {
  return {[](const std::string& text) {
            const auto number = ToNumber(text);
            return number && *number > 0
                       ? std::string()
                       : fmt::format("'{}' is not a number above 0", text);
          },
          ""};
}

CLI::Validator WholeAboveZero() {
  return {[](const std::string& text) {
            const bool is_whole =
                text.find_first_not_of("0123456789") == std::string::npos;
            return is_whole && text.find_first_not_of('0') != std::string::npos
                       ? std::string()
                       : fmt::format("'{}' is not a whole number above 0",
                                     text);
          },
          ""};
}

void AddReportOption(CLI::App& command, std::string& report) {
  command
      .add_option(
          "--report", report, "Write one JSON object on the run to this file")
      ->type_name("FILE");
}

std::string CheckSeed(const std::string& text) {
  return ToWholeNumber(text)
             ? std::string()
             : fmt::format("'{}' is no whole number from 0 to 2^64 - 1", text);
}

namespace {

// Whether both paths name the same file, which need not exist yet.
bool IsSameFile(const std::filesystem::path& a,
                const std::filesystem::path& b) {
  std::error_code none_there;
  if (std::filesystem::equivalent(a, b, none_there)) {
    return true;
  }
  const auto whole_a = std::filesystem::weakly_canonical(a, none_there);
  const auto whole_b = std::filesystem::weakly_canonical(b, none_there);
  return !whole_a.empty() && whole_a == whole_b;
}

// Whether a file with something else than a report is there. A report is one
// JSON object.
bool HoldsSomethingElse(const std::filesystem::path& report) {
  std::error_code none_there;
  if (!std::filesystem::is_regular_file(report, none_there)) {
    return false;
  }
  char first = '{';
  std::ifstream(report) >> first;
  return first != '{';
}

}  // namespace

void RequireApart(const std::filesystem::path& output,
                  std::initializer_list<std::filesystem::path> others) {
  for (const std::filesystem::path& other : others) {
    if (!other.empty() && IsSameFile(output, other)) {
      throw UsageError(fmt::format(
          "'{}' would be written over '{}', which this run needs; give another "
          "name",
          output.string(),
          other.string()));
    }
  }
}

void SetExample(CLI::App& command, const std::string& example) {
  command.footer("Example:\n  " + example);
}

void CheckReport(const std::string& report,
                 std::initializer_list<std::filesystem::path> others) {
  if (!report.empty()) {
    RequireApart(report, others);
    if (HoldsSomethingElse(report)) {
      throw UsageError(fmt::format(
          "--report '{}' would be written over a file that is not a report; "
          "give another name, or remove that file",
          report));
    }
    RequireWritable(report);
  }
}

void RequireNothingUnnamedReplaced(const std::filesystem::path& second,
                                   const std::filesystem::path& named) {
  if (second != named && std::filesystem::exists(second) &&
      !std::filesystem::exists(named)) {
    throw UsageError(fmt::format(
        "'{}' exists, and {} would be written in two files of which this is "
        "one; give another name, or remove it",
        second.string(),
        named.string()));
  }
}

void BeginRun(const CommonOptions& options,
              std::initializer_list<std::filesystem::path> others) {
  spdlog::set_level(options.verbose ? spdlog::level::info
                                    : spdlog::level::warn);
  CheckReport(options.report, others);
}

void WriteReportIfAsked(const CommonOptions& options, const Json& report) {
  if (!options.report.empty()) {
    WriteReport(options.report, report);
  }
}

std::unique_ptr<BlockStorage> OpenExistingStore(
    const std::filesystem::path& path, StoreAccess access) {
  if (!std::filesystem::exists(path)) {
    throw InputError(fmt::format(
        "there is no store '{}'; make it with 'enfilade solve SCENE -o {}'",
        path.string(),
        path.string()));
  }
  if (IsSceneName(path)) {
    throw InputError(fmt::format(
        "'{}' is a scene, not a store; make one with 'enfilade solve {} -o "
        "STORE'",
        path.string(),
        path.string()));
  }
  return OpenStore(path, access);
}

std::unique_ptr<BlockStorage> OpenSolvedStore(
    const std::filesystem::path& path) {
  auto store = OpenExistingStore(path, StoreAccess::kRead);
  if (LoadStage(*store) < Stage::kTraceable ||
      store->Count(BlockKind::kCellTree) == 0) {
    throw InputError(
        fmt::format("'{}' holds no solution yet; run 'enfilade resume {}'",
                    path.string(),
                    path.string()));
  }
  if (!LoadSummaryOf(*store, LoadSettings(*store)).converged) {
    spdlog::warn(
        "the solve in '{}' has not reached the error that was asked for: its "
        "light may be far from right; see 'enfilade info {}'",
        path.string(),
        path.string());
  }
  return store;
}

void RequireSceneFile(const std::filesystem::path& scene) {
  if (!std::filesystem::exists(scene)) {
    throw InputError(
        fmt::format("there is no scene file '{}'", scene.string()));
  }
}

void AddSceneOptions(CLI::App& command, SceneOptions& options) {
  command
      .add_option("--error",
                  options.settings.error,
                  "Relative error of the solution to reach")
      ->type_name("E")
      ->capture_default_str();
  command
      .add_option("--basis",
                  options.settings.basis,
                  "haar (or m1), m2, m3, m4, f2 or f3 (with other methods than "
                  "wavelet: haar if not given)")
      ->transform(
          CLI::Transformer(std::map<std::string, std::string>{{"m1", "haar"}})
              .description(""))
      ->check(
          CLI::IsMember({"haar", "m2", "m3", "m4", "f2", "f3"}).description(""))
      ->type_name("BASIS")
      ->capture_default_str();
  command
      .add_option("--overrides",
                  options.overrides,
                  "JSON file that sets reflectance and exitance by name "
                  "(docs/overrides.md)")
      ->type_name("FILE");
  command.add_flag("--default-luminaires",
                   options.settings.default_luminaires,
                   "Lay emitting panels on the ceilings of a model without "
                   "any light");
  command.add_flag("--photometric",
                   options.settings.photometric,
                   "Ke and exitance are lm/m2, results lux");
  command
      .add_option("--sides",
                  options.sides,
                  "Sides of a face that reflect: 1 makes every back black")
      ->check(CLI::IsMember({1, 2}).description(""))
      ->type_name("1|2");
  command
      .add_option("--unit",
                  options.unit,
                  "OBJ: the unit of its coordinates, if it is not the metre; "
                  "results are in metres")
      ->check(CLI::IsMember(MetresPerUnit()).description(""))
      ->type_name("mm|cm|m|km|in|ft");
  command.add_flag(
      "--strip-spaces",
      options.settings.strip_spaces,
      "gbXML: ignore the Spaces of the file and find cells from its "
      "walls");
}

SolveSettings SettingsOf(const std::string& scene,
                         const SceneOptions& options) {
  SolveSettings settings = options.settings;
  RequireSceneFile(scene);
  settings.scene = std::filesystem::absolute(scene).lexically_normal();
  if (!options.overrides.empty()) {
    if (!std::filesystem::exists(options.overrides)) {
      throw InputError(
          fmt::format("there is no override file '{}'", options.overrides));
    }
    settings.overrides =
        std::filesystem::absolute(options.overrides).lexically_normal();
  }
  if (options.sides != 0) {
    settings.sides = options.sides;
  }
  if (!options.unit.empty()) {
    settings.unit = MetresPerUnit().at(options.unit);
  }
  SolveOptionsOf(settings).Validate();
  return settings;
}

}  // namespace enfilade
