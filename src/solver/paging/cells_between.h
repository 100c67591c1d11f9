// The cells between a receiver and a source while their links are refined. If
// all of them fit in memory, all are held. Otherwise only the two ends are
// held, and the others are paged in one after the other as rays and shafts meet
// them (paged_blockers.h).

#pragma once

#include "base/ids.h"
#include "solver/paging/cell_pager.h"
#include "solver/paging/paged_blockers.h"
#include "solver/transfer/blockers.h"
#include "visibility/visible_set.h"

#include <memory>
#include <vector>

namespace enfilade {

class CellsBetween {
 public:
  // `pager` and `gates` (Blockers::gates) are borrowed. The constructor takes
  // nothing into memory.
  CellsBetween(CellPager& pager,
               CellId receiver,
               const VisibleCell& source,
               std::vector<const ShaftBlockers*> gates);

  // Takes the cells into memory unless they are there. Until Release() or the
  // end of this object, the blockers may be asked, and nobody else may ask the
  // pager.
  void Hold();
  void Release();

  [[nodiscard]] const Blockers& All() const { return blockers_; }

 private:
  void Pin(CellId cell);

  CellPager* pager_;
  std::vector<CellId> all_;
  std::vector<CellId> ends_;
  std::vector<CellId> inner_;  // all but the ends
  bool is_paged_ = false;
  PagedBlockers paged_;
  std::vector<std::shared_ptr<const void>> pins_;
  Blockers blockers_;
};

}  // namespace enfilade
