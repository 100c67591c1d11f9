#include "solver/residual/reflected_error.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace enfilade {
namespace {

constexpr size_t kMostGroups = 256;
// Each place has two groups: its narrow parts and the rest.
constexpr size_t kMostPlaces = kMostGroups / 2;
// A distance below this share of the longest edge of a place is narrow.
constexpr double kNarrow = 0.25;
// The matrices of groups x groups that are kept, and those that Spread() needs
// at a time.
constexpr size_t kKeptMatrices = kRgbChannels;
constexpr size_t kWorkMatrices = 3;

// Boxes along each axis: at most `most` in all, each about as long as wide.
std::array<size_t, 3> BoxesOf(const Box3& bounds, size_t most) {
  std::array<size_t, 3> boxes = {1, 1, 1};
  for (size_t all = 1; 2 * all <= most; all *= 2) {
    size_t longest = 0;
    double length = 0;
    for (size_t axis = 0; axis < boxes.size(); ++axis) {
      const double l = bounds.Extent()[axis] / static_cast<double>(boxes[axis]);
      if (l > length) {
        length = l;
        longest = axis;
      }
    }
    boxes[longest] *= 2;
  }
  return boxes;
}

double LongestEdge(const Box3& bounds, const std::array<size_t, 3>& boxes) {
  double longest = 0;
  for (size_t axis = 0; axis < boxes.size(); ++axis) {
    longest = std::max(
        longest, bounds.Extent()[axis] / static_cast<double>(boxes[axis]));
  }
  return longest;
}

Eigen::Index EigenIndex(size_t i) {
  return static_cast<Eigen::Index>(i);
}

// The mean of a_i b_j over all i != j.
double OfDifferentParts(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const auto parts = static_cast<double>(a.size());
  return (a.sum() * b.sum() - a.dot(b)) / (parts * (parts - 1));
}

double VarianceOfMean(const Eigen::VectorXd& a) {
  const auto parts = static_cast<double>(a.size());
  return (a.array() - a.mean()).square().sum() / (parts * (parts - 1));
}

}  // namespace

ReflectedError::ReflectedError(std::span<const CellInfo> cells,
                               MemoryBudget& budget)
    : cells_per_place_((cells.size() + kMostPlaces - 1) / kMostPlaces),
      places_per_cell_(cells.empty() ? 1 : kMostPlaces / cells.size()),
      charge_(budget,
              kMostGroups * (sizeof(Grid) + sizeof(Group) +
                             (kKeptMatrices + kWorkMatrices) * kMostGroups *
                                 sizeof(double)) +
                  cells.size() * sizeof(double),
              "the error that is reflected") {
  places_per_cell_ = std::max<size_t>(places_per_cell_, 1);
  narrow_below_.reserve(cells.size());
  for (const CellInfo& cell : cells) {
    const Grid grid = {cell.bounds, BoxesOf(cell.bounds, places_per_cell_)};
    narrow_below_.push_back(kNarrow * LongestEdge(grid.bounds, grid.boxes));
    if (cells_per_place_ == 1) {
      grids_.push_back(grid);
    }
  }
  groups_.resize(kMostGroups);
  seen_.resize(kKeptMatrices * kMostGroups * kMostGroups);
}

double ReflectedError::NarrowBelow(CellId cell) const {
  return narrow_below_[cell.Index()];
}

size_t ReflectedError::GroupOf(CellId cell, Point3 x, bool is_narrow) const {
  return 2 * PlaceOf(cell, x) + (is_narrow ? 1 : 0);
}

size_t ReflectedError::PlaceOf(CellId cell, Point3 x) const {
  if (grids_.empty()) {
    return cell.Index() / cells_per_place_;
  }
  const Grid& grid = grids_[cell.Index()];
  size_t box = 0;
  for (size_t axis = 0; axis < grid.boxes.size(); ++axis) {
    const double extent = grid.bounds.Extent()[axis];
    const double at = (x - grid.bounds.low)[axis] / std::max(extent, 1e-9);
    const auto boxes = static_cast<double>(grid.boxes[axis]);
    const double index = std::clamp(std::floor(at * boxes), 0.0, boxes - 1);
    box = box * grid.boxes[axis] + static_cast<size_t>(index);
  }
  return cell.Index() * places_per_cell_ + box;
}

