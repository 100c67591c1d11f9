// Options that several verbs share, and how they are read.

#pragma once

#include "base/block_storage.h"
#include "store/sqlite_store.h"

#include <filesystem>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>

#include "tools/pipeline_limits.h"
#include "tools/report.h"
#include <CLI/CLI.hpp>

namespace enfilade {

struct CommonOptions {
  RunLimits limits;
  std::string report;  // empty: none
  bool verbose = false;
};

// The command-line options that determine the solution of a scene.
struct SceneOptions {
  std::string overrides;  // empty: none
  int sides = 0;          // 0: as the scene says
  std::string unit;       // empty: metres
  SolveSettings settings;
};

// --error, --basis, --overrides, --default-luminaires, --photometric, --sides,
// --strip-spaces, --unit.
void AddSceneOptions(CLI::App& command, SceneOptions& options);

// The settings for this scene file. Throws InputError if the scene file or the
// overrides file is missing, UsageError for options out of range.
SolveSettings SettingsOf(const std::string& scene, const SceneOptions& options);

// Throws InputError if there is no such file.
void RequireSceneFile(const std::filesystem::path& scene);

// --memory, --threads, --report, --verbose.
void AddCommonOptions(CLI::App& command, CommonOptions& options);

// --report.
void AddReportOption(CLI::App& command, std::string& report);

// Ends the help of a verb with an example.
void SetExample(CLI::App& command, const std::string& example);

// Checks of values that say in words what they want.
CLI::Validator AboveZero();
CLI::Validator WholeAboveZero();

// Accepts one of `names` in upper or lower case and converts it to its value.
template <typename Enum>
CLI::Validator OneOf(const std::map<std::string, Enum>& names) {
  const auto convert = [names](std::string& word) {
    const CLI::CheckedTransformer to_value(names, CLI::ignore_case);
    const std::string given = word;
    if (to_value(word).empty()) {
      return std::string();
    }
    std::string known;
    for (const auto& [name, value] : names) {
      known += (known.empty() ? "" : ", ") + name;
    }
    return "'" + given + "' is none of " + known;
  };
  return {convert, ""};
}

// Returns an error message if `text` is no valid --seed, otherwise an empty
// string. CLI11 by itself would take the nearest number that fits.
std::string CheckSeed(const std::string& text);

// Throws UsageError if `output` is the same file as one of `others`, the other
// files of a run. The files need not exist yet. Empty names are ignored.
void RequireApart(const std::filesystem::path& output,
                  std::initializer_list<std::filesystem::path> others);

// Throws UsageError if `second`, which a run writes besides the file `named` by
// the user, would replace a file that is not of an earlier such run: it exists,
// and `named` does not.
void RequireNothingUnnamedReplaced(const std::filesystem::path& second,
                                   const std::filesystem::path& named);

// Throws DiskError if the report could not be written at the end of the run,
// UsageError if the report is one of `others`, files that the run reads or
// writes, or would replace a file that is not a report, such as a material file
// of the scene. An empty `report` means that no report was asked for.
void CheckReport(const std::string& report,
                 std::initializer_list<std::filesystem::path> others);

// Every verb with the common options calls this first: applies --verbose and
// calls CheckReport.
void BeginRun(const CommonOptions& options,
              std::initializer_list<std::filesystem::path> others);

// Writes the report if one was asked for.
void WriteReportIfAsked(const CommonOptions& options, const Json& report);

// Calls OpenStore, but throws InputError if nothing exists at `path` or `path`
// names a scene file.
std::unique_ptr<BlockStorage> OpenExistingStore(
    const std::filesystem::path& path, StoreAccess access);

// Calls OpenExistingStore for reading. Throws InputError if the store holds no
// solution yet; warns if the solve is not complete.
std::unique_ptr<BlockStorage> OpenSolvedStore(
    const std::filesystem::path& path);

}  // namespace enfilade
