// How many patches and covers the faces of the scene make.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "partition/bsp_builder.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// The patches and covers that the faces of the scene make, sorted into the
// tree.
struct FaceSurvey {
  // Indexed by NodeId: the bytes of the faces that lie in the node's plane, cut
  // to the node's region.
  std::vector<uint64_t> cover_bytes;
  // Indexed by LeafId: the most patches that the faces make in the leaf.
  std::vector<uint32_t> patches;
  // Indexed by LeafId: the area of those patches, m2.
  std::vector<float> area_m2;
  MemoryCharge charge;
};

// Passes over the store's faces once.
FaceSurvey SurveyFaces(const BlockStorage& store,
                       const BspTree& tree,
                       MemoryBudget& budget);

}  // namespace enfilade
