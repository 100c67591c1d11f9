#include "partition/cell_merge.h"

#include "base/disjoint_sets.h"
#include "base/stop.h"

#include <algorithm>
#include <map>
#include <utility>

namespace enfilade {
namespace {

// Two leaves look like one room if at least this share of their border is open
constexpr double kOpenShare = 0.75;
// (or this share in a model of surfaces without furniture, where windows may
// leave only their frames of a wall)
constexpr double kAllOpenShare = 0.98;
// and the opening either covers this share of the wider leaf's cross-section,
constexpr double kSameSection = 0.6;
// or is wider than a door, between leaves that are deeper than a wall is thick.
constexpr double kWideOpeningM2 = 4.0;
constexpr double kDeeperThanWallM = 0.6;
// A cell of less volume is too small for a room: a crack, or a piece between
// two planes.
constexpr double kNicheM3 = 0.5;
// So is a cell of less volume than this that is no thicker than a wall: a
// doorway, a window.
constexpr double kThinNicheM3 = 2.0;
// A leaf that is thinner than this and opens to no thicker leaf is the inside
// of a wall or floor.
constexpr double kLeastRoomM = 1.0;

// Disjoint sets of leaves with the number and area of their patches.
class LeafSets {
 public:
  LeafSets(const FaceSurvey& survey, uint32_t most_patches)
      : sets_(survey.patches.size()),
        patches_(survey.patches.begin(), survey.patches.end()),
        area_m2_(survey.area_m2.begin(), survey.area_m2.end()),
        most_patches_(most_patches) {}

  [[nodiscard]] uint32_t Find(uint32_t leaf) { return sets_.Find(leaf); }

  // Whether a and b are in two different sets that one cell can hold together.
  [[nodiscard]] bool CanJoin(uint32_t a, uint32_t b) {
    a = Find(a);
    b = Find(b);
    return a != b && patches_[a] + patches_[b] <= most_patches_;
  }

  // Joins the two sets if CanJoin. Returns whether they were joined just now.
  bool Join(uint32_t a, uint32_t b) {
    if (!CanJoin(a, b)) {
      return false;
    }
    a = Find(a);
    b = Find(b);
    const uint64_t patches = patches_[a] + patches_[b];
    const double area_m2 = area_m2_[a] + area_m2_[b];
    sets_.Join(a, b);
    patches_[Find(a)] = patches;
    area_m2_[Find(a)] = area_m2;
    return true;
  }

  // The area of the set that joining a and b would make.
  [[nodiscard]] double JoinedArea(uint32_t a, uint32_t b) {
    return area_m2_[Find(a)] + area_m2_[Find(b)];
  }

