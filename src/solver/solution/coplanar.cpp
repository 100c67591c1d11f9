#include "solver/solution/coplanar.h"

#include "base/directions.h"
#include "partition/patch_points.h"
#include "partition/polygon.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace enfilade {
namespace {

// Only planes whose keys are equal or adjacent are compared.
constexpr double kNormalStep = 1e-3;
constexpr double kOffsetStepM = 1e-3;

using PlaneKey = std::tuple<uint32_t, bool, bool, std::array<int64_t, 4>>;

// Offsets are measured from `near`, a point of the cell: far away, as in map
// coordinates, the rounding of a normal would move the planes of one wall
// apart.
std::array<double, 4> PlaneNumbers(const Patch& p, Point3 near) {
  const Vec3 n = PatchNormal(p);
  return {n.x / kNormalStep,
          n.y / kNormalStep,
          n.z / kNormalStep,
          Dot(n, p.origin - near) / kOffsetStepM};
}

// The key of the patch's plane or, for `mask` > 0, an adjacent key: bit i of
// `mask` moves number i to its nearer neighbour. Two patches of one plane are
// so found even if rounding puts them on two sides of a border between keys.
PlaneKey KeyOf(const Patch& p, Point3 near, unsigned mask) {
  const std::array<double, 4> numbers = PlaneNumbers(p, near);
  std::array<int64_t, 4> key{};
  for (size_t i = 0; i < key.size(); ++i) {
    const double floor = std::floor(numbers[i]);
    const int64_t aside = numbers[i] - floor < 0.5 ? -1 : 1;
    key[i] = static_cast<int64_t>(floor) + ((mask >> i & 1) != 0 ? aside : 0);
  }
  return {p.material.value, p.emits, p.reflects, key};
}

bool InPlane(const PatchPlane& frame, const Patch& patch) {
  const CornerList<Point3> list = CornersOf(patch);
  const std::span<const Point3> corners = list.View();
  return Dot(frame.normal, PatchNormal(patch)) > 0 &&
         std::all_of(corners.begin(), corners.end(), [&](Point3 p) {
           return std::abs(frame.Height(p)) <= kOnPlaneM;
         });
}

// Finds the segment along which a patch meets the plane. Returns false if the
// patch lies in the plane or meets it in no segment longer than kCrackM.
bool MeetsPlane(const PatchPlane& frame,
                const Patch& patch,
                PlaneSegment* segment) {
  const CornerList<Point3> list = CornersOf(patch);
  const std::span<const Point3> corners = list.View();
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

PatchPlane::PatchPlane(const Patch& patch)
    : origin(patch.origin), normal(PatchNormal(patch)) {
  const NormalAxes axes = AxesAbout(normal, patch.u);
  x_axis = axes.u;
  y_axis = axes.v;
}

CoplanarPatches::CoplanarPatches(std::span<const Patch> cell_patches)
    : patches(cell_patches) {
  std::map<PlaneKey, std::vector<size_t>> known;
  constexpr unsigned kMasks = 16;
  const Point3 near = patches.empty() ? Point3{} : patches.front().origin;
  // Finds a group under `key` whose plane the patch lies in; returns
  // groups.size() if there is none.
  const auto find = [&](const Patch& patch, const PlaneKey& key) {
    const auto at = known.find(key);
    if (at == known.end()) {
      return groups.size();
    }
    const auto fits =
        std::find_if(at->second.begin(), at->second.end(), [&](size_t group) {
          return InPlane(PatchPlane(FirstOf(group)), patch);
        });
    return fits == at->second.end() ? groups.size() : *fits;
  };
  boxes.reserve(patches.size());
  for (size_t i = 0; i < patches.size(); ++i) {
    const CornerList<Point3> corners = CornersOf(patches[i]);
    boxes.push_back(BoundsOf(corners.View()));
    size_t group = groups.size();
    for (unsigned mask = 0; mask < kMasks && group == groups.size(); ++mask) {
      group = find(patches[i], KeyOf(patches[i], near, mask));
    }
    if (group == groups.size()) {
      groups.emplace_back();
      known[KeyOf(patches[i], near, 0)].push_back(group);
    }
    groups[group].emplace_back(i);
  }
}

std::vector<PlaneSegment> StandingSegments(const CoplanarPatches& cell,
                                           size_t group) {
  const PatchPlane frame(cell.FirstOf(group));
  Box3 bounds;
  for (const PatchId id : cell.groups[group]) {
    bounds.Include(cell.boxes[id.Index()]);
  }
  const Vec3 margin{kCrackM, kCrackM, kCrackM};
  bounds.low = bounds.low - margin;
  bounds.high = bounds.high + margin;
  std::vector<PlaneSegment> segments;
  for (size_t i = 0; i < cell.patches.size(); ++i) {
    PlaneSegment segment;
    if (bounds.Overlaps(cell.boxes[i]) &&
        MeetsPlane(frame, cell.patches[i], &segment)) {
      segments.push_back(segment);
    }
  }
  return segments;
}

}  // namespace enfilade
