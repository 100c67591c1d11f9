#include "solver/pair_refinement.h"

#include "base/stopwatch.h"
#include "solver/links/gather.h"
#include "solver/refine/apply_links.h"
#include "solver/refine/refined_parts.h"

#include <utility>

namespace enfilade {
namespace {

// tau_weak over tau: docs/decisions/0011-oracle.md.
constexpr double kWeakShare = 0.5;

}  // namespace

void PairRefinement::Unlink(CellId source) {
  context_->store.EraseAll(
      BlockKind::kLinks, receiver_->id.value, source.value);
  context_->pager.Pairs().SetLinked(receiver_->id, source, false);
}

void PairRefinement::Refine(const VisibleCell& source) {
  CellPager& pager = context_->pager;
  if (!context_->IsLit(source.source)) {
    Unlink(source.source);
    return;
  }
  pager.Order().MoveTo(receiver_->id, source.source);
  SourceCell s{source.source, pager.Geometry(source.source), nullptr};
  const auto weights = pager.Weights(s.id);
  PairWork work = WorkOf(s, source, *weights);
  if (work.Items().empty()) {
    Unlink(s.id);
    return;
  }
  s.tree = pager.Tree(s.id);
  std::vector<const ShaftBlockers*> gates;
  if (s.id != receiver_->id) {
    gates = {receiver_->geometry->portals.get(), s.geometry->portals.get()};
  }
  CellsBetween between(pager, receiver_->id, source, gates);
  const Refiner refiner(std::move(work), *s.tree, between.All());
  LinkWriter writer(context_->store,
                    context_->chunks,
                    {receiver_->id, s.id},
                    context_->state.cursor.chunk,
                    [&](const LinkBlock& links) { GatherNew(s, links); });
  WriteLinks(s, refiner, &between, &writer);
  pager.Pairs().SetLinked(receiver_->id, s.id, writer.Chunks() > 0);
}

PairWork PairRefinement::WorkOf(const SourceCell& s,
                                const VisibleCell& source,
                                const SourceWeights& weights) const {
  RefineOptions options;
  options.tau = context_->state.tau;
  options.tau_weak = kWeakShare * context_->state.tau;
  options.seed = context_->SeedOfRound();
  options.counts_black = context_->surface.is_black;
  return {options,
          {.id = receiver_->id,
           .part = context_->pager.BoxOf(receiver_->id, source.of_receiver),
           .patches = receiver_->geometry->patches,
           .clusters = receiver_->receivers.get(),
           .care = receiver_->care,
           .least_reflectance = context_->surface.least_reflectance,
           .weights = receiver_->weights},
          {.id = s.id,
           .part = context_->pager.BoxOf(s.id, source.of_source),
           .patches = s.geometry->patches,
           .clusters = s.geometry->clusters.get(),
           .groups = &s.geometry->groups,
           .sent = &weights}};
}

// Refines what is left of the pair's work, then applies and writes the links in
// the order of the work. A commit may follow each chunk of links.
void PairRefinement::WriteLinks(const SourceCell& s,
                                const Refiner& refiner,
                                CellsBetween* between,
                                LinkWriter* writer) {
  SolveState& state = context_->state;
  RefinedParts parts(refiner, state.cursor.work);
  while (!parts.AtEnd()) {
    context_->pager.Items().HoldResident();
    between->Hold();
    {
      const Stopwatch watch(&state.times.refine_seconds);
      parts.Refine();
    }
    while (const RawLinks* links = parts.Front()) {
      if (!links->links.empty()) {
        between->Release();  // the trees may need its room
      }
      ApplyPart(*links, s, &writer->Pending());
      parts.Pop();
      state.cursor.work = parts.Next();
      checkpoints_->SetShareOfTurn(ShareOfTurn(refiner.ItemCount()));
      if (writer->Full()) {
        writer->Flush();
        state.cursor.chunk = writer->Chunks();
        checkpoints_->Pass();
      } else if (writer->Pending().links.empty()) {
        // Cells that hide each other make no links for long.
        between->Release();
        checkpoints_->Pass();
      }
    }
  }
  writer->Flush();
}

double PairRefinement::ShareOfTurn(size_t items) const {
  const PairCursor& cursor = context_->state.cursor;
  return (static_cast<double>(cursor.source) +
          static_cast<double>(cursor.work.item) / static_cast<double>(items)) /
         static_cast<double>(receiver_->sources.size() + 1);  // 1: the balance
}

// Appends the part's links to the block, makes the elements that they name, and
// adds to the error, ray and link counts.
void PairRefinement::ApplyPart(const RawLinks& part,
                               const SourceCell& s,
                               LinkBlock* block) {
  SolveState& state = context_->state;
  state.cells[receiver_->id.Index()].squared_error += part.squared_error;
  state.rays += part.rays;
  if (part.links.empty()) {
    return;
  }
  ApplyLinks(part,
             {receiver_->geometry->patches, receiver_->tree.get()},
             {s.geometry->patches, s.tree.get()},
             receiver_->received.get(),
             block);
  context_->pager.MarkDirty(receiver_->id);
  context_->pager.MarkReceivedDirty(receiver_->id);
  context_->pager.MarkDirty(s.id);
  for (const RawLink& link : part.links) {
    ++receiver_->care[link.receiver_patch].links;
  }
}

// Gathers over new links before they are written to the store.
void PairRefinement::GatherNew(const SourceCell& s, const LinkBlock& links) {
  SolveState& state = context_->state;
  const Stopwatch watch(&state.times.gather_seconds);
  Gather(links,
         {receiver_->geometry->patches, receiver_->tree.get(), nullptr},
         SourceSide(*s.geometry, *s.tree),
         s.tree->Sent(),
         receiver_->received->gathered);
  state.cells[receiver_->id.Index()].links += links.links.size();
}

}  // namespace enfilade
