#include "solver/coplanar.h"

#include "partition/polygon.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace enfilade {
namespace {

constexpr size_t kMostSlots = 1 << 16;

// Planes whose keys are equal or neighbours are compared.
constexpr double kNormalStep = 1e-3;
constexpr double kOffsetStepM = 1e-3;

using PlaneKey = std::tuple<uint32_t, bool, bool, std::array<int64_t, 4>>;

std::array<double, 4> PlaneNumbers(const Patch& p) {
  const Vec3 n = PatchNormal(p);
  return {n.x / kNormalStep,
          n.y / kNormalStep,
          n.z / kNormalStep,
          Dot(n, p.origin - Point3{}) / kOffsetStepM};
}

// The key of the patch's plane, or for `mask` > 0 one of those next to it:
// numbers on two sides of a border are found all the same.
PlaneKey KeyOf(const Patch& p, unsigned mask) {
  const std::array<double, 4> numbers = PlaneNumbers(p);
  std::array<int64_t, 4> key{};
  for (size_t i = 0; i < key.size(); ++i) {
    const double floor = std::floor(numbers[i]);
    const int64_t aside = numbers[i] - floor < 0.5 ? -1 : 1;
    key[i] = static_cast<int64_t>(floor) + ((mask >> i & 1) != 0 ? aside : 0);
  }
  return {p.material.value, p.emits, p.reflects, key};
}

bool InPlane(const PlaneFrame& frame, const Patch& patch) {
  const std::vector<Point3> corners = CornersOf(patch);
  return Dot(frame.normal, PatchNormal(patch)) > 0 &&
         std::all_of(corners.begin(), corners.end(), [&](Point3 p) {
           return std::abs(frame.Height(p)) <= kOnPlaneM;
         });
}

// Where a patch meets the plane, if along a segment.
bool MeetsPlane(const PlaneFrame& frame,
                const Patch& patch,
                PlaneSegment* segment) {
  const std::vector<Point3> corners = CornersOf(patch);
  std::vector<double> height;
  size_t on_plane = 0;
  for (const Point3 p : corners) {
    const double h = frame.Height(p);
    height.push_back(std::abs(h) <= kOnPlaneM ? 0 : h);
    on_plane += height.back() == 0 ? 1U : 0U;
  }
  if (on_plane > 2) {
    return false;  // lies in the plane
  }
  std::vector<PlanePoint> met;
  for (size_t i = 0; i < corners.size(); ++i) {
    const size_t next = (i + 1) % corners.size();
    if (height[i] == 0) {
      met.push_back(frame.ToPlane(corners[i]));
    } else if (height[i] * height[next] < 0) {
      const double t = height[i] / (height[i] - height[next]);
      met.push_back(frame.ToPlane(Lerp(corners[i], corners[next], t)));
    }
  }
  if (met.size() < 2 || Length(met[1] - met[0]) <= kCrackM) {
    return false;
  }
  *segment = {met[0], met[1]};
  return true;
}

}  // namespace

double Length(PlanePoint a) {
  return std::hypot(a.x, a.y);
}

PlaneFrame::PlaneFrame(const Patch& patch)
    : origin(patch.origin),
      x_axis(Normalize(patch.u)),
      normal(PatchNormal(patch)) {
  y_axis = Cross(normal, x_axis);
}

std::vector<Point3> CornersOf(const Patch& patch) {
  const Point3 o = patch.origin;
  if (patch.shape == PatchShape::kTriangle) {
    return {o, o + patch.u, o + patch.v};
  }
  return {o, o + patch.u, o + patch.u + patch.v, o + patch.v};
}

std::vector<std::vector<PatchId>> CoplanarGroups(
    std::span<const Patch> patches) {
  std::vector<std::vector<PatchId>> groups;
  std::map<PlaneKey, std::vector<size_t>> known;
  constexpr unsigned kMasks = 16;
  const auto find = [&](const Patch& patch) -> size_t {
    for (unsigned mask = 0; mask < kMasks; ++mask) {
      const auto at = known.find(KeyOf(patch, mask));
      if (at == known.end()) {
        continue;
      }
      for (const size_t g : at->second) {
        const PlaneFrame frame(patches[groups[g].front().Index()]);
        if (InPlane(frame, patch)) {
          return g;
        }
      }
    }
    return groups.size();
  };
  for (size_t i = 0; i < patches.size(); ++i) {
    const size_t g = find(patches[i]);
    if (g == groups.size()) {
      groups.emplace_back();
      known[KeyOf(patches[i], 0)].push_back(g);
    }
    groups[g].emplace_back(i);
  }
  return groups;
}

