// What a study's lines say: tables, fitted exponents, and curves by gnuplot.

#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tools/report.h"
#include "tools/study_plan.h"

namespace enfilade {

// The power p of y = c x^p by least squares in the logarithms; nothing with
// fewer than two different x, or a value that is not above 0.
std::optional<double> FitPower(
    std::span<const std::pair<double, double>> points);

// Markdown: a row per run, then the exponents of time, links, memory and error
// by method.
std::string StudyTables(const Experiment& experiment,
                        const std::vector<Json>& lines);

// Writes EXPERIMENT_METHOD.dat and EXPERIMENT.gp into the folder and, where
// gnuplot is installed, draws time against error, error against memory, and
// links against 1 / error asked for. Returns the pictures that were drawn.
std::vector<std::filesystem::path> DrawStudy(
    const Experiment& experiment,
    const std::vector<Json>& lines,
    const std::filesystem::path& folder);

}  // namespace enfilade
