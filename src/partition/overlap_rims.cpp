#include "partition/overlap_rims.h"

#include "base/plane.h"
#include "base/stop.h"
#include "partition/patch_cutter.h"
#include "partition/polygon.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

namespace enfilade {
namespace {

// A strip of more than this share of a patch is left: the patch itself is as
// narrow as the gap behind the piece.
constexpr double kMostShare = 0.25;
// A part of an edge that is shorter than this is no crack, m.
constexpr double kNoCrackM = kCoincidentM;

// The part of an edge that a raised piece covers.
struct CoveredEdge {
  uint32_t patch = 0;
  uint32_t edge = 0;
  double from = 0;  // along the edge, m
  double until = 0;
  double length = 0;
  double share = 0;  // RimCut::share
};

// The range of the segment from a to b, in metres along it, that lies within a
// convex polygon grown by kCoincidentM; nullopt if there is none. The segment
// lies in the polygon's plane.
std::optional<std::pair<double, double>> Within(Point3 a,
                                                Point3 b,
                                                const Polygon& polygon,
                                                Vec3 normal) {
  const double length = Length(b - a);
  double from = 0;
  double until = length;
  const Vec3 along = (b - a) / length;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point3 corner = polygon[i];
    const Vec3 side = polygon[(i + 1) % polygon.size()] - corner;
    const double side_length = Length(side);
    if (!(side_length > 0)) {
      continue;
    }
    const Vec3 inwards = Cross(normal, side / side_length);
    const double at_a = Dot(a - corner, inwards) + kCoincidentM;
    const double slope = Dot(along, inwards);
    if (slope > 0) {
      from = std::max(from, -at_a / slope);
    } else if (slope < 0) {
      until = std::min(until, at_a / -slope);
    } else if (at_a < 0) {
      return std::nullopt;
    }
  }
  return from < until ? std::optional(std::pair(from, until)) : std::nullopt;
}

// How far the polygon reaches in front of a plane.
double ReachBefore(const Polygon& polygon, const Plane& plane) {
  double reach = -std::numeric_limits<double>::infinity();
  for (const Point3 corner : polygon) {
    reach = std::max(reach, plane.Distance(corner));
  }
  return reach;
}

class RimFinder {
 public:
  RimFinder(std::span<const Patch> patches,
            const BoxTree& tree,
            const OverlapPieces& pieces,
            GrowingCharge* charge)
      : patches_(patches), tree_(&tree), pieces_(&pieces), charge_(charge) {}

  std::vector<RimCut> Find() {
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      const std::vector<OverlapPiece>* pieces = pieces_->Find(i);
      // What no light reaches has no bright strip behind it.
      if (pieces == nullptr || patches_[i].is_enclosed) {
        continue;
      }
      ThrowIfStopRequested();
      for (const OverlapPiece& piece : *pieces) {
        if (piece.layer > 0) {
          FindBehind(piece, PatchNormal(patches_[i]));
        }
      }
    }
    return Cuts();
  }

 private:
  void FindBehind(const OverlapPiece& piece, Vec3 normal) {
    const Plane plane = PlaneOf(piece.polygon);
    const Box3 box = Grown(BoundsOf(piece.polygon), kCoincidentM);
    tree_->ForOverlaps(box, [&](uint32_t k) {
      if (pieces_->Find(k) == nullptr && !patches_[k].is_enclosed) {
        AddEdges(k, piece, plane, normal);
      }
    });
  }

  // Adds the edge of patch k that stands on the piece, if it has one and faces
  // the piece.
  void AddEdges(uint32_t k,
                const OverlapPiece& piece,
                const Plane& plane,
                Vec3 normal) {
    const Polygon corners = PolygonOf(patches_[k]);
    const double rise = ReachBefore(corners, plane);
    const double share = piece.layer * kApartM / rise;
    if (!(share > 0 && share < kMostShare)) {
      return;
    }
    for (uint32_t e = 0; e < corners.size(); ++e) {
      const Point3 a = corners[e];
      const Point3 b = corners[(e + 1) % corners.size()];
      const bool is_in_plane = std::abs(plane.Distance(a)) <= kCoincidentM &&
                               std::abs(plane.Distance(b)) <= kCoincidentM;
      if (!is_in_plane ||
          ReachBefore(piece.polygon, PlaneOf(corners)) <= kCoincidentM) {
        continue;
      }
      if (const auto within = Within(a, b, piece.polygon, normal)) {
        edges_.push_back(
            {k, e, within->first, within->second, Length(b - a), share});
        constexpr uint64_t kGrowth = 3;  // of a vector while it grows
        charge_->GrowTo(kGrowth * edges_.size() *
                        (sizeof(CoveredEdge) + sizeof(RimCut)));
      }
    }
  }

  // The edges that are covered from end to end.
  std::vector<RimCut> Cuts() {
    std::sort(edges_.begin(),
              edges_.end(),
              [](const CoveredEdge& x, const CoveredEdge& y) {
                return std::tie(x.patch, x.edge, x.from, x.until) <
                       std::tie(y.patch, y.edge, y.from, y.until);
              });
    std::vector<RimCut> cuts;
    for (size_t i = 0; i < edges_.size();) {
      const CoveredEdge& first = edges_[i];
      double covered = 0;  // from the beginning of the edge
      double share = 0;
      for (; i < edges_.size() && edges_[i].patch == first.patch &&
             edges_[i].edge == first.edge;
           ++i) {
        if (edges_[i].from <= covered + kNoCrackM) {
          covered = std::max(covered, edges_[i].until);
        }
        share = std::max(share, edges_[i].share);
      }
      if (covered >= first.length - kNoCrackM) {
        cuts.push_back({first.patch, first.edge, share});
      }
    }
    return cuts;
  }

  std::span<const Patch> patches_;
  const BoxTree* tree_;
  const OverlapPieces* pieces_;
  GrowingCharge* charge_;
  std::vector<CoveredEdge> edges_;
};

}  // namespace

std::vector<RimCut> FindRims(std::span<const Patch> patches,
                             const BoxTree& tree,
                             const OverlapPieces& pieces,
                             GrowingCharge* charge) {
  return RimFinder(patches, tree, pieces, charge).Find();
}

Patch WithoutRim(Patch patch, const RimCut& cut) {
  const double left = 1 - cut.share;
  if (patch.shape == PatchShape::kTriangle) {
    // What is left is alike, about the corner opposite the edge.
    const Vec3 to_opposite = cut.edge == 0   ? patch.v
                             : cut.edge == 1 ? Vec3{0, 0, 0}
                                             : patch.u;
    patch.origin = patch.origin + to_opposite * cut.share;
    patch.u = patch.u * left;
    patch.v = patch.v * left;
    return patch;
  }
  // Edges 0 and 2 are along u, 1 and 3 along v.
  Vec3& across = cut.edge % 2 == 0 ? patch.v : patch.u;
  if (cut.edge == 0 || cut.edge == 3) {
    patch.origin = patch.origin + across * cut.share;
  }
  across = across * left;
  return patch;
}

}  // namespace enfilade
