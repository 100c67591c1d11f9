// The cells that stand between a receiver and a source while their links are
// refined: all held in memory where they fit; else the two ends, and the others
// one after the other as they are met (paged_blockers.h).

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
  // `pager` and `gates` (Blockers::gates) are borrowed. Nothing is in memory
  // yet.
  CellsBetween(CellPager& pager,
               CellId receiver,
               const VisibleCell& source,
               std::vector<const ShaftBlockers*> gates);

  // Takes them into memory unless they are: after it the blockers may be asked,
  // and the pager by nobody else, until Release() or the end.
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
