// Refinement: from two cells down to the pairs of elements whose transfer is
// accurate enough to be a link.
//
//   ClusterRefiner   clusters of patches, down to the elements where refinement
//                    begins
//   ElementRefiner   two elements, down to links; has the oracle
//   GroupRefiner     an element and a group of patches that emit alike
//   LinkSink         takes the links (RawLink) and their errors
//
// A transfer whose bound is below tau_weak as a whole becomes a weak link: it
// is kept with the probability bound / tau_weak, but at least with its form
// factor bound, and is then divided by that probability. The sum of weak links
// is therefore unbiased, and their number grows with the light and not with the
// square of the number of patches. Nor does the time grow with that square: if
// the bounds of two clusters say that few of their pairs will be kept, those
// few are drawn at once.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/refine/pair_context.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/raw_links.h"
#include "solver/state/work_part.h"
#include "solver/transfer/blockers.h"

#include <cstddef>

namespace enfilade {

// Refines the transfers from one source cell to one receiver cell.
class Refiner {
 public:
  // Trees and blockers are borrowed.
  Refiner(PairWork work, const CellTree& source_tree, const Blockers& blockers);

  [[nodiscard]] size_t ItemCount() const { return pair_.work.Items().size(); }

  // Appends the links of a part of an item. Stops and sets `overflowed` if
  // there are too many links. Thread-safe: writes only to `out` and the limit's
  // counter. The links are the same however much the trees have grown since the
  // cells were balanced.
  void Refine(const WorkPart& part,
              const LinkLimit& limit,
              RawLinks* out) const;

 private:
  PairContext pair_;
};

}  // namespace enfilade
