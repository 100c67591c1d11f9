// Options that several verbs share, and how they are read.

#pragma once

#include "base/block_storage.h"
#include "store/sqlite_store.h"

#include <filesystem>
#include <initializer_list>
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

// What decides the solution of a scene, on the command line.
struct SceneOptions {
  std::string overrides;  // empty: none
  int sides = 0;          // 0: as the scene says
  std::string unit;       // empty: metres
  SolveSettings settings;
};

// --error, --basis, --overrides, --default-luminaires, --photometric, --sides,
// --strip-spaces, --unit.
void AddSceneOptions(CLI::App& command, SceneOptions& options);

// The settings for this scene file. Throws InputError if it or the overrides
// are missing, UsageError for options out of range.
SolveSettings SettingsOf(const std::string& scene, const SceneOptions& options);

// Throws InputError if there is no such file.
void RequireSceneFile(const std::filesystem::path& scene);

// --memory, --threads, --report, --verbose.
void AddCommonOptions(CLI::App& command, CommonOptions& options);

// --report.
void AddReportOption(CLI::App& command, std::string& report);

// Ends the help of a verb with an example.
void SetExample(CLI::App& command, const std::string& example);

// What is wrong with the value of a --seed, or nothing: CLI11 would take the
// nearest number that fits.
std::string CheckSeed(const std::string& text);

// Throws UsageError if an output is one of the other files of a run, whether
// that is there yet or not. Empty names are none.
void RequireApart(const std::filesystem::path& output,
                  std::initializer_list<std::filesystem::path> others);

// Throws DiskError if the report could not be written in the end, UsageError if
// it is one of the other files that the run reads or writes. An empty name is
// none.
void CheckReport(const std::string& report,
                 std::initializer_list<std::filesystem::path> others);

// What every verb with these options begins with: applies --verbose, and checks
// the report.
void BeginRun(const CommonOptions& options,
              std::initializer_list<std::filesystem::path> others);

// Writes the report if one was asked for.
void WriteReportIfAsked(const CommonOptions& options, const Json& report);

// OpenStore, but a path where nothing is, or a scene file, is an InputError.
std::unique_ptr<BlockStorage> OpenExistingStore(
    const std::filesystem::path& path, StoreAccess access);

// OpenExistingStore for reading; throws InputError unless the store has got
// as far as a solution. Warns if the solve is not complete.
std::unique_ptr<BlockStorage> OpenSolvedStore(
    const std::filesystem::path& path);

}  // namespace enfilade
