// What a study's lines say, as curves by gnuplot.

#pragma once

#include <filesystem>
#include <vector>

#include "tools/study/lines.h"
#include "tools/study/plan.h"

namespace enfilade {

// Writes EXPERIMENT_METHOD.dat, EXPERIMENT_METHOD_equal.dat and EXPERIMENT.gp
// into the folder and, where gnuplot is installed, draws time against error,
// error against memory, links against 1 / error asked for, and the error within
// one time against the parameter. Returns the pictures that were drawn.
std::vector<std::filesystem::path> DrawStudy(
    const Experiment& experiment,
    const std::vector<Json>& lines,
    const std::filesystem::path& folder);

}  // namespace enfilade
