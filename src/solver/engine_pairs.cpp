// The part of the engine that works on one cell pair.

#include "base/random.h"
#include "base/stopwatch.h"
#include "solver/engine.h"
#include "solver/links/gather.h"
#include "solver/paging/cells_between.h"
#include "solver/refine/apply_links.h"
#include "solver/refine/refined_parts.h"

#include <utility>

namespace enfilade {
namespace {

// tau_weak over tau: docs/decisions/0011-oracle.md.
constexpr double kWeakShare = 0.5;

GatherSide SourceSide(const CellGeometry& geometry, const CellTree& tree) {
  return {geometry.patches, &tree, &geometry.groups};
}

}  // namespace

// Removes all links of the receiver from the source.
void Engine::Unlink(const Receiver& r, CellId source) {
  store_->EraseAll(BlockKind::kLinks, r.id.value, source.value);
  pager_.Order().SetLinked(r.id, source, false);
}

void Engine::RefinePair(const Receiver& r, const VisibleCell& source) {
  if (!IsLit(source.source)) {
    Unlink(r, source.source);
    return;
  }
  pager_.Order().MoveTo(r.id, source.source);
  Sender s{source.source, pager_.Geometry(source.source), nullptr};
  const auto weights = pager_.Weights(s.id);
  PairWork work = WorkOf(r, s, source, *weights);
  if (work.Items().empty()) {
    Unlink(r, s.id);
    return;
  }
  s.tree = pager_.Tree(s.id);
  std::vector<const ShaftBlockers*> gates;
  if (s.id != r.id) {
    gates = {r.geometry->portals.get(), s.geometry->portals.get()};
  }
  CellsBetween between(pager_, r.id, source, gates);
  const Refiner refiner(std::move(work), *s.tree, between.All());
  LinkWriter writer(*store_,
                    chunks_,
                    {r.id, s.id},
                    state_.cursor.chunk,
                    [&](const LinkBlock& links) { GatherNew(r, s, links); });
  WriteLinks(r, s, refiner, &between, &writer);
  pager_.Order().SetLinked(r.id, s.id, writer.Chunks() > 0);
}

PairWork Engine::WorkOf(const Receiver& r,
                        const Sender& s,
                        const VisibleCell& source,
                        const SourceWeights& weights) {
  RefineOptions options;
  options.tau = state_.tau;
  options.tau_weak = kWeakShare * state_.tau;
  options.seed = MixKey(state_.seed, state_.round);
  options.counts_black = is_black_;
  return {options,
          {.id = r.id,
           .part = pager_.BoxOf(r.id, source.of_receiver),
           .patches = r.geometry->patches,
           .tree = r.tree.get(),
           .clusters = r.receivers.get(),
           .care = care_,
           .least_reflectance = least_reflectance_,
           .weights = r.weights},
          {.id = s.id,
           .part = pager_.BoxOf(s.id, source.of_source),
           .patches = s.geometry->patches,
           .clusters = s.geometry->clusters.get(),
           .groups = &s.geometry->groups,
           .sent = &weights}};
}

// Refines what is left of the pair's work, then applies and writes the links in
// the order of the work. A commit may follow each chunk of links.
void Engine::WriteLinks(const Receiver& r,
                        const Sender& s,
                        const Refiner& refiner,
                        CellsBetween* between,
                        LinkWriter* writer) {
  RefinedParts parts(refiner, state_.cursor.work);
  while (!parts.AtEnd()) {
    pager_.HoldResident();
    between->Hold();
    {
      const Stopwatch watch(&state_.times.refine_seconds);
      parts.Refine();
    }
    while (const RawLinks* links = parts.Front()) {
      if (!links->links.empty()) {
        between->Release();  // the trees may need its room
      }
      ApplyPart(*links, r, s, &writer->Pending());
      parts.Pop();
      state_.cursor.work = parts.Next();
      share_of_cell_ = ShareOfCell(r, refiner.ItemCount());
      if (writer->Full()) {
        writer->Flush();
        state_.cursor.chunk = writer->Chunks();
        CheckPoint();
      } else if (writer->Pending().links.empty()) {
        // Cells that hide each other make no links for long.
        between->Release();
        CheckPoint();
      }
    }
  }
  writer->Flush();
}

double Engine::ShareOfCell(const Receiver& r, size_t items) const {
  return (static_cast<double>(state_.cursor.source) +
          static_cast<double>(state_.cursor.work.item) /
              static_cast<double>(items)) /
         static_cast<double>(r.sources.size() + 1);  // + 1: the balance
}

// Gathers over new links before they are written to the store.
void Engine::GatherNew(const Receiver& r,
                       const Sender& s,
                       const LinkBlock& links) {
  const Stopwatch watch(&state_.times.gather_seconds);
  Gather(links,
         {r.geometry->patches, r.tree.get(), nullptr},
         SourceSide(*s.geometry, *s.tree),
         s.tree->Sent(),
         r.received->gathered);
  state_.cells[r.id.Index()].links += links.links.size();
}

// Appends the part's links to the block, makes the elements that they name, and
// adds to the error, ray and link counts.
void Engine::ApplyPart(const RawLinks& part,
                       const Receiver& r,
                       const Sender& s,
                       LinkBlock* block) {
  state_.cells[r.id.Index()].squared_error += part.squared_error;
  state_.rays += part.rays;
  if (part.links.empty()) {
    return;
  }
  ApplyLinks(part,
             {r.geometry->patches, r.tree.get()},
             {s.geometry->patches, s.tree.get()},
             r.received.get(),
             block);
  pager_.MarkDirty(r.id);
  pager_.MarkReceivedDirty(r.id);
  pager_.MarkDirty(s.id);
  for (const RawLink& link : part.links) {
    ++care_[link.receiver_patch].links;
  }
}

void Engine::GatherPair(const Receiver& r, CellId source) {
  // Half of all visible pairs have no links, and reading a tree for nothing is
  // expensive: docs/decisions/schedules.md.
  if (!pager_.Order().IsLinked(r.id, source)) {
    return;
  }
  pager_.Order().MoveTo(r.id, source);
  const auto geometry = pager_.Geometry(source);
  const auto tree = pager_.Elements(source);
  const auto delta = pager_.Delta(source);
  if (delta->Size() == 0) {
    return;
  }
  const Stopwatch watch(&state_.times.gather_seconds);
  pager_.VisitLinks(
      {r.id, source},
      {r.tree->Size(), tree->Size(), geometry->groups.All().size()},
      [&](const LinkBlock& block) {
        Gather(block,
               {r.geometry->patches, r.tree.get(), nullptr},
               SourceSide(*geometry, *tree),
               *delta,
               r.received->gathered);
      });
  pager_.MarkReceivedDirty(r.id);
}

}  // namespace enfilade
