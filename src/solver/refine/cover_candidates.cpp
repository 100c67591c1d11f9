#include "solver/refine/cover_candidates.h"

#include <cmath>
#include <utility>

namespace enfilade {
namespace {

// A patch can cover a surface only inside of the patch's projection onto the
// surface or within this distance of the projection.
constexpr float kCoverMargin = 0.05F;  // m
// A patch that is nearer to the plane of a surface than this does not stand
// before the surface.
constexpr float kInPlane = 1e-4F;  // m

struct Range {
  float low = 1e30F;
  float high = -1e30F;

  void Add(float v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
};

// Where on a patch other patches can cover it: their projections, widened.
class Projections {
 public:
  Projections(const CoverSide& cell, size_t patch)
      : cell_(&cell), self_(patch), patch_(&cell.patches[patch]) {
    const Corners corners = CornersOf(*patch_, {});
    for (const Vec3f p : corners.View()) {
      reach_.Add(p + Vec3f{kCoverReach, kCoverReach, kCoverReach});
      reach_.Add(p - Vec3f{kCoverReach, kCoverReach, kCoverReach});
    }
    if (!cell.clusters->Items().empty()) {
      Visit(0);
    }
  }

  [[nodiscard]] std::vector<PatchRect> Take() { return std::move(rects_); }

 private:
  void Visit(uint32_t node) {
    const Cluster& cluster = cell_->clusters->Clusters()[node];
    if (!cluster.box.Overlaps(reach_) || IsClear(HeightsOf(cluster.box))) {
      return;
    }
    if (cluster.child != 0) {
      Visit(cluster.child);
      Visit(cluster.child + 1);
      return;
    }
    for (uint32_t i = cluster.first; i < cluster.first + cluster.count; ++i) {
      const uint32_t other = cell_->clusters->Items()[i].patch;
      if (other != self_) {
        Project(cell_->patches[other]);
      }
    }
  }

  void Project(const PatchGeometry& other) {
    const Corners corners = CornersOf(other, {});
    Range height;
    for (const Vec3f p : corners.View()) {
      height.Add(Dot(p - patch_->origin, patch_->normal));
    }
    if (IsClear(height)) {
      return;
    }
    const Vec3f cross = Cross(patch_->u, patch_->v);
    const float square = Dot(cross, cross);
    const float area = std::sqrt(square);
    Range a;
    Range b;
    for (const Vec3f p : corners.View()) {
      const Vec3f d = p - patch_->origin;
      a.Add(Dot(Cross(d, patch_->v), cross) / square);
      b.Add(Dot(Cross(patch_->u, d), cross) / square);
    }
    const float wide_a = kCoverMargin * Length(patch_->v) / area;
    const float wide_b = kCoverMargin * Length(patch_->u) / area;
    const PatchRect rect = {
        a.low - wide_a, a.high + wide_a, b.low - wide_b, b.high + wide_b};
    if (rect.low_a < 1 && rect.high_a > 0 && rect.low_b < 1 &&
        rect.high_b > 0) {
      rects_.push_back(rect);
    }
  }

  [[nodiscard]] Range HeightsOf(const Box& box) const {
    const Vec3f n = patch_->normal;
    const Vec3f middle = (box.low + box.high) * 0.5F - patch_->origin;
    const Vec3f half = (box.high - box.low) * 0.5F;
    const float spread = half.x * std::abs(n.x) + half.y * std::abs(n.y) +
                         half.z * std::abs(n.z);
    return {Dot(middle, n) - spread, Dot(middle, n) + spread};
  }

  static bool IsClear(Range height) {
    return height.high <= kInPlane || height.low >= kCoverReach;
  }

  const CoverSide* cell_;
  size_t self_;
  const PatchGeometry* patch_;
  Box reach_;
  std::vector<PatchRect> rects_;
};

}  // namespace

std::vector<PatchRect> CoverCandidates(const CoverSide& cell, size_t patch) {
  return Projections(cell, patch).Take();
}

}  // namespace enfilade
