// The results of a study as tables.

#pragma once

#include <string>
#include <vector>

#include "tools/study/lines.h"
#include "tools/study/plan.h"

namespace enfilade {

// Markdown with three tables: one row per run; the fitted exponents of time,
// links, memory and error by method; and the error that each method delivers
// within a given time or memory.
std::string StudyTables(const Experiment& experiment,
                        const std::vector<Json>& lines);

}  // namespace enfilade
