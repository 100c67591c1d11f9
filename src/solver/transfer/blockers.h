// What stands between two cells, for rays and for shafts.

#pragma once

#include "solver/transfer/shaft.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// What stands in cells that are not all in memory (paging/paged_blockers.h).
// The calls are thread-safe; each may throw DoesNotFitError.
class DistantBlockers {
 public:
  virtual ~DistantBlockers() = default;

  // Bit i of the result: segment i is blocked by what is there, or bit i of
  // `blocked` is set.
  virtual uint32_t Occlude(const SegmentPacket& packet, uint32_t blocked) = 0;

  // Nothing that is there stands in the shaft.
  virtual bool LeaveEmpty(const Shaft& shaft) = 0;

  // The shadows of what is there, as of ShaftBlockers.
  virtual ShadowSum SumOfShadows(const CastShadow& shadow, uint64_t enough) = 0;

 protected:
  DistantBlockers() = default;
  DistantBlockers(const DistantBlockers&) = default;
  DistantBlockers& operator=(const DistantBlockers&) = default;
  DistantBlockers(DistantBlockers&&) = default;
  DistantBlockers& operator=(DistantBlockers&&) = default;
};

struct Blockers {
  std::vector<const CellBlockers*> occluders;  // for rays
  std::vector<const ShaftBlockers*> shafts;    // for proofs, and shadows
  // The portals of two different cells: light between them must cross one of
  // each. Empty within a cell.
  std::vector<const ShaftBlockers*> gates;
  // Cells that do not fit in memory beside the others; null: none.
  DistantBlockers* distant = nullptr;

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
