// What a study's lines say, as tables.

#pragma once

#include <string>
#include <vector>

#include "tools/study/lines.h"
#include "tools/study/plan.h"

namespace enfilade {

// Markdown: a row per run; the exponents of time, links, memory and error by
// method; and the error that each method delivers within a time or a memory.
std::string StudyTables(const Experiment& experiment,
                        const std::vector<Json>& lines);

}  // namespace enfilade
