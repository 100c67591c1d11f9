#include "partition/plane_groups.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace enfilade {
namespace {

constexpr double kGroupOffsetM = 1e-3;
constexpr double kGroupNormalStep = 1e-4;
// One node in each of the two maps, for a group with a normal of its own.
constexpr uint64_t kBytesPerGroup = 192;

}  // namespace

PlaneGroups::PlaneGroups(Point3 center, MemoryBudget& budget)
    : center_(center - Point3{}), charge_(budget, "the planes of the walls") {}

// The key is the same for both sides of a plane.
PlaneGroups::Key PlaneGroups::KeyOf(const Plane& plane) const {
  Normal n{};
  for (size_t axis = 0; axis < 3; ++axis) {
    n[axis] = std::llround(plane.normal[axis] / kGroupNormalStep);
  }
  const double offset = plane.offset - Dot(plane.normal, center_);
  const bool flip = n < Normal{-n[0], -n[1], -n[2]};
  if (flip) {
    return {{-n[0], -n[1], -n[2]}, -offset};
  }
  return {n, offset};
}

void PlaneGroups::Add(const Plane& plane, double share) {
  const auto [normal, offset] = KeyOf(plane);
  ByLow& parallel = groups_[normal];
  auto next = parallel.upper_bound(offset);
  auto group = next == parallel.begin() ? parallel.end() : std::prev(next);
  if (group != parallel.end() && offset - group->second.high < kGroupOffsetM) {
    group->second.high = std::max(group->second.high, offset);
  } else {
    charge_.GrowTo((count_ + 1) * kBytesPerGroup, share);
    group = parallel.emplace_hint(next, offset, Group{offset, 0});
    ++count_;
  }
  if (next != parallel.end() &&
      next->first - group->second.high < kGroupOffsetM) {
    group->second.high = next->second.high;
    parallel.erase(next);
    --count_;
  }
}

void PlaneGroups::Number() {
  uint32_t number = 0;
  for (auto& [normal, parallel] : groups_) {
    for (auto& [low, group] : parallel) {
      group.number = number++;
    }
  }
}

uint32_t PlaneGroups::Of(const Plane& plane) const {
  const auto [normal, offset] = KeyOf(plane);
  const ByLow& parallel = groups_.at(normal);
  const auto next = parallel.upper_bound(offset);
  ENFILADE_CHECK(next != parallel.begin(), "a plane that was not added");
  return std::prev(next)->second.number;
}

}  // namespace enfilade
