// The JSON that --report writes: one object per verb. Keys, types and units are
// a contract, described in docs/report.md.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"

#include <filesystem>
#include <string>

#include "tools/pipeline_state.h"
#include <nlohmann/json.hpp>

namespace enfilade {

using Json = nlohmann::ordered_json;

// "0.1.0", of this program.
std::string ProgramVersion();

// The report of `solve`, `resume` and `info`: every key, from what is in the
// store and the record. What the store has not reached yet is 0, and the
// digest null.
Json SolveReport(const BlockStorage& store,
                 const SolveSettings& settings,
                 const RunRecord& record,
                 MemoryBudget& budget);

// Writes the object to a file, replacing it in one step. Throws DiskError.
void WriteReport(const std::filesystem::path& path, const Json& report);

// A few lines for people on what a SolveReport says.
std::string SummaryText(const Json& report);

// What import and partition had to say, and what a gbXML file holds.
std::string NotesText(const Json& report);

// "12.3 MiB".
std::string FormatBytes(double bytes);

}  // namespace enfilade
