#include "partition/split_choice.h"

#include "base/stop.h"
#include "partition/joined_pieces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <vector>

namespace enfilade {
namespace {

// A plane is a wall if its fragments cover this share of the cross-section and
// at least this area,
constexpr double kCoverShare = 0.45;
constexpr double kLeastCoverM2 = 0.09;
// or if those as tall as this share of the region's height add up to this area,
constexpr double kTallShare = 0.75;
constexpr double kLeastTallM2 = 0.7;
// or if they are a slab of this area and this share of the cross-section, or of
// kLargeSlabM2 alone. In a level plane only connected pieces of kSlabM2 or of
// kLeastSlabPieceShare of the cross-section count, so that seats, desks and
// tables do not.
constexpr double kSlabM2 = 8.0;
constexpr double kSlabShare = 0.25;
constexpr double kLargeSlabM2 = 30.0;
constexpr double kLeastSlabPieceShare = 0.1;
constexpr double kSlabGapM = 0.01;
// At most kMostPlanes planes are examined, those of the largest area. At most
// kMostPlanesCompared of them, the best, are compared in full.
constexpr size_t kMostPlanes = 128;
constexpr size_t kMostPlanesCompared = 12;
// A region is not split into parts thinner than this.
constexpr double kLeastThicknessM = 2 * kOnPlaneM;

// Slabs are measured together while their polygons take no more than this.
constexpr uint64_t kSlabsBytes = 8ULL << 20;

// The fragments of one plane group within the region.
struct Group {
  uint32_t number = 0;
  double area_m2 = 0;
  double tall_m2 = 0;  // of fragments of the region's height
  uint64_t fragments = 0;
  uint64_t corners = 0;
  // The plane and area of the largest fragment whose plane can cut the region.
  std::optional<Plane> plane;
  double plane_m2 = 0;
  double section_m2 = 0;  // of the region's cross-section
  double wall_m2 = 0;     // 0 if the plane is not a wall
};

// A group takes memory in a map and in a list.
constexpr uint64_t kBytesPerRegionGroup = 2 * sizeof(Group) + 64;

struct Candidate {
  Plane plane;
  double share = 0;  // covered share of the cross-section
  double front = 0;  // number of fragments in front
  double back = 0;
  double cut = 0;
};

// The memory of the polygons of a slab and of finding its connected pieces.
uint64_t BytesOfSlab(const Group& group) {
  constexpr uint64_t kBytesPerPolygon =
      2 * sizeof(Polygon) + kAllocationHeaderBytes + 160;
  return group.fragments * kBytesPerPolygon + group.corners * sizeof(Point3);
}

class SplitChooser {
 public:
  SplitChooser(const ConvexRegion& region,
               const FragmentList& fragments,
               const WallRules& rules,
               MemoryBudget& budget)
      : region_(&region),
        fragments_(&fragments),
        rules_(&rules),
        budget_(&budget),
        charge_(budget, "the planes of the walls of a region") {
    const Vec3 extent = region.Bounds().Extent();
    height_m_ = std::abs(Dot(extent, rules.up));
  }

  [[nodiscard]] std::optional<Plane> Choose() {
    FindGroups();
    FindPlanes();
    FindWalls();
    std::vector<Candidate> candidates = Candidates();
    if (candidates.empty()) {
      return std::nullopt;
    }
    CountSides(candidates);
    // The first among equals: candidates are in the order of share, then of
    // group.
    const auto best =
        std::max_element(candidates.begin(),
                         candidates.end(),
                         [this](const Candidate& a, const Candidate& b) {
                           return Score(a) < Score(b);
                         });
    return best->plane;
  }

 private:
  // Finds the plane groups of the largest area.
  void FindGroups() {
    std::map<uint32_t, Group> by_plane;
    fragments_->Visit([&](const WallFragment& fragment) {
      const auto [found, is_new] =
          by_plane.try_emplace(fragment.plane_group, Group{});
      if (is_new) {
        charge_.GrowTo(by_plane.size() * kBytesPerRegionGroup);
      }
      Group& group = found->second;
      const double area = PolygonArea(fragment.polygon);
      group.area_m2 += area;
      const AxisRange tall = RangeAlong(fragment.polygon, rules_->up);
      if (tall.high - tall.low >= kTallShare * height_m_) {
        group.tall_m2 += area;
      }
      ++group.fragments;
      group.corners += fragment.polygon.size();
    });
    groups_.reserve(by_plane.size());
    for (const auto& [number, group] : by_plane) {
      groups_.push_back(group);
      groups_.back().number = number;
    }
    std::stable_sort(
        groups_.begin(), groups_.end(), [](const Group& a, const Group& b) {
          return a.area_m2 > b.area_m2;
        });
    groups_.resize(std::min(groups_.size(), kMostPlanes));
    for (size_t i = 0; i < groups_.size(); ++i) {
      place_of_[groups_[i].number] = i;
    }
  }

  [[nodiscard]] Group* Find(uint32_t number) {
    const auto found = place_of_.find(number);
    return found == place_of_.end() ? nullptr : &groups_[found->second];
  }

