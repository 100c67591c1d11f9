// Options that several verbs share, and how they are read.

#pragma once

#include "base/block_storage.h"
#include "store/sqlite_store.h"

#include <filesystem>
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

// --memory, --threads, --report, --verbose.
void AddCommonOptions(CLI::App& command, CommonOptions& options);

// Ends the help of a verb with an example.
void SetExample(CLI::App& command, const std::string& example);

// Applies --verbose.
void ApplyVerbosity(const CommonOptions& options);

// Writes the report if one was asked for.
void WriteReportIfAsked(const CommonOptions& options, const Json& report);

// OpenStore, but a path where nothing is, is an InputError.
std::unique_ptr<BlockStorage> OpenExistingStore(
    const std::filesystem::path& path, StoreAccess access);

// OpenExistingStore for reading; throws InputError unless the store has got
// as far as a solution (complete or not).
std::unique_ptr<BlockStorage> OpenSolvedStore(
    const std::filesystem::path& path);

}  // namespace enfilade
