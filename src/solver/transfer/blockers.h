// The blockers between two cells, for rays and for shafts.

#pragma once

#include "solver/transfer/shaft.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// Blockers in cells that are not all in memory (paging/paged_blockers.h). The
// calls are thread-safe; each may throw DoesNotFitError.
class DistantBlockers {
 public:
  virtual ~DistantBlockers() = default;

  // Bit i of the result: one of these blockers blocks segment i, or bit i of
  // `blocked` is set.
  virtual uint32_t Occlude(const SegmentPacket& packet, uint32_t blocked) = 0;

  // Whether none of these blockers stands in the shaft.
  virtual bool LeaveEmpty(const Shaft& shaft) = 0;

  // The shadows of these blockers, as ShaftBlockers::SumOfShadows.
  virtual ShadowSum SumOfShadows(const CastShadow& shadow, uint64_t enough) = 0;

 protected:
  DistantBlockers() = default;
  DistantBlockers(const DistantBlockers&) = default;
  DistantBlockers& operator=(const DistantBlockers&) = default;
  DistantBlockers(DistantBlockers&&) = default;
  DistantBlockers& operator=(DistantBlockers&&) = default;
};

struct Blockers {
  std::vector<const RayBlockers*> rays;      // for rays
  std::vector<const ShaftBlockers*> shafts;  // for proofs and shadows
  // The portals of each of two different cells: light between the cells crosses
  // a portal of each. Empty if both are the same cell.
  std::vector<const ShaftBlockers*> gates;
  // Blockers in cells that do not fit in memory beside the others; null: none.
  DistantBlockers* distant = nullptr;

  // Bit i of the result: segment i is blocked.
  [[nodiscard]] uint32_t Occlude(const SegmentPacket& packet) const;

  // Whether no light gets from end to end because it misses all portals of one
  // cell.
  [[nodiscard]] bool Separate(const ShaftEnds& ends) const;

  // Whether nothing stands between the ends.
  [[nodiscard]] bool LeaveEmpty(const ShaftEnds& ends) const;

  // The sum of all blockers' shadows as a share of the receiver, at most
  // `most`. Overlapping shadows count more than once, so the sum may exceed the
  // share that they hide.
  [[nodiscard]] float SumOfShadows(const CastShadow& shadow, float most) const;
};

}  // namespace enfilade
