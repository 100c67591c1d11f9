// The error of a solution from its residual and what reflection makes of it.
// With the residual r of the radiosity equation (residual_check.h), the error
// is
//
//   e = r + rho F e = r + s,     s = rho F (r + s).
//
// Light that is missing at one place is missing again at every bounce. If light
// is reflected often, an error of one sign over a large surface (a whole wall
// too bright by a hundredth) grows to many times its size, and s is far larger
// than r. Since s is smooth, as all reflected light is, it is found from means
// over groups of surface, few enough for a small matrix. All entries of that
// matrix come from the probes and rays of the residual. (The matrix is the
// coarse grid of a two-grid method, used to estimate the error instead of
// correcting it.)
//
//   r      residual, W/m2 of radiosity, mean of a group's probes
//   F      form factors of groups: shares of the probes' rays
//   s      W/m2 of radiosity
//
// Within a group, both r and s are in proportion to the reflectance: a black
// lamp that hangs in a slot before a white ceiling sends no error back to it.

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

// A residual that was measured at a point.
struct ErrorProbe {
  size_t group = 0;
  double weight = 0;  // m2: area of the probe, times all probes
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

  // The group of a point on a cell's surfaces. The place of the point is one of
  // a few boxes in the cell or, if there are many cells, several cells
  // together. The narrow parts of a place are a group of their own: light that
  // leaks into the slot behind a cupboard bounces in the slot again and again
  // and hardly returns to the room.
  [[nodiscard]] size_t GroupOf(CellId cell, Point3 x, bool is_narrow) const;

  // If most rays of a point end within this distance, m, the point is in a
  // narrow part.
  [[nodiscard]] double NarrowBelow(CellId cell) const;

  // Adds a probe to one of the independent parts, each in turn.
  void AddProbe(const ErrorProbe& probe);

  // Adds a ray from a probe of group `from` that met a surface of group `to`
  // with this reflectance. `weight` is the probe's weight times the share of
  // its light that the ray stands for.
  void AddRay(size_t from, size_t to, double weight, const Rgb& reflectance);

  // The integral of e^2 - r^2, mean of the channels, without bias by the noise
  // of r.
  [[nodiscard]] ErrorIntegral Integral() const;

 private:
  // Two parts suffice for an unbiased square, but its deviation needs more: if
  // all is one room, two parts that agree by chance tell nothing.
  static constexpr size_t kParts = 16;

  struct Group {
    double weight = 0;  // sum over the group's probes
    Rgb reflectance{};  // likewise, each times its weight
    std::array<Rgb, kParts> residual{};
  };

  // Boxes along each axis of a cell.
  struct Grid {
    Box3 bounds;
    std::array<size_t, 3> boxes = {1, 1, 1};
  };

  [[nodiscard]] size_t PlaceOf(CellId cell, Point3 x) const;

  // The residuals r of one channel and the reflected errors s that they cause,
  // both [group][part].
  [[nodiscard]] Eigen::MatrixXd Residuals(size_t channel) const;
  [[nodiscard]] Eigen::MatrixXd Spread(const Eigen::MatrixXd& residuals,
                                       size_t channel) const;

  size_t cells_per_place_ = 1;
  size_t places_per_cell_ = 1;
  std::vector<double> narrow_below_;  // by cell
  std::vector<Grid> grids_;           // by cell; empty if places are larger
  MemoryCharge charge_;
  std::vector<Group> groups_;
  // [channel][from][to]: sum of the weights of rays times the reflectance met
  std::vector<double> seen_;
  size_t probes_ = 0;
};

}  // namespace enfilade
