// The blockers of cells that do not fit in memory at once: a cell is paged in
// when a ray or a shaft meets its box. PagedBlockers gives the same answers as
// holding all cells, but more slowly.

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

  // Sets the cells; the pager must know them.
  void Assign(const std::vector<CellId>& cells);

  // Thread-safe while nobody else asks the pager. Only one thread at a time
  // uses the pager, so only one cell at a time must be in memory. Throws
  // DoesNotFitError if there is no room for a cell.
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
