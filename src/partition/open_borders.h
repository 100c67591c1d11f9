// How the leaves of the tree border on each other, and where the border is
// open.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "partition/bsp_builder.h"
#include "partition/face_survey.h"
#include "partition/scratch_list.h"

#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

namespace enfilade {

// The common border of two leaves, which lies in the plane of one node.
struct LeafBorder {
  LeafId front;
  LeafId back;
  NodeId node;
  double area_m2 = 0;
  // The depth of each leaf, perpendicular to the plane.
  double front_m = 0;
  double back_m = 0;
  double open_m2 = 0;  // at most area_m2
};

// A deque, because a growing vector would take thrice as much memory.
using LeafBorders = std::deque<LeafBorder>;

// The borders that are open somewhere, in the order of their nodes, and their
// openings. The openings need not all fit into memory.
class OpenBorders {
 public:
  explicit OpenBorders(ScratchShelf& shelf) : openings_(shelf) {}

  [[nodiscard]] const LeafBorders& All() const { return borders_; }

  // The memory that the borders take.
  [[nodiscard]] uint64_t Bytes() const {
    return borders_.size() * sizeof(LeafBorder);
  }

  // The most memory that the openings in one node's plane take.
  [[nodiscard]] uint64_t MostBytesOfNode() const { return most_node_bytes_; }

  // Adds a border with its openings and sums their area into the border's
  // open_m2.
  void Add(LeafBorder border, const std::vector<Polygon>& open);

  // Visits the openings in the order of their borders. Each one is a convex
  // polygon that faces the front of the node's plane.
  void ForEachOpening(
      const std::function<void(const LeafBorder&, Polygon)>& visit) const;

 private:
  LeafBorders borders_;
  ScratchList openings_;
  uint64_t node_bytes_ = 0;  // of the openings of the last border's node
  uint64_t most_node_bytes_ = 0;
};

// What borders are found from.
struct BorderInput {
  const BlockStorage& store;
  const BuiltTree& built;
  const FaceSurvey& survey;
  double oblique_crack_m;
};

// Finds all open borders and charges their memory as it finds them. Takes the
// nodes in batches whose covers fit into a part of the free budget, and passes
// over the store's faces once per batch. Conservative: a point of a border
// counts as closed only if faces in the plane cover it or a crack contains it
// that is narrower than kCrackM, or than `oblique_crack_m` if no axis leads
// across it.
OpenBorders FindOpenBorders(const BorderInput& input,
                            ScratchShelf& shelf,
                            MemoryBudget& budget,
                            GrowingCharge& charge);

}  // namespace enfilade
