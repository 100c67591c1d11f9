#include "solver/paging/cells_between.h"

#include <utility>

namespace enfilade {

CellsBetween::CellsBetween(CellPager& pager,
                           CellId receiver,
                           const VisibleCell& source,
                           std::vector<const ShaftBlockers*> gates)
    : pager_(&pager), all_(source.between), paged_(pager) {
  for (const CellId cell : all_) {
    const bool is_end = cell == receiver || cell == source.source;
    (is_end ? ends_ : inner_).push_back(cell);
  }
  paged_.Assign(inner_);
  blockers_.gates = std::move(gates);
}

void CellsBetween::Pin(CellId cell) {
  const auto both = pager_->BlockersOf(cell);
  pins_.push_back(both.shafts);
  blockers_.shafts.push_back(both.shafts.get());
  pins_.push_back(both.rays);
  blockers_.rays.push_back(both.rays.get());
}

void CellsBetween::Hold() {
  if (!pins_.empty()) {
    return;
  }
  is_paged_ = is_paged_ || !pager_->CanHoldBlockers(all_);
  blockers_.distant = is_paged_ ? &paged_ : nullptr;
  for (const CellId cell : is_paged_ ? ends_ : all_) {
    Pin(cell);
  }
}

void CellsBetween::Release() {
  blockers_.shafts.clear();
  blockers_.rays.clear();
  pins_.clear();
}

}  // namespace enfilade
