#include "partition/split_choice.h"

#include "base/stop.h"
#include "partition/joined_pieces.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace enfilade {
namespace {

// A plane is a wall if its fragments cover this share of the cross-section,
// and so much of it in all,
constexpr double kCoverShare = 0.45;
constexpr double kLeastCoverM2 = 0.09;
// or stand this share of the region's height and add up to this area,
constexpr double kTallShare = 0.75;
constexpr double kLeastTallM2 = 0.7;
// or are a slab of this area and share, or of that area alone. Of what is level
// only pieces of that area or of this share of the cross-section count: seats,
// desks and tables are none.
constexpr double kSlabM2 = 8.0;
constexpr double kSlabShare = 0.25;
constexpr double kLargeSlabM2 = 30.0;
constexpr double kLeastSlabPieceShare = 0.1;
constexpr double kSlabGapM = 0.01;
// Planes are examined in the order of their area, up to this many; as many of
// the best as that are compared in full.
constexpr size_t kMostPlanes = 128;
constexpr size_t kMostPlanesCompared = 12;
// A region is not split into parts thinner than this.
constexpr double kLeastThicknessM = 2 * kOnPlaneM;

// The fragments of one plane group within the region.
struct Group {
  std::vector<uint32_t> fragments;
  double area_m2 = 0;
  double tall_m2 = 0;  // of the fragments that stand the region's height
};

struct Candidate {
  Plane plane;
  double share = 0;  // of the cross-section, covered
  double score = 0;
};

class SplitChooser {
 public:
  SplitChooser(const ConvexRegion& region,
               const std::vector<WallFragment>& fragments,
               const WallFaces& walls)
      : region_(&region), fragments_(&fragments), walls_(&walls) {
    const Vec3 extent = region.Bounds().Extent();
    height_m_ = std::abs(Dot(extent, walls.up));
  }

  [[nodiscard]] std::optional<Plane> Choose() const {
    std::vector<Candidate> candidates = Walls();
    if (candidates.empty()) {
      return std::nullopt;
    }
    const size_t compared = std::min(candidates.size(), kMostPlanesCompared);
    for (size_t i = 0; i < compared; ++i) {
      candidates[i].score = Score(candidates[i]);
    }
    candidates.resize(compared);
    // The first of equals: the order is by share and then by group.
    const auto best =
        std::max_element(candidates.begin(),
                         candidates.end(),
                         [](const Candidate& a, const Candidate& b) {
                           return a.score < b.score;
                         });
    return best->plane;
  }

 private:
  [[nodiscard]] std::vector<Group> GroupsByArea() const {
    std::map<uint32_t, Group> by_plane;
    for (uint32_t i = 0; i < fragments_->size(); ++i) {
      const WallFragment& fragment = (*fragments_)[i];
      Group& group = by_plane[walls_->faces[fragment.face].plane_group];
      const double area = PolygonArea(fragment.polygon);
      group.fragments.push_back(i);
      group.area_m2 += area;
      const AxisRange tall = RangeAlong(fragment.polygon, walls_->up);
      if (tall.high - tall.low >= kTallShare * height_m_) {
        group.tall_m2 += area;
      }
    }
    std::vector<Group> groups;
    groups.reserve(by_plane.size());
    for (auto& [plane, group] : by_plane) {
      groups.push_back(std::move(group));
    }
    std::stable_sort(
        groups.begin(), groups.end(), [](const Group& a, const Group& b) {
          return a.area_m2 > b.area_m2;
        });
    return groups;
  }

  // The plane of the group's largest fragment that can cut the region.
  [[nodiscard]] std::optional<Plane> PlaneOfGroup(const Group& group) const {
    std::optional<Plane> best;
    double best_m2 = 0;
    for (const uint32_t i : group.fragments) {
      const WallFragment& fragment = (*fragments_)[i];
      const double area = PolygonArea(fragment.polygon);
      if (area > best_m2) {
        const Plane& plane = walls_->faces[fragment.face].plane;
        const auto thickness = region_->ThicknessAt(plane);
        if (std::min(thickness.front_m, thickness.back_m) > kLeastThicknessM) {
          best = plane;
          best_m2 = area;
        }
      }
    }
    return best;
  }

