// Makes the links of one receiver from its sources, a pair of cells at a time.

#pragma once

#include "solver/checkpoints.h"
#include "solver/links/link_block.h"
#include "solver/links/link_store.h"
#include "solver/paging/cells_between.h"
#include "solver/pairs_ahead.h"
#include "solver/receiver_cell.h"
#include "solver/refine/raw_links.h"
#include "solver/refine/refiner.h"
#include "solver/solve_context.h"
#include "solver/source_cell.h"
#include "visibility/visible_set.h"

#include <cstddef>
#include <vector>

namespace enfilade {

class PairRefinement {
 public:
  PairRefinement(SolveContext& context,
                 Checkpoints& checkpoints,
                 ReceiverCell& receiver)
      : context_(&context),
        checkpoints_(&checkpoints),
        receiver_(&receiver),
        ahead_(context, receiver) {}

  // Makes what is left of the links from the source at the state's cursor, and
  // gathers over them. Commits may fall in between.
  void Refine();

 private:
  // Removes all links of the receiver from the source.
  void Unlink(CellId source);
  void RefineAlone(const VisibleCell& source);
  void WriteAll(const std::vector<RawLinks>& parts, const VisibleCell& source);
  [[nodiscard]] LinkWriter WriterOf(const SourceCell& s);
  void Count(const RawLinks& part);
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
  PairsAhead ahead_;
};

}  // namespace enfilade
