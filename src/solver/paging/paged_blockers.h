// What stands in cells that do not fit in memory at once: each is paged in when
// a ray or a shaft meets its box. Slower than to hold them all, with the same
// answers.

#pragma once

#include "base/ids.h"
#include "base/vec.h"
#include "solver/elements/geometry.h"
#include "solver/paging/cell_pager.h"
#include "solver/transfer/blockers.h"
#include "solver/transfer/shaft.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <mutex>
#include <vector>

namespace enfilade {

class PagedBlockers : public DistantBlockers {
 public:
  explicit PagedBlockers(CellPager& pager) : pager_(&pager) {}

  // Which cells they are; the pager must know them.
  void Assign(const std::vector<CellId>& cells);

  // Thread-safe while nobody else asks the pager; one thread at a time, so that
  // one cell at a time must be in memory. DoesNotFitError if there is no room
  // for a cell.
  uint32_t Occlude(const SegmentPacket& packet, uint32_t blocked) override;
  bool LeaveEmpty(const Shaft& shaft) override;
  ShadowSum SumOfShadows(const CastShadow& shadow, uint64_t enough) override;

 private:
  struct Cell {
    CellId id;
    Box box;  // of all that stands in it
  };

  CellPager* pager_;
  std::vector<Cell> cells_;
  std::mutex mutex_;
};

}  // namespace enfilade