std::vector<PlaneSegment> StandingSegments(std::span<const Patch> patches,
                                           std::span<const PatchId> group) {
  const PlaneFrame frame(patches[group.front().Index()]);
  Box3 bounds;
  for (const PatchId id : group) {
    bounds.Include(BoundsOf(CornersOf(patches[id.Index()])));
  }
  const Vec3 margin{kCrackM, kCrackM, kCrackM};
  bounds.low = bounds.low - margin;
  bounds.high = bounds.high + margin;
  std::vector<PlaneSegment> segments;
  for (const Patch& patch : patches) {
    PlaneSegment segment;
    if (bounds.Overlaps(BoundsOf(CornersOf(patch))) &&
        MeetsPlane(frame, patch, &segment)) {
      segments.push_back(segment);
    }
  }
  return segments;
}

void PlaneIndex::Box::Include(PlanePoint p) {
  low = {std::min(low.x, p.x), std::min(low.y, p.y)};
  high = {std::max(high.x, p.x), std::max(high.y, p.y)};
}

PlaneIndex::PlaneIndex(std::span<const Box> boxes, double margin_m) {
  std::vector<Box> wide(boxes.begin(), boxes.end());
  for (Box& box : wide) {
    box.Include({box.low.x - margin_m, box.low.y - margin_m});
    box.Include({box.high.x + margin_m, box.high.y + margin_m});
    bounds_.Include(box.low);
    bounds_.Include(box.high);
  }
  if (boxes.empty()) {
    bounds_ = {{0, 0}, {1, 1}};
  }
  // About as many slots as boxes, square ones.
  const PlanePoint extent = bounds_.high - bounds_.low;
  const auto slots =
      static_cast<double>(std::clamp<size_t>(boxes.size(), 1, kMostSlots));
  const double side = std::max(std::sqrt(extent.x * extent.y / slots),
                               std::max(extent.x, extent.y) / slots);
  columns_ = static_cast<size_t>(extent.x / side) + 1;
  rows_ = static_cast<size_t>(extent.y / side) + 1;
  starts_.resize(columns_ * rows_ + 1);
  const auto for_each_slot = [&](const Box& box, const auto& body) {
    const auto low = SlotOf(box.low);
    const auto high = SlotOf(box.high);
    for (size_t row = low[1]; row <= high[1]; ++row) {
      for (size_t column = low[0]; column <= high[0]; ++column) {
        body(row * columns_ + column);
      }
    }
  };
  for (const Box& box : wide) {
    for_each_slot(box, [&](size_t slot) { ++starts_[slot + 1]; });
  }
  for (size_t i = 1; i < starts_.size(); ++i) {
    starts_[i] += starts_[i - 1];
  }
  items_.resize(starts_.back());
  std::vector<uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (size_t i = 0; i < wide.size(); ++i) {
    for_each_slot(wide[i], [&](size_t slot) {
      items_[next[slot]++] = static_cast<uint32_t>(i);
    });
  }
}

std::array<size_t, 2> PlaneIndex::SlotOf(PlanePoint p) const {
  const auto slot = [](double x, double low, double high, size_t count) {
    const double at = (x - low) / (high - low) * static_cast<double>(count);
    return static_cast<size_t>(
        std::clamp(at, 0.0, static_cast<double>(count - 1)));
  };
  return {slot(p.x, bounds_.low.x, bounds_.high.x, columns_),
          slot(p.y, bounds_.low.y, bounds_.high.y, rows_)};
}

std::span<const uint32_t> PlaneIndex::Near(PlanePoint p) const {
  const auto at = SlotOf(p);
  const size_t slot = at[1] * columns_ + at[0];
  return std::span(items_).subspan(starts_[slot],
                                   starts_[slot + 1] - starts_[slot]);
}

}  // namespace enfilade
