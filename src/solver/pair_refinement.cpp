#include "solver/pair_refinement.h"

#include "base/stopwatch.h"
#include "solver/links/gather.h"
#include "solver/refine/apply_links.h"
#include "solver/refine/refined_parts.h"

#include <algorithm>
#include <utility>

namespace enfilade {

void PairRefinement::Unlink(CellId source) {
  PairTable& pairs = context_->pager.Pairs();
  if (pairs.IsLinked(receiver_->id, source)) {
    context_->store.EraseAll(
        BlockKind::kLinks, receiver_->id.value, source.value);
    pairs.SetLinked(receiver_->id, source, false);
  }
}

void PairRefinement::Refine() {
  const PairCursor& cursor = context_->state.cursor;
  const VisibleCell& source = receiver_->sources[cursor.source];
  if (!context_->IsLit(source.source)) {
    Unlink(source.source);
    return;
  }
  if (cursor.work == WorkPart{}) {
    if (const auto links = ahead_.TakeLinks(cursor.source)) {
      WriteAll(*links, source);
      return;
    }
  }
  RefineAlone(source);
}

void PairRefinement::RefineAlone(const VisibleCell& source) {
  CellPager& pager = context_->pager;
  auto items = ahead_.TakeItems(context_->state.cursor.source);
  pager.Order().MoveTo(receiver_->id, source.source);
  SourceCell s(*context_, source.source);
  PairWork work =
      items ? WorkBetween(*context_, *receiver_, s, source, std::move(*items))
            : WorkBetween(*context_, *receiver_, s, source);
  if (work.Items().empty()) {
    Unlink(s.id);
    return;
  }
  s.tree = pager.Tree(s.id);
  CellsBetween between(
      pager, receiver_->id, source, GatesBetween(*receiver_, s));
  const Refiner refiner(std::move(work), *s.tree, between.All());
  LinkWriter writer = WriterOf(s);
  WriteLinks(s, refiner, &between, &writer);
  pager.Pairs().SetLinked(receiver_->id, s.id, writer.Chunks() > 0);
}

// Applies and writes all links of a pair.
void PairRefinement::WriteAll(const std::vector<RawLinks>& parts,
                              const VisibleCell& source) {
  if (std::all_of(parts.begin(), parts.end(), [](const RawLinks& part) {
        return part.links.empty();
      })) {
    std::for_each(parts.begin(), parts.end(), [this](const RawLinks& part) {
      Count(part);
    });
    Unlink(source.source);
    return;
  }
  CellPager& pager = context_->pager;
  pager.Order().MoveTo(receiver_->id, source.source);
  SourceCell s(*context_, source.source);
  s.tree = pager.Tree(s.id);
  LinkWriter writer = WriterOf(s);
  for (const RawLinks& part : parts) {
    ApplyPart(part, s, &writer.Pending());
    if (writer.Full()) {
      writer.Flush();
    }
  }
  writer.Flush();
  pager.Pairs().SetLinked(receiver_->id, s.id, writer.Chunks() > 0);
}

LinkWriter PairRefinement::WriterOf(const SourceCell& s) {
  return {context_->store,
          context_->chunks,
          {receiver_->id, s.id},
          context_->state.cursor.chunk,
          [this, &s](const LinkBlock& links) { GatherNew(s, links); }};
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

void PairRefinement::Count(const RawLinks& part) {
  SolveState& state = context_->state;
  state.cells[receiver_->id.Index()].squared_error += part.squared_error;
  state.rays += part.rays;
}

// Counts the part, appends its links to the block, and makes the elements that
// they name.
void PairRefinement::ApplyPart(const RawLinks& part,
                               const SourceCell& s,
                               LinkBlock* block) {
  Count(part);
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
