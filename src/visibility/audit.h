// The audit of the visible sets: rays from random points of the building to
// what they hit, and no pair of cells that a ray joins may be missing, nor may
// a ray meet a part of one that the other is said not to see.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

// A ray that joins two cells whose pair the visible sets lack, or parts of them
// that the sets leave out.
struct MissedPair {
  CellId origin;
  CellId target;
  Point3 from;
  Point3 to;
};

struct AuditSummary {
  uint64_t audit_rays = 0;
  uint64_t audit_missed = 0;  // rays that join what the sets lack
  // Rays that came through no opening: they hit a patch from behind, joined a
  // missing pair that not all of four rays beside them, 0.1 mm away, join, or
  // left or met a patch where its cell is thinner than that. Rays from under a
  // surface that lies on another are none, nor those that meet the black back
  // of a luminaire.
  uint64_t audit_leaks = 0;
  uint64_t conservative_pairs = 0;  // ordered, as VisibilitySummary counts
  uint64_t sampled_pairs = 0;       // ordered: that a ray joined, either way
  std::vector<MissedPair> first_missed;  // at most ten
};

// Shoots `rays` rays from points on patches: half of them evenly over the
// cells, half evenly over the area; by turns in cosine and in uniform
// distribution about the normal. The store must hold visible sets and trace
// chunks. The result depends on the store and `rays` alone. `progress` gets
// the fraction done and may be empty.
AuditSummary Audit(const BlockStorage& store,
                   uint64_t rays,
                   MemoryBudget& budget,
                   const std::function<void(double fraction)>& progress);

}  // namespace enfilade