 private:
  DisjointSets sets_;
  std::vector<uint64_t> patches_;  // by the number that leads a set
  std::vector<double> area_m2_;    // likewise
  uint64_t most_patches_;
};

// Whether the leaves on both sides of an open border look like one room.
bool LooksLikeOneRoom(const BuiltTree& built, const LeafBorder& border) {
  const LeafShape& front = built.leaves[border.front.Index()];
  const LeafShape& back = built.leaves[border.back.Index()];
  const double section_m2 = std::max(front.volume_m3 / border.front_m,
                                     back.volume_m3 / border.back_m);
  return border.open_m2 >= kSameSection * section_m2 ||
         (border.open_m2 >= kWideOpeningM2 &&
          std::min(border.front_m, border.back_m) >= kDeeperThanWallM);
}

// Finds the leaves that touch the box around the scene. They are the outdoors,
// except for pieces of open ground, sky and courtyards that are cut off by the
// planes of walls.
std::vector<bool> FindOuterLeaves(const BuiltTree& built) {
  const Box3& box = built.tree.box;
  std::vector<bool> outer;
  outer.reserve(built.leaves.size());
  for (const LeafShape& leaf : built.leaves) {
    const Vec3 low = leaf.bounds.low - box.low;
    const Vec3 high = box.high - leaf.bounds.high;
    outer.push_back(std::min({low.x, low.y, low.z, high.x, high.y, high.z}) <
                    kRoundingM);
  }
  return outer;
}

// The borders, those with the widest openings first; among equals in their
// order.
std::vector<const LeafBorder*> WidestFirst(const LeafBorders& borders) {
  std::vector<const LeafBorder*> order;
  order.reserve(borders.size());
  for (const LeafBorder& border : borders) {
    order.push_back(&border);
  }
  std::stable_sort(
      order.begin(), order.end(), [](const LeafBorder* a, const LeafBorder* b) {
        return a->open_m2 > b->open_m2;
      });
  return order;
}

// Indexed by leaf; true for the leading leaf of a set too small for a room.
std::vector<bool> FindNiches(const BuiltTree& built,
                             bool all_split,
                             LeafSets& sets) {
  std::vector<double> volume(built.leaves.size());
  std::vector<double> width(built.leaves.size());  // of the widest leaf
  for (uint32_t i = 0; i < built.leaves.size(); ++i) {
    const uint32_t set = sets.Find(i);
    volume[set] += built.leaves[i].volume_m3;
    width[set] = std::max(width[set], built.leaves[i].width_m);
  }
  std::vector<bool> niche(built.leaves.size());
  for (uint32_t i = 0; i < built.leaves.size(); ++i) {
    const bool thin = !all_split && width[i] < kDeeperThanWallM;
    niche[i] = volume[i] < (thin ? kThinNicheM3 : kNicheM3);
  }
  return niche;
}

// Joins leaves inside walls and floors that are open to each other: leaves too
// thin for a room that open to no leaf thick enough for one. Starts with the
// borders of the smallest regions, so that the leaves of a full set lie
// together. In the order of the whole tree, sets would lie within each other,
// with a thousand portals between two of them.
void JoinHollows(const BuiltTree& built,
                 const LeafBorders& borders,
                 LeafSets& sets) {
  std::vector<bool> thick(built.leaves.size());
  for (uint32_t i = 0; i < built.leaves.size(); ++i) {
    thick[i] = built.leaves[i].width_m >= kLeastRoomM;
  }
  std::vector<bool> hollow(thick);
  hollow.flip();
  for (const LeafBorder& border : borders) {
    const size_t front = border.front.Index();
    const size_t back = border.back.Index();
    hollow[front] = hollow[front] && !thick[back];
    hollow[back] = hollow[back] && !thick[front];
  }
  // A node's number is greater than those of its ancestors.
  std::for_each(
      borders.rbegin(), borders.rend(), [&](const LeafBorder& border) {
        if (hollow[border.front.Index()] && hollow[border.back.Index()]) {
          sets.Join(border.front.value, border.back.value);
        }
      });
}

// The open area between a set that is too small for a room and a neighbour.
struct NicheOpening {
  uint32_t niche = 0;
  uint32_t neighbour = 0;
  double open_m2 = 0;
};

// Lists the openings of niches by niche, then by neighbour. Each border has an
// entry of its own.
std::vector<NicheOpening> OpeningsOfNiches(const LeafBorders& borders,
                                           const std::vector<bool>& niche,
                                           LeafSets& sets) {
  std::vector<NicheOpening> openings;
  openings.reserve(2 * borders.size());
  for (const LeafBorder& border : borders) {
    const uint32_t a = sets.Find(border.front.value);
    const uint32_t b = sets.Find(border.back.value);
    if (sets.CanJoin(a, b)) {
      if (niche[a]) {
        openings.push_back({a, b, border.open_m2});
      }
      if (niche[b]) {
        openings.push_back({b, a, border.open_m2});
      }
    }
  }
  std::stable_sort(openings.begin(),
                   openings.end(),
                   [](const NicheOpening& x, const NicheOpening& y) {
                     return std::pair(x.niche, x.neighbour) <
                            std::pair(y.niche, y.neighbour);
                   });
  return openings;
}

// Finds the neighbour to which each niche opens most, and the open area; the
// first among equals. A niche that does not open has no entry.
std::vector<NicheOpening> WidestOfNiches(
    const std::vector<NicheOpening>& openings) {
  std::vector<NicheOpening> widest;
  for (size_t i = 0; i < openings.size();) {
    NicheOpening sum{openings[i].niche, openings[i].neighbour};
    for (; i < openings.size() && openings[i].niche == sum.niche &&
           openings[i].neighbour == sum.neighbour;
         ++i) {
      sum.open_m2 += openings[i].open_m2;
    }
    if (widest.empty() || widest.back().niche != sum.niche) {
      widest.push_back({sum.niche});
    }
    if (sum.open_m2 > widest.back().open_m2) {
      widest.back() = sum;
    }
  }
  std::erase_if(widest,
                [](const NicheOpening& best) { return best.open_m2 <= 0; });
  return widest;
}

// Joins each set that is too small for a room to the neighbour that it opens to
// most, of those neighbours that are not full. A niche never joins two rooms
// with each other.
bool JoinNichesOnce(const BuiltTree& built,
                    const LeafBorders& borders,
                    bool all_split,
                    LeafSets& sets) {
  ThrowIfStopRequested();
  const std::vector<NicheOpening> widest = WidestOfNiches(
      OpeningsOfNiches(borders, FindNiches(built, all_split, sets), sets));
  bool joined = false;
  std::vector<bool> taken(built.leaves.size());
  for (const NicheOpening& best : widest) {
    // A niche that was just joined by another niche waits for the next round.
    if (!taken[best.niche]) {
      joined = sets.Join(best.niche, best.neighbour) || joined;
      taken[best.neighbour] = true;
    }
  }
  return joined;
}

void JoinNiches(const BuiltTree& built,
                const LeafBorders& borders,
                bool all_split,
                LeafSets& sets) {
  while (JoinNichesOnce(built, borders, all_split, sets)) {
  }
}

// Cells are numbered in the order of their first leaves.
LeafCells NumberCells(
    LeafSets& sets,
    size_t leaf_count,
    const std::vector<std::optional<SpaceId>>& space_of_leaf) {
  LeafCells cells;
  std::map<uint32_t, CellId> cell_of_set;
  for (uint32_t leaf = 0; leaf < leaf_count; ++leaf) {
    const auto [found, is_new] =
        cell_of_set.try_emplace(sets.Find(leaf), CellId(cells.cell_count));
    if (is_new) {
      ++cells.cell_count;
      cells.space.push_back(space_of_leaf.empty() ? std::nullopt
                                                  : space_of_leaf[leaf]);
    }
    cells.cell_of_leaf.push_back(found->second);
  }
  return cells;
}

}  // namespace

// For each leaf: its set, and the arrays that find niches or number cells. For
// each border: its entry in the list of all borders or of the niches' openings,
// and as much again while the list is sorted.
uint64_t BytesToJoin(size_t leaves, size_t borders) {
  constexpr uint64_t kBytesPerLeaf = 112;
  constexpr uint64_t kBytesPerBorder =
      2 * std::max(sizeof(const LeafBorder*), 2 * sizeof(NicheOpening));
  return leaves * kBytesPerLeaf + borders * kBytesPerBorder;
}

LeafCells JoinLeaves(const JoinInput& input, const PartitionOptions& options) {
  const BuiltTree& built = input.built;
  LeafSets sets(input.survey, options.max_cell_patches);
  const bool named = !input.space_of_leaf.empty();
  const std::vector<bool> outer = FindOuterLeaves(built);
  const double open_share = input.all_split ? kAllOpenShare : kOpenShare;
  const auto is_one_room = [&](const LeafBorder& border) {
    const size_t front = border.front.Index();
    const size_t back = border.back.Index();
    if (named) {
      return input.space_of_leaf[front] == input.space_of_leaf[back];
    }
    if (outer[front] != outer[back] ||
        border.open_m2 < open_share * border.area_m2) {
      return false;
    }
    return outer[front] ||
           (!input.all_split && LooksLikeOneRoom(built, border) &&
            sets.JoinedArea(border.front.value, border.back.value) <=
                options.max_room_m2);
  };
  for (const LeafBorder* border : WidestFirst(input.borders)) {
    if (is_one_room(*border)) {
      sets.Join(border->front.value, border->back.value);
    }
  }
  if (!named) {
    if (!input.all_split) {
      JoinHollows(built, input.borders, sets);
    }
    JoinNiches(built, input.borders, input.all_split, sets);
  }
  return NumberCells(sets, built.leaves.size(), input.space_of_leaf);
}

}  // namespace enfilade
