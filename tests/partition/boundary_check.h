// Checks cells, portals and patches against each other at random places.

#pragma once

#include "base/random.h"
#include "partition/bsp_tree.h"
#include "partition/partition.h"
#include "partition/partition_store.h"

#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade::testing {

inline bool IsInPolygon(const Polygon& polygon, Point3 p, double tolerance_m) {
  const Vec3 normal = Normalize(AreaVector(polygon));
  if (std::abs(Dot(normal, p - polygon[0])) > tolerance_m) {
    return false;
  }
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 edge = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (Length(edge) > 1e-9 &&
        Dot(Normalize(Cross(normal, edge)), p - polygon[i]) < -tolerance_m) {
      return false;
    }
  }
  return true;
}

inline bool IsOnPatch(const Patch& patch, Point3 p, double tolerance_m) {
  Polygon polygon{patch.origin, patch.origin + patch.u, patch.origin + patch.v};
  if (patch.shape == PatchShape::kParallelogram) {
    polygon = {patch.origin,
               patch.origin + patch.u,
               patch.origin + patch.u + patch.v,
               patch.origin + patch.v};
  }
  return IsInPolygon(polygon, p, tolerance_m);
}

// Follows random segments through the box and checks every point where they
// leave a cell: a portal between the two cells or a patch of one of them must
// hold the point. Returns the number of points checked.
class BoundaryChecker {
 public:
  explicit BoundaryChecker(const BlockStorage& store)
      : store_(&store), partition_(LoadPartition(store)), locator_(store) {
    for (const Portal& portal : partition_.portals) {
      portals_[Pair(portal.front, portal.back)].push_back(&portal);
    }
  }

  size_t Follow(Point3 from, Point3 to) {
    size_t crossings = 0;
    double t = 0;
    while (const auto crossing = NextCrossing(from, to, t)) {
      ++crossings;
      const Point3 p = Lerp(from, to, crossing->t);
      if (!IsPassable(crossing->out, crossing->in, p)) {
        ADD_FAILURE() << "open boundary without portal between cells "
                      << crossing->out.value << " and " << crossing->in.value
                      << " at " << p.x << " " << p.y << " " << p.z;
        return crossings;
      }
      t = crossing->t + 1e-9;
    }
    return crossings;
  }

  [[nodiscard]] const Box3& Box() const { return locator_.Box(); }

 private:
  static constexpr int kSteps = 128;
  // Patches and portals within these distances count; they are the tolerances
  // of faces in planes and of cracks.
  static constexpr double kNearPatchM = 1e-4;
  static constexpr double kNearPortalM = 1e-6;

  struct Crossing {
    double t = 0;
    CellId out;
    CellId in;
  };

  static std::pair<CellId, CellId> Pair(CellId a, CellId b) {
    return {std::min(a, b), std::max(a, b)};
  }

  [[nodiscard]] std::optional<Crossing> NextCrossing(Point3 from,
                                                     Point3 to,
                                                     double start) const {
    const CellId here = locator_.Locate(Lerp(from, to, start));
    const auto step = static_cast<int>(start * kSteps);
    for (int i = step + 1; i <= kSteps; ++i) {
      double high = static_cast<double>(i) / kSteps;
      if (locator_.Locate(Lerp(from, to, high)) == here) {
        continue;
      }
      double low = std::max(start, static_cast<double>(i - 1) / kSteps);
      while (high - low > 1e-13) {
        const double middle = 0.5 * (low + high);
        (locator_.Locate(Lerp(from, to, middle)) == here ? low : high) = middle;
      }
      return Crossing{high, here, locator_.Locate(Lerp(from, to, high))};
    }
    return std::nullopt;
  }

  bool IsPassable(CellId a, CellId b, Point3 p) {
    for (const Portal* portal : portals_[Pair(a, b)]) {
      if (IsInPolygon(portal->vertices, p, kNearPortalM)) {
        return true;
      }
    }
    return IsOnPatchOf(a, p) || IsOnPatchOf(b, p);
  }

  bool IsOnPatchOf(CellId cell, Point3 p) {
    auto found = patches_.find(cell);
    if (found == patches_.end()) {
      found = patches_.emplace(cell, LoadCellPatches(*store_, cell)).first;
    }
    for (const Patch& patch : found->second.patches) {
      if (IsOnPatch(patch, p, kNearPatchM)) {
        return true;
      }
    }
    return false;
  }

  const BlockStorage* store_;
  Partition partition_;
  PartitionLocator locator_;
  std::map<std::pair<CellId, CellId>, std::vector<const Portal*>> portals_;
  std::map<CellId, CellPatches> patches_;
};

inline Point3 RandomPointIn(const Box3& box, Random& random) {
  const Vec3 extent = box.Extent();
  return box.low + Vec3{extent.x * random.Next(),
                        extent.y * random.Next(),
                        extent.z * random.Next()};
}

inline size_t CheckBoundaries(const BlockStorage& store,
                              int segments,
                              uint64_t seed) {
  BoundaryChecker checker(store);
  Random random(MixKey(seed, 0xb0a2d));
  size_t crossings = 0;
  for (int i = 0; i < segments; ++i) {
    const Point3 from = RandomPointIn(checker.Box(), random);
    const Point3 to = RandomPointIn(checker.Box(), random);
    crossings += checker.Follow(from, to);
    if (::testing::Test::HasFailure()) {
      break;
    }
  }
  return crossings;
}

}  // namespace enfilade::testing
