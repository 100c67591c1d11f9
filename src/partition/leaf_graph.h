// How the leaves of the tree border on each other, and where the border is
// open.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "partition/bsp_builder.h"

#include <cstdint>
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
  double open_m2 = 0;         // at most area_m2
  std::vector<Polygon> open;  // convex, facing the plane's front
};

// What they take in memory.
uint64_t BytesOf(const std::vector<LeafBorder>& borders);

// All borders that are open somewhere, in the order of their nodes; what they
// take is charged as they are found. Passes over the store's faces once for as
// many nodes as those that lie in their planes fit into a part of what is free.
// Conservative: a point of the border is left out of `open` only if faces in
// the plane cover it, cracks of less than kCrackM closed.
std::vector<LeafBorder> FindOpenBorders(const BlockStorage& store,
                                        const BuiltTree& built,
                                        const FaceSurvey& survey,
                                        MemoryBudget& budget,
                                        GrowingCharge& charge);

}  // namespace enfilade