  // The planes that are walls of the region, those that cover most first.
  [[nodiscard]] std::vector<Candidate> Walls() const {
    std::vector<Candidate> candidates;
    const std::vector<Group> groups = GroupsByArea();
    for (size_t i = 0; i < std::min(groups.size(), kMostPlanes); ++i) {
      ThrowIfStopRequested();
      const auto plane = PlaneOfGroup(groups[i]);
      if (!plane) {
        continue;
      }
      const Polygon section = region_->CrossSection(*plane);
      if (section.empty()) {
        continue;
      }
      const double section_m2 = PolygonArea(section);
      const double wall_m2 = walls_->all_split
                                 ? groups[i].area_m2
                                 : WallArea(groups[i], *plane, section_m2);
      if (wall_m2 > 0) {
        candidates.push_back({*plane, std::min(1.0, wall_m2 / section_m2), 0});
      }
    }
    std::stable_sort(candidates.begin(),
                     candidates.end(),
                     [](const Candidate& a, const Candidate& b) {
                       return a.share > b.share;
                     });
    return candidates;
  }

  // The area of a wall of that cross-section; 0 if it is none.
  [[nodiscard]] double WallArea(const Group& group,
                                const Plane& plane,
                                double section_m2) const {
    if (std::abs(Dot(plane.normal, walls_->up)) < 0.5) {
      return Covers(group.area_m2, section_m2) || group.tall_m2 >= kLeastTallM2
                 ? group.area_m2
                 : 0;
    }
    if (!IsSlab(group.area_m2, section_m2)) {
      return 0;
    }
    const double pieces_m2 =
        AreaOfLargePieces(PolygonsOf(group),
                          plane.normal,
                          kSlabGapM,
                          std::min(kSlabM2, kLeastSlabPieceShare * section_m2));
    return IsSlab(pieces_m2, section_m2) ? pieces_m2 : 0;
  }

  static bool Covers(double area_m2, double section_m2) {
    return area_m2 >= kCoverShare * section_m2 && area_m2 >= kLeastCoverM2;
  }

  static bool IsSlab(double area_m2, double section_m2) {
    return Covers(area_m2, section_m2) ||
           (area_m2 >= kSlabM2 && area_m2 >= kSlabShare * section_m2) ||
           area_m2 >= kLargeSlabM2;
  }

  [[nodiscard]] std::vector<const Polygon*> PolygonsOf(
      const Group& group) const {
    std::vector<const Polygon*> polygons;
    polygons.reserve(group.fragments.size());
    for (const uint32_t i : group.fragments) {
      polygons.push_back(&(*fragments_)[i].polygon);
    }
    return polygons;
  }

  [[nodiscard]] double Score(const Candidate& candidate) const {
    double front = 0;
    double back = 0;
    double cut = 0;
    for (const WallFragment& fragment : *fragments_) {
      switch (Classify(fragment.polygon, candidate.plane, kOnPlaneM)) {
        case PlaneSide::kFront:
          front += 1;
          break;
        case PlaneSide::kBack:
          back += 1;
          break;
        case PlaneSide::kCut:
          cut += 1;
          break;
        case PlaneSide::kOn:
          break;
      }
    }
    const double all = static_cast<double>(fragments_->size());
    const double level =
        std::abs(Dot(candidate.plane.normal, walls_->up)) > 0.99 ? 0.3 : 0.0;
    return candidate.share + level + 0.8 * std::min(front, back) / all -
           cut / all;
  }

  const ConvexRegion* region_;
  const std::vector<WallFragment>* fragments_;
  const WallFaces* walls_;
  double height_m_ = 0;
};

}  // namespace

std::optional<Plane> ChooseSplit(const ConvexRegion& region,
                                 const std::vector<WallFragment>& fragments,
                                 const WallFaces& walls) {
  return SplitChooser(region, fragments, walls).Choose();
}

}  // namespace enfilade
