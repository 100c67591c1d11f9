// How the leaves of the tree border on each other, and where the border is
// open.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "partition/bsp_builder.h"
#include "partition/scratch_list.h"

#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

namespace enfilade {

// What the faces of the scene come to, sorted into the tree.
struct FaceSurvey {
  // Indexed by NodeId: what the faces take that lie in the node's plane, cut to
  // it.
  std::vector<uint64_t> cover_bytes;
  // Indexed by LeafId: the patches that the faces make in the leaf, at most.
  std::vector<uint32_t> patches;
  // Indexed by LeafId: their area, m2.
  std::vector<float> area_m2;
  MemoryCharge charge;
};

// One pass over the store's faces.
FaceSurvey SurveyFaces(const BlockStorage& store,
                       const BspTree& tree,
                       MemoryBudget& budget);

// The common border of two leaves, which lies in the plane of one node.
struct LeafBorder {
  LeafId front;
  LeafId back;
  NodeId node;
  double area_m2 = 0;
  double front_m = 0;  // how deep each leaf is, square to the plane
  double back_m = 0;
  double open_m2 = 0;  // at most area_m2
};

// In a deque: a vector would take thrice as much while it grows.
using LeafBorders = std::deque<LeafBorder>;

// The borders that are open somewhere, in the order of their nodes, and their
// openings, of which all need not fit into memory.
class OpenBorders {
 public:
  explicit OpenBorders(ScratchShelf& shelf) : openings_(shelf) {}

  [[nodiscard]] const LeafBorders& All() const { return borders_; }

  // In memory.
  [[nodiscard]] uint64_t Bytes() const {
    return borders_.size() * sizeof(LeafBorder);
  }

  // What the openings in one node's plane take, at most.
  [[nodiscard]] uint64_t MostBytesOfNode() const { return most_node_bytes_; }

  // Sums up their area.
  void Add(LeafBorder border, const std::vector<Polygon>& open);

  // Convex, facing the plane's front; in the order of the borders.
  void ForEachOpening(
      const std::function<void(const LeafBorder&, Polygon)>& visit) const;

 private:
  LeafBorders borders_;
  ScratchList openings_;
  uint64_t node_bytes_ = 0;  // of the last border's node
  uint64_t most_node_bytes_ = 0;
};

// Finds all of them; what they take is charged as they are found. Passes over
// the store's faces once for as many nodes as those that lie in their planes
// fit into a part of what is free. Conservative: a point of a border is no
// opening only if faces in the plane cover it, cracks of less than kCrackM
// closed.
OpenBorders FindOpenBorders(const BlockStorage& store,
                            const BuiltTree& built,
                            const FaceSurvey& survey,
                            ScratchShelf& shelf,
                            MemoryBudget& budget,
                            GrowingCharge& charge);

}  // namespace enfilade
