#include "partition/overlap_sizes.h"

#include "base/disjoint_sets.h"
#include "base/stop.h"
#include "partition/overlap.h"
#include "partition/overlap_pairs.h"
#include "partition/patch_cutter.h"
#include "partition/polygon.h"

#include <algorithm>
#include <utility>

namespace enfilade {
namespace {

constexpr double kRounding = 1e-3;  // of areas
// Patches that lie in a patch beyond these are not counted: time would grow
// with their square.
constexpr int kMostWithin = 16;

// Whether a line along an edge of `a` separates `b` from it, by more than
// kCoincidentM. The two are convex, face along `normal` and lie in one plane.
bool IsBeyondAnEdge(const Polygon& b, const Polygon& a, Vec3 normal) {
  for (size_t i = 0; i < a.size(); ++i) {
    const Vec3 out = Normalize(Cross(a[(i + 1) % a.size()] - a[i], normal));
    if (std::all_of(b.begin(), b.end(), [&](Point3 p) {
          return Dot(p - a[i], out) > kCoincidentM;
        })) {
      return true;
    }
  }
  return false;
}

class SurfaceFinder {
 public:
  SurfaceFinder(std::span<const Patch> patches, const BoxTree& tree)
      : patches_(patches), tree_(tree), surfaces_(patches.size()) {}

  std::vector<SurfaceRank> Run(std::span<const FaceFacts> faces) {
    std::vector<double> shares(patches_.size());
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      ThrowIfStopRequested();
      shares[i] = JoinKin(i);
    }
    std::vector<double> areas(patches_.size());
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      areas[surfaces_.Find(i)] += shares[i];
    }
    const std::vector<uint32_t> here = Ranks(areas);
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      double& area = areas[surfaces_.Find(i)];
      const float whole = faces[patches_[i].face.Index()].surface_m2;
      area = std::max(area, static_cast<double>(whole));
    }
    const std::vector<uint32_t> anywhere = Ranks(areas);
    std::vector<SurfaceRank> ranks;
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      const uint32_t surface = surfaces_.Find(i);
      ranks.push_back({here[surface], anywhere[surface]});
    }
    return ranks;
  }

 private:
  // Joins a patch with those of its surface that touch it. Returns its share of
  // the surface's area, m2.
  double JoinKin(uint32_t own) {
    const Polygon polygon = PolygonOf(patches_[own]);
    const Plane plane = PlaneOf(polygon);
    const double area = PolygonArea(polygon);
    double covered = area;
    int within = 0;
    tree_.ForOverlaps(BoundsOf(polygon), [&](uint32_t k) {
      const bool is_joined = surfaces_.Find(own) == surfaces_.Find(k);
      if (k == own || (is_joined && within == kMostWithin) ||
          !AreKin(patches_[own], patches_[k], plane)) {
        return;
      }
      const Polygon other = PolygonOf(patches_[k]);
      if (!is_joined && !IsBeyondAnEdge(other, polygon, plane.normal) &&
          !IsBeyondAnEdge(polygon, other, plane.normal)) {
        surfaces_.Join(own, k);
      }
      const double common = OverlapArea(polygon, other, plane.normal);
      within += common > 0 ? 1 : 0;
      covered += common;
    });
    return area * area / covered;
  }

  // Whether patches that touch would be of one surface; `plane` is that of the
  // first.
  static bool AreKin(const Patch& a, const Patch& b, const Plane& plane) {
    return a.material == b.material && a.emits == b.emits &&
           a.is_enclosed == b.is_enclosed &&
           Dot(PatchNormal(b), plane.normal) >= kLeastFacing &&
           Classify(PolygonOf(b), plane, kCoincidentM) == PlaneSide::kOn;
  }

  // The ranks of surfaces by their areas, both by the number of the surface.
  std::vector<uint32_t> Ranks(const std::vector<double>& areas) {
    std::vector<uint32_t> by_area;
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      if (surfaces_.Find(i) == i) {
        by_area.push_back(i);
      }
    }
    std::sort(by_area.begin(), by_area.end(), [&](uint32_t a, uint32_t b) {
      return std::pair(areas[a], a) < std::pair(areas[b], b);
    });
    std::vector<uint32_t> ranks(patches_.size());
    uint32_t rank = 0;
    double least = 0;  // of this rank
    for (const uint32_t surface : by_area) {
      if (areas[surface] > (1 + kRounding) * least) {
        least = areas[surface];
        ++rank;
      }
      ranks[surface] = rank;
    }
    return ranks;
  }

  std::span<const Patch> patches_;
  const BoxTree& tree_;
  DisjointSets surfaces_;
};

}  // namespace

std::vector<SurfaceRank> RankSurfaces(std::span<const Patch> patches,
                                      const BoxTree& tree,
                                      std::span<const FaceFacts> faces) {
  return SurfaceFinder(patches, tree).Run(faces);
}

}  // namespace enfilade
