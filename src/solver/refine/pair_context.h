// What all parts of refinement know of a pair of cells. Refinement changes
// nothing of it.

#pragma once

#include "solver/elements/basis.h"
#include "solver/elements/element_tree.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/receiver_element.h"
#include "solver/refine/refine_options.h"
#include "solver/refine/refine_receiver.h"
#include "solver/refine/refine_source.h"
#include "solver/refine/source_elements.h"
#include "solver/transfer/blockers.h"
#include "solver/transfer/form_factor.h"

namespace enfilade {

struct PairContext {
  // The tree and the blockers are borrowed.
  PairContext(PairWork work_of_pair,
              const CellTree& source_tree,
              const Blockers& between);

  PairWork work;
  SourceElements sources;
  const Blockers* blockers;
  const Basis* basis;
  float tau;       // W/m: RefineOptions, in single precision
  float tau_weak;  // likewise
  float shadows;   // weight of unknown occlusion, by order
  bool constant_basis;
  bool is_partial;  // the cells see only parts of each other

  [[nodiscard]] const RefineReceiver& Receiver() const {
    return work.Receiver();
  }

  [[nodiscard]] const RefineSource& Source() const { return work.Source(); }

  // Whether both elements reach into the parts of their cells that see the
  // other cell.
  [[nodiscard]] bool MaySee(const TransferEnd& receiver,
                            const TransferEnd& source) const {
    return !is_partial || (ReachesInto(receiver, Receiver().part) &&
                           ReachesInto(source, Source().part));
  }

  [[nodiscard]] bool CanSplit(const TransferEnd& end, ElementPath path) const {
    return end.diameter > work.Options().least_diameter && !IsDeepest(path);
  }

  // What a weighted error adds to the error of the solution: the error without
  // the receiver's care, and by what the receiver reflects, which is less than
  // its weight says if it is dark. If RefineOptions::counts_black is set, all
  // count as their weights say.
  [[nodiscard]] float TrueError(const ReceiverElement& r, float weighted) const;
};

}  // namespace enfilade
