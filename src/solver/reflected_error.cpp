#include "solver/reflected_error.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

constexpr size_t kMostGroups = 256;
// Of the bounces of s: it ends where they add no more than this share.
constexpr double kSettled = 1e-3;
constexpr int kMostBounces = 500;

double Along(Vec3 v, size_t axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

// At most `most` boxes, about as long as wide.
std::array<size_t, 3> BoxesOf(const Box3& bounds, size_t most) {
  std::array<size_t, 3> boxes = {1, 1, 1};
  for (size_t all = 1; 2 * all <= most; all *= 2) {
    size_t longest = 0;
    double length = 0;
    for (size_t axis = 0; axis < boxes.size(); ++axis) {
      const double l =
          Along(bounds.Extent(), axis) / static_cast<double>(boxes[axis]);
      if (l > length) {
        length = l;
        longest = axis;
      }
    }
    boxes[longest] *= 2;
  }
  return boxes;
}

}  // namespace

ReflectedError::ReflectedError(std::span<const CellInfo> cells,
                               MemoryBudget& budget)
    : cells_per_group_((cells.size() + kMostGroups - 1) / kMostGroups),
      groups_per_cell_(cells.empty() ? 1 : kMostGroups / cells.size()),
      charge_(budget,
              kMostGroups *
                  (sizeof(Grid) + sizeof(Group) + kMostGroups * sizeof(double)),
              "the error that is reflected") {
  groups_per_cell_ = std::max<size_t>(groups_per_cell_, 1);
  if (cells_per_group_ == 1) {
    for (const CellInfo& cell : cells) {
      grids_.push_back({cell.bounds, BoxesOf(cell.bounds, groups_per_cell_)});
    }
  }
  groups_.resize(kMostGroups);
  seen_.resize(kMostGroups * kMostGroups);
}

size_t ReflectedError::GroupOf(CellId cell, Point3 x) const {
  if (grids_.empty()) {
    return cell.Index() / cells_per_group_;
  }
  const Grid& grid = grids_[cell.Index()];
  size_t box = 0;
  for (size_t axis = 0; axis < grid.boxes.size(); ++axis) {
    const double extent = Along(grid.bounds.Extent(), axis);
    const double at = Along(x - grid.bounds.low, axis) / std::max(extent, 1e-9);
    const auto boxes = static_cast<double>(grid.boxes[axis]);
    const double index = std::clamp(std::floor(at * boxes), 0.0, boxes - 1);
    box = box * grid.boxes[axis] + static_cast<size_t>(index);
  }
  return cell.Index() * groups_per_cell_ + box;
}

void ReflectedError::AddProbe(const ErrorProbe& probe) {
  Group& group = groups_[probe.group];
  group.weight += probe.weight;
  for (size_t c = 0; c < kRgbChannels; ++c) {
    group.reflectance[c] += probe.weight * probe.reflectance[c];
    group.residual[probes_ % kHalves][c] += probe.weight * probe.residual[c];
  }
  ++probes_;
}

void ReflectedError::AddRay(size_t from, size_t to, double weight) {
  seen_[from * kMostGroups + to] += weight;
}

double ReflectedError::ResidualOf(const Group& group,
                                  size_t half,
                                  size_t channel) const {
  return group.weight > 0
             ? kHalves * group.residual[half][channel] / group.weight
             : 0;
}

std::vector<double> ReflectedError::Spread(size_t half, size_t channel) const {
  std::vector<double> residual(kMostGroups);
  std::vector<double> spread(kMostGroups);
  for (size_t k = 0; k < kMostGroups; ++k) {
    residual[k] = ResidualOf(groups_[k], half, channel);
  }
  for (int bounce = 0; bounce < kMostBounces; ++bounce) {
    std::vector<double> next(kMostGroups);
    double change = 0;
    double all = 0;
    for (size_t k = 0; k < kMostGroups; ++k) {
      const Group& group = groups_[k];
      if (!(group.weight > 0)) {
        continue;
      }
      double arriving = 0;
      for (size_t l = 0; l < kMostGroups; ++l) {
        arriving += seen_[k * kMostGroups + l] * (residual[l] + spread[l]);
      }
      next[k] =
          group.reflectance[channel] / group.weight * arriving / group.weight;
      change += std::abs(next[k] - spread[k]) * group.weight;
      all += std::abs(next[k]) * group.weight;
    }
    spread = std::move(next);
    if (change <= kSettled * all) {
      break;
    }
  }
  return spread;
}

ErrorIntegral ReflectedError::Integral() const {
  double added = 0;    // e^2 - r^2 = 2 r s + s^2
  double square = 0;   // s^2
  double scatter = 0;  // of s between the halves
  for (size_t c = 0; c < kRgbChannels; ++c) {
    const std::vector<double> a = Spread(0, c);
    const std::vector<double> b = Spread(1, c);
    for (size_t k = 0; k < kMostGroups; ++k) {
      const Group& group = groups_[k];
      const double share = group.weight / kRgbChannels;
      added += share * (a[k] * b[k] + a[k] * ResidualOf(group, 1, c) +
                        b[k] * ResidualOf(group, 0, c));
      square += share * a[k] * b[k];
      scatter += share * (a[k] - b[k]) * (a[k] - b[k]);
    }
  }
  const double n = std::max<double>(1, static_cast<double>(probes_));
  return {added / n,
          (std::sqrt(std::max(square, 0.0) * scatter) + scatter / 2) / n};
}

}  // namespace enfilade
