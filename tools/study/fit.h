// What is read off the runs of a study: powers, and methods at equal cost.

#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

// The power p of y = c x^p by least squares in the logarithms; nothing with
// fewer than two different x, or a value that is not above 0.
std::optional<double> FitPower(
    std::span<const std::pair<double, double>> points);

// Of runs (cost, error) of one method: the least error of those that cost no
// more than `budget`, and between two of them a power of the cost. Where all
// cost less, the least of all; nothing where all cost more. Runs without a cost
// or error above 0 do not count.
std::optional<double> ErrorWithin(double budget,
                                  std::vector<std::pair<double, double>> runs);

}  // namespace enfilade