  // Finds the plane of each group's largest fragment that can cut the region.
  void FindPlanes() {
    fragments_->Visit([&](const WallFragment& fragment) {
      Group* group = Find(fragment.plane_group);
      if (group == nullptr) {
        return;
      }
      const double area = PolygonArea(fragment.polygon);
      if (area > group->plane_m2) {
        const auto thickness = region_->ThicknessAt(fragment.plane);
        if (std::min(thickness.front_m, thickness.back_m) > kLeastThicknessM) {
          group->plane = fragment.plane;
          group->plane_m2 = area;
        }
      }
    });
  }

  // Finds which of the groups are walls.
  void FindWalls() {
    std::vector<Group*> slabs;
    for (Group& group : groups_) {
      ThrowIfStopRequested();
      const Polygon section =
          group.plane ? region_->CrossSection(*group.plane) : Polygon();
      if (section.empty()) {
        continue;
      }
      group.section_m2 = PolygonArea(section);
      if (rules_->all_split) {
        group.wall_m2 = group.area_m2;
      } else if (std::abs(Dot(group.plane->normal, rules_->up)) < 0.5) {
        group.wall_m2 = UprightArea(group);
      } else if (IsSlab(group.area_m2, group.section_m2)) {
        slabs.push_back(&group);
      }
    }
    for (size_t first = 0; first < slabs.size();) {
      size_t end = first;
      uint64_t bytes = 0;
      do {
        bytes += BytesOfSlab(*slabs[end++]);
      } while (end < slabs.size() &&
               bytes + BytesOfSlab(*slabs[end]) <= kSlabsBytes);
      const MemoryCharge charge(*budget_, bytes, "the walls of one plane");
      MeasureSlabs(std::span(slabs).subspan(first, end - first));
      first = end;
    }
  }

  // Measures level planes, in which only large connected pieces count.
  void MeasureSlabs(std::span<Group* const> slabs) {
    std::map<uint32_t, std::vector<Polygon>> polygons;
    for (const Group* slab : slabs) {
      polygons[slab->number].reserve(slab->fragments);
    }
    fragments_->Visit([&polygons](const WallFragment& fragment) {
      const auto slab = polygons.find(fragment.plane_group);
      if (slab != polygons.end()) {
        slab->second.push_back(fragment.polygon);
      }
    });
    for (Group* slab : slabs) {
      const double pieces_m2 = AreaOfLargePieces(
          polygons.at(slab->number),
          slab->plane->normal,
          kSlabGapM,
          std::min(kSlabM2, kLeastSlabPieceShare * slab->section_m2));
      slab->wall_m2 = IsSlab(pieces_m2, slab->section_m2) ? pieces_m2 : 0;
    }
  }

  // The walls that cover the largest share of their cross-section, in that
  // order.
  [[nodiscard]] std::vector<Candidate> Candidates() const {
    std::vector<Candidate> candidates;
    for (const Group& group : groups_) {
      if (group.wall_m2 > 0) {
        candidates.push_back(
            {.plane = *group.plane,
             .share = std::min(1.0, group.wall_m2 / group.section_m2)});
      }
    }
    std::stable_sort(candidates.begin(),
                     candidates.end(),
                     [](const Candidate& a, const Candidate& b) {
                       return a.share > b.share;
                     });
    candidates.resize(std::min(candidates.size(), kMostPlanesCompared));
    return candidates;
  }

  // The area of the group if it is an upright wall, otherwise 0.
  static double UprightArea(const Group& group) {
    return Covers(group.area_m2, group.section_m2) ||
                   group.tall_m2 >= kLeastTallM2
               ? group.area_m2
               : 0;
  }

  static bool Covers(double area_m2, double section_m2) {
    return area_m2 >= kCoverShare * section_m2 && area_m2 >= kLeastCoverM2;
  }

  static bool IsSlab(double area_m2, double section_m2) {
    return Covers(area_m2, section_m2) ||
           (area_m2 >= kSlabM2 && area_m2 >= kSlabShare * section_m2) ||
           area_m2 >= kLargeSlabM2;
  }

  void CountSides(std::vector<Candidate>& candidates) const {
    fragments_->Visit([&candidates](const WallFragment& fragment) {
      for (Candidate& candidate : candidates) {
        switch (Classify(fragment.polygon, candidate.plane, kOnPlaneM)) {
          case PlaneSide::kFront:
            candidate.front += 1;
            break;
          case PlaneSide::kBack:
            candidate.back += 1;
            break;
          case PlaneSide::kCut:
            candidate.cut += 1;
            break;
          case PlaneSide::kOn:
            break;
        }
      }
    });
  }

  [[nodiscard]] double Score(const Candidate& candidate) const {
    const double all = static_cast<double>(fragments_->Size());
    const double level =
        std::abs(Dot(candidate.plane.normal, rules_->up)) > 0.99 ? 0.3 : 0.0;
    return candidate.share + level +
           0.8 * std::min(candidate.front, candidate.back) / all -
           candidate.cut / all;
  }

  const ConvexRegion* region_;
  const FragmentList* fragments_;
  const WallRules* rules_;
  MemoryBudget* budget_;
  GrowingCharge charge_;
  double height_m_ = 0;
  std::vector<Group> groups_;            // of the largest area, in that order
  std::map<uint32_t, size_t> place_of_;  // place in groups_, by number
};

}  // namespace

std::optional<Plane> ChooseSplit(const ConvexRegion& region,
                                 const FragmentList& fragments,
                                 const WallRules& rules,
                                 MemoryBudget& budget) {
  return SplitChooser(region, fragments, rules, budget).Choose();
}

}  // namespace enfilade
