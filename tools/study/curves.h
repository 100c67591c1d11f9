// Draws the results of a study as curves by gnuplot.

#pragma once

#include <filesystem>
#include <vector>

#include "tools/study/lines.h"
#include "tools/study/plan.h"

namespace enfilade {

// Writes EXPERIMENT_METHOD.dat, EXPERIMENT_METHOD_equal.dat and EXPERIMENT.gp
// into the folder. If gnuplot is installed, draws error over time, error over
// memory, links over 1 / requested error, and the error that is delivered
// within one time over the parameter. Returns the pictures that were drawn.
std::vector<std::filesystem::path> DrawStudy(
    const Experiment& experiment,
    const std::vector<Json>& lines,
    const std::filesystem::path& folder);

}  // namespace enfilade
