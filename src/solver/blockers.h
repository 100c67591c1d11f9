// What stands between two cells, for rays and for shafts.

#pragma once

#include "solver/shaft.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <vector>

namespace enfilade {

class PagedBlockers;

struct Blockers {
  std::vector<const CellBlockers*> occluders;  // for rays
  std::vector<const ShaftBlockers*> shafts;    // for proofs, and shadows
  // The portals of two different cells: light between them must cross one of
  // each. Empty within a cell.
  std::vector<const ShaftBlockers*> gates;
  // Cells that do not fit in memory beside the others; null: none.
  PagedBlockers* paged = nullptr;

  // Bit i of the result: segment i is blocked.
  [[nodiscard]] uint32_t Occlude(const SegmentPacket& packet) const;

  // No light crosses the shaft: it misses the portals of one of the cells.
  [[nodiscard]] bool Separate(const Shaft& shaft) const;

  // Nothing stands in the shaft.
  [[nodiscard]] bool LeaveEmpty(const Shaft& shaft) const;

  // The shadows of all that stands there, added up, at most `most`: a share of
  // the receiver. Where they overlap, more than they hide.
  [[nodiscard]] float SumOfShadows(const CastShadow& shadow, float most) const;
};

}  // namespace enfilade
