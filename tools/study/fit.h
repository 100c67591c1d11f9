// Evaluates the runs of a study: fitted powers, and errors at equal cost.

#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

// The power p of y = c x^p, by least squares in the logarithms. Returns nullopt
// if the points have fewer than two different x or if a value is not above 0.
std::optional<double> FitPower(
    std::span<const std::pair<double, double>> points);

// The error that a method delivers at the cost `budget`, from its runs (cost,
// error). Only runs count that have a smaller error than all cheaper runs;
// between two of them the error is interpolated as a power of the cost. Returns
// the least error if all runs cost less than `budget`, and nullopt if all cost
// more. Runs without a cost and an error above 0 are ignored.
std::optional<double> ErrorWithin(double budget,
                                  std::vector<std::pair<double, double>> runs);

}  // namespace enfilade
