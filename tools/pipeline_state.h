// What a store records of the runs that make it: the settings that determine
// the solution, the stage that the store has reached, and what its runs took.
// Kept in the store's meta entries "settings", "stage" and "runs".

#pragma once

#include "base/block_storage.h"
#include "scene/import.h"
#include "solver/solve.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace enfilade {

// Everything the solution depends on, and nothing else: neither the memory cap
// nor the number of threads.
struct SolveSettings {
  std::filesystem::path scene;  // absolute
  std::optional<std::filesystem::path> overrides;
  bool default_luminaires = false;
  bool photometric = false;
  bool strip_spaces = false;
  std::optional<int> sides;
  std::optional<double> unit;  // length of an OBJ's unit, metres
  double error = 0.05;
  std::string basis = "m2";
  uint64_t seed = 1;
  MethodOptions method;

  friend bool operator==(const SolveSettings&, const SolveSettings&) = default;
};

// The error that the solve is asked for; nullopt if its method is asked for
// something else: an epsilon, or a number of elements.
std::optional<double> RequestedError(const SolveSettings& settings);

ImportOptions ImportOptionsOf(const SolveSettings& settings);
SolveOptions SolveOptionsOf(const SolveSettings& settings);

void SaveSettings(BlockStorage& store, const SolveSettings& settings);
// Throws DamagedStoreError if the store holds no settings or unreadable ones.
SolveSettings LoadSettings(const BlockStorage& store);

// The stages that a store can have completed, in their order.
enum class Stage { kCreated, kImported, kPartitioned, kVisible, kTraceable };

std::string_view StageName(Stage stage);
void SaveStage(BlockStorage& store, Stage stage);
Stage LoadStage(const BlockStorage& store);

// LoadSolveSummary(), judged by the settings: a solve that has not yet taken up
// the error that they ask for is neither converged nor exhausted. A store has
// the settings of a resume before the resume does anything.
SolveSummary LoadSummaryOf(const BlockStorage& store,
                           const SolveSettings& settings);

// What all runs on a store took so far, added up.
struct RunRecord {
  double import_seconds = 0;
  double partition_seconds = 0;
  double visibility_seconds = 0;  // trace chunks included
  double wall_seconds = 0;
  uint64_t bytes_read = 0;
  uint64_t bytes_written = 0;
  uint64_t peak_rss_bytes = 0;  // the largest of all runs
  uint64_t runs = 0;
  // Of the last run; a cap of 0 means no cap.
  uint64_t memory_cap_bytes = 0;
  uint64_t threads = 0;
  std::string version;
};

void SaveRunRecord(BlockStorage& store, const RunRecord& record);
// Returns a default record if the store holds none.
RunRecord LoadRunRecord(const BlockStorage& store);

}  // namespace enfilade
