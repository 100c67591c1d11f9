// The JSON that --report writes: one object per verb. Keys, types and units are
// a contract, described in docs/report.md.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"

#include <filesystem>
#include <string>

#include "tools/pipeline_state.h"
#include "tools/progress.h"
#include <nlohmann/json.hpp>

namespace enfilade {

// Says what the error means where `lit_share` (RoundSummary) is small; empty if
// it is not.
std::string DarknessNote(double lit_share, double error);

// Says that a method which is asked for no error (RequestedError) has ended
// before it was done.
std::string NotSettledText(const SolveSummary& summary);

using Json = nlohmann::ordered_json;

// The version of this program, such as "0.1.0".
std::string ProgramVersion();

// The report of `solve`, `resume` and `info`, with every key, made from the
// store. Values that the store has not reached yet are 0, and the digest is
// null. Otherwise the whole solution is read for it, which `progress` shows.
// Throws InterruptedError if a stop is requested meanwhile.
Json SolveReport(const BlockStorage& store,
                 const SolveSettings& settings,
                 MemoryBudget& budget,
                 Progress& progress);

// Writes the object to a file, replacing it in one step. Throws DiskError.
void WriteReport(const std::filesystem::path& path, const Json& report);

// A summary of a SolveReport in a few lines for people.
std::string SummaryText(const Json& report);

// The report's notes and the counts of a gbXML file, as lines for people.
std::string NotesText(const Json& report);

// "12.3 MiB".
std::string FormatBytes(double bytes);

}  // namespace enfilade
