// What the error of a solution becomes on its way through the building. With
// the residual r of the equation (residual_check.h), the error is
//
//   e = r + rho F e = r + s,     s = rho F (r + s):
//
// what is left out at one place is missed again at every bounce. Where light is
// reflected often, errors that cancel out nowhere near (a whole wall too
// bright by a hundredth) so grow to many times their size, and s is far larger
// than r. It is smooth, as all reflected light is: so it is found from means
// over groups of surface, as many as fit a small matrix, all of whose numbers
// come from the probes and rays of the residual. (The coarse grid of a two-grid
// method, used to estimate instead of to correct.)
//
//   r      residual, W/m2 of radiosity, mean of a group's probes
//   F      form factors of groups: shares of the probes' rays
//   s      W/m2 of radiosity

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "base/vec.h"
#include "partition/partition.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace enfilade {

// Where a residual was measured.
struct ErrorProbe {
  size_t group = 0;
  double weight = 0;  // m2: the area that it stands for, times all probes
  Rgb residual{};     // without bias, W/m2
  Rgb reflectance{};
};

// An integral over the surfaces, W^2/m2, and its standard deviation.
struct ErrorIntegral {
  double value = 0;
  double deviation = 0;
};

class ReflectedError {
 public:
  ReflectedError(std::span<const CellInfo> cells, MemoryBudget& budget);

  // The group of a point of a cell's surfaces: a box of a few in the cell, or
  // several cells together where there are many. What is narrow there is a
  // group of its own: light that leaks into the slot behind a cupboard comes
  // back in it again and again, and hardly into the room.
  [[nodiscard]] size_t GroupOf(CellId cell, Point3 x, bool is_narrow) const;

  // A point most of whose rays end within this distance is in a narrow place,
  // m.
  [[nodiscard]] double NarrowBelow(CellId cell) const;

  // Probes are counted by turns to independent parts.
  void AddProbe(const ErrorProbe& probe);

  // A ray from a probe of `from` that met a surface of `to`; `weight`: the
  // probe's, times the share of its light that the ray stands for.
  void AddRay(size_t from, size_t to, double weight);

  // The integral of e^2 - r^2, mean of the channels; without bias by the noise
  // of r.
  [[nodiscard]] ErrorIntegral Integral() const;

 private:
  // Two would do for a square without bias. How sure it is takes more: where
  // all is one room, two that agree by chance say nothing.
  static constexpr size_t kParts = 16;

  struct Group {
    double weight = 0;  // of its probes
    Rgb reflectance{};  // likewise, times weight
    std::array<Rgb, kParts> residual{};
  };

  // Boxes along each axis of a cell.
  struct Grid {
    Box3 bounds;
    std::array<size_t, 3> boxes = {1, 1, 1};
  };

  [[nodiscard]] size_t PlaceOf(CellId cell, Point3 x) const;

  // Residuals of one channel, [group][part], and what they become.
  [[nodiscard]] Eigen::MatrixXd Residuals(size_t channel) const;
  [[nodiscard]] Eigen::MatrixXd Spread(const Eigen::MatrixXd& residuals,
                                       size_t channel) const;

  size_t cells_per_place_ = 1;
  size_t places_per_cell_ = 1;
  std::vector<double> narrow_below_;  // by cell
  std::vector<Grid> grids_;           // by cell, unless several are one group
  MemoryCharge charge_;
  std::vector<Group> groups_;
  std::vector<double> seen_;  // [from][to]: sum of the weights of rays
  size_t probes_ = 0;
};

}  // namespace enfilade
