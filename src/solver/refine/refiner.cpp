#include "solver/refine/refiner.h"

#include "solver/refine/cluster_refiner.h"
#include "solver/refine/link_sink.h"

#include <cstdint>
#include <utility>

namespace enfilade {

Refiner::Refiner(PairWork work,
                 const CellTree& source_tree,
                 const Blockers& blockers)
    : pair_(std::move(work), source_tree, blockers) {}

void Refiner::Refine(const WorkPart& part,
                     const LinkLimit& limit,
                     RawLinks* out) const {
  LinkLimit of_part = limit;
  of_part.most = part.depth < WorkPart::kMostDepth ? limit.most : SIZE_MAX;
  LinkSink sink(*pair_.blockers, of_part, out);
  const WorkItem& item = pair_.work.Items()[part.item];
  if (!item.is_drawn) {
    ClusterRefiner(pair_, part, &sink).Visit(item);
  } else if (part.part == 0) {
    // A drawn item has too few links to be cut: the first part has them all.
    ClusterRefiner(pair_, {part.item}, &sink).Draw(item);
  }
  sink.Finish();
}

}  // namespace enfilade
