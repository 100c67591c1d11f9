#include "tools/cli.h"

#include "base/error.h"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "tools/commands/command.h"
#include "tools/pipeline_limits.h"
#include "tools/report.h"
#include "tools/signal.h"
#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace enfilade {
namespace {

void ConfigureLog() {
  spdlog::set_default_logger(spdlog::stderr_color_st("enfilade"));
  spdlog::set_pattern("enfilade: %l: %v");
  spdlog::set_level(spdlog::level::warn);
}

int Fail(ExitCode code, const std::string& what) {
  std::fflush(stdout);
  // The result is ignored, because standard error may be closed.
  std::fputs(fmt::format("enfilade: error: {}\n", what).c_str(), stderr);
  return static_cast<int>(code);
}

// Sets how the help of all verbs names the values of options.
void NameValues(CLI::App& app) {
  const auto formatter = app.get_formatter();
  formatter->label("UINT", "N");
  formatter->label("FLOAT", "X");
}

void AddCommands(CLI::App& app) {
  NameValues(app);
  app.require_subcommand(1);
  app.set_version_flag("--version", "enfilade " + ProgramVersion());
  app.footer(
      "Example:\n"
      "  enfilade scene chairs --count 36 chairs.obj\n"
      "  enfilade solve chairs.obj -o chairs.enf --memory 64M\n"
      "  enfilade verify chairs.enf\n"
      "Each verb has --help with an example. Pages named docs/... are in "
      "share/doc/enfilade.\n"
      "Exit codes: 0 done, 1 requested error not reached, method not settled, "
      "or --audit\n"
      "found a fault, 2 usage, 3 bad input, 4 does not fit the memory, 5 "
      "damaged store,\n"
      "6 disk, 130 interrupted, 134 a failed internal check (a bug). verify "
      "ends with 0\n"
      "whatever it finds: its report says whether the error was met.");
  AddSolveCommand(app);
  AddResumeCommand(app);
  AddInfoCommand(app);
  AddVerifyCommand(app);
  AddProbeCommand(app);
  AddCompareCommand(app);
  AddExportCommand(app);
  AddSceneCommand(app);
  AddStudyCommand(app);
  AddFlatlandCommand(app);
}

// The names of the subcommands of an app or a verb, separated by commas.
std::string NamesBelow(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    names.push_back(command->get_name());
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

// Says what is wrong with a command line that CLI11 refuses, and which help to
// read.
std::string UsageText(const CLI::App& app,
                      const CLI::ParseError& error,
                      std::span<char* const> words) {
  const auto is_name = [&](size_t i) {
    return i < words.size() && *words[i] != '\0' && *words[i] != '-';
  };
  const bool is_no_number =
      dynamic_cast<const CLI::ConversionError*>(&error) != nullptr;
  const std::string what = fmt::format(
      "{}{}", error.what(), is_no_number ? ": that is no number" : "");
  const auto verbs = app.get_subcommands();
  if (verbs.empty()) {
    return is_name(1) ? fmt::format("there is no verb '{}'; there are: {}",
                                    words[1],
                                    NamesBelow(app))
                      : fmt::format("{} (see 'enfilade --help')", what);
  }
  const CLI::App& verb = *verbs[0];
  const bool has_kinds = !verb.get_subcommands({}).empty();
  if (has_kinds && verb.get_subcommands().empty() && is_name(2)) {
    return fmt::format("there is no {} '{}'; there are: {}",
                       verb.get_name(),
                       words[2],
                       NamesBelow(verb));
  }
  return fmt::format("{} (see 'enfilade {} --help')", what, verb.get_name());
}

int ParseAndRun(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return static_cast<int>(ExitCode::kSuccess);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error);  // --help and --version
    }
    return Fail(ExitCode::kUsage,
                UsageText(app, error, {argv, static_cast<size_t>(argc)}));
  }
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  try {
    ConfigureLog();
    InstallStopHandlers();
    CLI::App app("Light in whole buildings: wavelet radiosity out of core.",
                 "enfilade");
    AddCommands(app);
    const int code = ParseAndRun(app, argc, argv);
    if (std::fflush(stdout) != 0) {
      throw DiskError("cannot write to standard output");
    }
    return code;
  } catch (const Error& error) {
    return Fail(error.Code(), error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return Fail(ExitCode::kDisk, error.what());
  } catch (const std::system_error& error) {
    return Fail(ExitCode::kDoesNotFit,
                fmt::format("the system refuses what the program asks of it: "
                            "{} (raise the limits on processes and memory)",
                            error.what()));
  } catch (const std::bad_alloc&) {
    return Fail(ExitCode::kDoesNotFit, "the system has no memory left");
  } catch (const std::exception& error) {
    return Fail(ExitCode::kBug,
                fmt::format("{} (a bug: please report it with the command)",
                            error.what()));
  }
}

}  // namespace enfilade
