// The audit of the visible sets. It shoots rays from random points on the
// building's patches. Two cells that a ray joins must be a pair of the visible
// sets, and the ends of the ray must lie in the parts of the two cells that the
// sets say are visible.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

// A ray that joins two cells whose pair the visible sets lack, or whose ends
// lie outside the parts of the two cells that the sets list.
struct MissedPair {
  CellId origin;
  CellId target;
  Point3 from;
  Point3 to;
};

struct AuditSummary {
  uint64_t audit_rays = 0;
  uint64_t audit_missed = 0;  // rays that join what the sets lack
  // Rays that came through no opening. Such a ray hits a patch from behind, or
  // joins a missing pair that not all of four rays 0.1 mm beside it join, or
  // leaves or meets a patch where the patch's cell is thinner than 0.1 mm. A
  // ray that hits the black back of a luminaire is not a leak, nor is one that
  // starts under a surface that lies on another.
  uint64_t audit_leaks = 0;
  uint64_t conservative_pairs = 0;       // ordered, as VisibilitySummary counts
  uint64_t sampled_pairs = 0;            // ordered: joined by a ray either way
  std::vector<MissedPair> first_missed;  // at most ten
};

// Shoots `rays` rays from points on patches. Half of the rays are spread evenly
// over the cells, half evenly over the area. The directions alternate between a
// cosine and a uniform distribution about the normal. The store must hold
// visible sets and trace chunks. The result depends on the store and `rays`
// alone. `progress` gets the fraction done and may be empty.
AuditSummary Audit(const BlockStorage& store,
                   uint64_t rays,
                   MemoryBudget& budget,
                   const std::function<void(double fraction)>& progress);

}  // namespace enfilade