void ReflectedError::AddProbe(const ErrorProbe& probe) {
  Group& group = groups_[probe.group];
  group.weight += probe.weight;
  for (size_t c = 0; c < kRgbChannels; ++c) {
    group.reflectance[c] += probe.weight * probe.reflectance[c];
    group.residual[probes_ % kParts][c] += probe.weight * probe.residual[c];
  }
  ++probes_;
}

void ReflectedError::AddRay(size_t from,
                            size_t to,
                            double weight,
                            const Rgb& reflectance) {
  for (size_t c = 0; c < kRgbChannels; ++c) {
    seen_[(c * kMostGroups + from) * kMostGroups + to] +=
        weight * reflectance[c];
  }
}

Eigen::MatrixXd ReflectedError::Residuals(size_t channel) const {
  Eigen::MatrixXd residuals = Eigen::MatrixXd::Zero(kMostGroups, kParts);
  for (size_t k = 0; k < kMostGroups; ++k) {
    const Group& group = groups_[k];
    for (size_t part = 0; part < kParts && group.weight > 0; ++part) {
      residuals(EigenIndex(k), EigenIndex(part)) =
          kParts * group.residual[part][channel] / group.weight;
    }
  }
  return residuals;
}

// With r = rho q, s = rho h, and P the form factors times the reflectances of
// what the rays meet: h = P (q + h). The rows of P sum to less than 1, so the
// matrix is diagonally dominant.
Eigen::MatrixXd ReflectedError::Spread(const Eigen::MatrixXd& residuals,
                                       size_t channel) const {
  Eigen::MatrixXd back = Eigen::MatrixXd::Zero(kMostGroups, kMostGroups);
  Eigen::VectorXd rho = Eigen::VectorXd::Zero(kMostGroups);
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(kMostGroups, kParts);
  for (size_t k = 0; k < kMostGroups; ++k) {
    const Group& group = groups_[k];
    if (!(group.reflectance[channel] > 0)) {
      continue;
    }
    const Eigen::Index row = EigenIndex(k);
    rho[row] = group.reflectance[channel] / group.weight;
    q.row(row) = residuals.row(row) / rho[row];
    for (size_t l = 0; l < kMostGroups; ++l) {
      back(row, EigenIndex(l)) =
          seen_[(channel * kMostGroups + k) * kMostGroups + l] / group.weight;
    }
  }
  const Eigen::MatrixXd left =
      Eigen::MatrixXd::Identity(kMostGroups, kMostGroups) - back;
  return rho.asDiagonal() * left.partialPivLu().solve(back * q);
}

ErrorIntegral ReflectedError::Integral() const {
  double added = 0;     // e^2 - r^2 = 2 r s + s^2
  double variance = 0;  // of s, integrated
  // `added`, linearised in the residuals of each part; its scatter over the
  // parts gives the deviation.
  Eigen::VectorXd by_part = Eigen::VectorXd::Zero(kParts);
  for (size_t c = 0; c < kRgbChannels; ++c) {
    const Eigen::MatrixXd r = Residuals(c);
    const Eigen::MatrixXd s = Spread(r, c);
    for (size_t k = 0; k < kMostGroups; ++k) {
      const double share = groups_[k].weight / kRgbChannels;
      const Eigen::VectorXd rs = r.row(EigenIndex(k));
      const Eigen::VectorXd ss = s.row(EigenIndex(k));
      // Only products of different parts count, since their noise is
      // independent.
      added +=
          share * (OfDifferentParts(ss, ss) + 2 * OfDifferentParts(rs, ss));
      by_part += 2 * share * (ss.mean() * ss + ss.mean() * rs + rs.mean() * ss);
      variance += share * VarianceOfMean(ss);
    }
  }
  const double n = std::max<double>(1, static_cast<double>(probes_));
  return {added / n,
          std::sqrt(VarianceOfMean(by_part) + 2 * variance * variance) / n};
}

}  // namespace enfilade
