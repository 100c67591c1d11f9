// Makes the links of one receiver from its sources, a pair of cells at a time.

#pragma once

#include "solver/checkpoints.h"
#include "solver/links/link_block.h"
#include "solver/links/link_store.h"
#include "solver/paging/cells_between.h"
#include "solver/receiver_cell.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/refiner.h"
#include "solver/refine/source_weights.h"
#include "solver/solve_context.h"
#include "visibility/visible_set.h"

#include <cstddef>
#include <memory>

namespace enfilade {

class PairRefinement {
 public:
  PairRefinement(SolveContext& context,
                 Checkpoints& checkpoints,
                 ReceiverCell& receiver)
      : context_(&context), checkpoints_(&checkpoints), receiver_(&receiver) {}

  // Makes what is left of the links from `source` by the state's cursor, and
  // gathers over them. Commits may fall in between.
  void Refine(const VisibleCell& source);

 private:
  // A source cell while links from it are made.
  struct SourceCell {
    CellId id;
    std::shared_ptr<const CellGeometry> geometry;
    std::shared_ptr<CellTree> tree;
  };

  // Removes all links of the receiver from the source.
  void Unlink(CellId source);
  [[nodiscard]] PairWork WorkOf(const SourceCell& s,
                                const VisibleCell& source,
                                const SourceWeights& weights) const;
  void WriteLinks(const SourceCell& s,
                  const Refiner& refiner,
                  CellsBetween* between,
                  LinkWriter* writer);
  void ApplyPart(const RawLinks& part, const SourceCell& s, LinkBlock* block);
  void GatherNew(const SourceCell& s, const LinkBlock& links);
  [[nodiscard]] double ShareOfTurn(size_t items) const;

  SolveContext* context_;
  Checkpoints* checkpoints_;
  ReceiverCell* receiver_;
};

}  // namespace enfilade
