// Refines pairs of cells ahead of their turn. Most pairs of a large building
// have so little work that to wake another thread for one of them takes longer
// than the work, so one thread would do nearly all pairs alone. Their links
// depend on nothing that the pairs before them change, and are therefore made
// for many pairs together and kept until each pair has its turn.
//
// This costs no memory but for the links that wait: of what pairs need, nothing
// is paged in that is not in memory already. Pairs of which something is not,
// and those with much work, are left to be refined alone. The bits are the same
// either way.

#pragma once

#include "solver/receiver_cell.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/raw_links.h"
#include "solver/refine/refiner.h"
#include "solver/solve_context.h"
#include "solver/source_cell.h"
#include "solver/transfer/blockers.h"

#include <atomic>
#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace enfilade {

class PairsAhead {
 public:
  // Of the receiver, all but the trees must stay as it is.
  PairsAhead(SolveContext& context, const ReceiverCell& receiver)
      : context_(&context), receiver_(&receiver) {}

  // The links of the pair with a source, by its index in the receiver's
  // sources: one entry for each item of its work, none if there is no work.
  // nullopt if the pair must be refined alone. Nothing of this pair or of later
  // ones may be in use. Sources are asked for once each, in ascending order.
  std::optional<std::vector<RawLinks>> TakeLinks(size_t source);

  // The items of the pair's work, if they are known.
  std::optional<std::vector<WorkItem>> TakeItems(size_t source);

 private:
  // A pair in the window.
  struct Pair {
    std::optional<std::vector<WorkItem>> items;
    bool is_refined = false;
    std::vector<RawLinks> links;  // by item
  };

  // A pair that is being refined.
  struct Refining {
    Refining(SourceCell of_source, size_t in_window)
        : source(std::move(of_source)), pair(in_window) {}

    SourceCell source;
    size_t pair;
    Blockers blockers;
    std::optional<Refiner> refiner;
    std::vector<RawLinks> links;  // by item
    std::atomic<size_t> done = 0;
  };

  using HeldBlockers = std::map<CellId, CellPager::CellBlockers>;

  [[nodiscard]] const VisibleCell& Seen(size_t pair) const {
    return receiver_->sources[first_ + pair];
  }

  static bool HasLittleWork(const Pair& pair);
  [[nodiscard]] bool IsInMemory(ItemKind kind, CellId cell) const;
  [[nodiscard]] bool KnowsItems(size_t source) const;
  void FindItems(size_t first);
  void RefineFrom(size_t first);
  // `pair` is an index into the window.
  [[nodiscard]] bool CanBeRefined(size_t pair) const;
  [[nodiscard]] bool Hold(Refining* pair, HeldBlockers* held);
  void RefineTogether(std::deque<Refining>* pairs);

  SolveContext* context_;
  const ReceiverCell* receiver_;
  size_t first_ = 0;  // index of the window's first source
  std::vector<Pair> window_;
};

}  // namespace enfilade
