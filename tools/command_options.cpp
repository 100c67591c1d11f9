#include "tools/command_options.h"

#include "base/error.h"

#include "tools/pipeline_state.h"
#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace enfilade {
namespace {

// 256M or 1G, in binary multiples, to a number of bytes; none to 0. Returns
// what is wrong, or nothing.
std::string ReadMemorySize(std::string& text) {
  const std::string given = text;
  if (given == "none") {
    text = "0";
    return {};
  }
  bool is_size = true;
  try {
    is_size = CLI::AsSizeValue(false)(text).empty() && text != "0";
  } catch (const CLI::Error&) {
    is_size = false;
  }
  return is_size
             ? std::string()
             : fmt::format("'{}' is no size such as 256M, 1G, or none", given);
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
  command
      .add_option("--report",
                  options.report,
                  "Write one JSON object on the run to this file")
      ->type_name("FILE");
  command.add_flag(
      "-v,--verbose", options.verbose, "Log to standard error what is done");
}

void SetExample(CLI::App& command, const std::string& example) {
  command.footer("Example:\n  " + example);
}

void ApplyVerbosity(const CommonOptions& options) {
  spdlog::set_level(options.verbose ? spdlog::level::info
                                    : spdlog::level::warn);
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
  return store;
}

}  // namespace enfilade
