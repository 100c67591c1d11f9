#include "tools/command_options.h"

#include "base/error.h"

#include "tools/pipeline_state.h"
#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace enfilade {

void AddCommonOptions(CLI::App& command, CommonOptions& options) {
  options.limits.threads = HardwareThreads();
  // The transformation added last is applied first.
  command
      .add_option("--memory",
                  options.limits.memory_cap_bytes,
                  "Cap on the memory of the whole process: 256M, 1G, or none")
      ->transform(CLI::AsSizeValue(false))
      ->transform([](const std::string& text) {
        return text == "none" ? std::string("0") : text;
      })
      ->type_name("SIZE")
      ->default_str("1G");
  command
      .add_option(
          "--threads", options.limits.threads, "Threads that compute at once")
      ->check(CLI::Range(1, 4096))
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
