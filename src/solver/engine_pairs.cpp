// The part of the engine that works on one cell pair.

#include "base/parallel.h"
#include "base/random.h"
#include "base/stopwatch.h"
#include "solver/cells_between.h"
#include "solver/engine.h"
#include "solver/gather.h"

#include <algorithm>

namespace enfilade {
namespace {

// tau_weak over tau: docs/decisions/0011-oracle.md.
constexpr double kWeakShare = 0.5;
// Parts of items of refinement that are worked on in parallel and applied in
// order: as many as make some of these numbers of links, so that neither memory
// nor threads waiting for the last one matter. By the links of the group
// before, so that groups are cut alike in every run.
constexpr uint32_t kMostGroupParts = 512;
constexpr size_t kFewGroupLinks = 4000;
constexpr size_t kManyGroupLinks = 12000;
// What a group may make at most, and each of its parts; a group of so many
// parts is left when one makes more.
constexpr size_t kMostGroupLinks = 32000;
constexpr size_t kMostPartLinks = 8000;
constexpr uint32_t kPartsOfMostLinks = kMostGroupLinks / kMostPartLinks;

GatherSide SourceSide(const CellGeometry& geometry, const CellTree& tree) {
  return {geometry.patches, &tree, &geometry.groups};
}

}  // namespace

void Engine::RefinePair(const Receiver& r, const VisibleCell& source) {
  if (!IsLit(source.source)) {
    store_->EraseAll(BlockKind::kLinks, r.id.value, source.source.value);
    pager_.Order().SetLinked(r.id, source.source, false);
    return;
  }
  pager_.Order().MoveTo(r.id, source.source);
  const auto geometry = pager_.Geometry(source.source);
  const auto tree = pager_.Tree(source.source);
  std::vector<const ShaftBlockers*> gates;
  if (source.source != r.id) {
    gates = {r.geometry->portals.get(), geometry->portals.get()};
  }
  CellsBetween between(pager_, r.id, source, gates);
  RefineOptions options;
  options.tau = state_.tau;
  options.tau_weak = kWeakShare * state_.tau;
  options.seed = MixKey(state_.seed, state_.round);
  const Refiner refiner(options,
                        {r.id,
                         r.geometry->patches,
                         r.tree.get(),
                         r.receivers.get(),
                         nullptr,
                         care_},
                        {source.source,
                         geometry->patches,
                         tree.get(),
                         geometry->clusters.get(),
                         &geometry->groups,
                         {}},
                        between.All());
  CellRow& row = state_.cells[r.id.Index()];
  const CellPair pair{r.id, source.source};
  LinkWriter writer(
      *store_, pair, state_.cursor.chunk, [&](WrittenLinks&& written) {
        const Stopwatch watch(&state_.times.gather_seconds);
        Gather(written.block,
               {r.geometry->patches, r.tree.get(), nullptr},
               SourceSide(*geometry, *tree),
               tree->Sent(),
               r.received->gathered);
        row.links += written.block.links.size();
        pager_.KeepLinks(pair, std::move(written));
      });
  std::vector<RawLinks> results;
  while (state_.cursor.work.item < refiner.ItemCount()) {
    between.Hold();
    const size_t links = RefineGroup(refiner, &results);
    if (links > 0) {
      between.Release();  // the trees may need its room
    }
    for (const RawLinks& result : results) {
      row.squared_error += result.squared_error;
      state_.rays += result.rays;
      ApplyLinks(result,
                 {r.geometry->patches, r.tree.get()},
                 {geometry->patches, tree.get()},
                 r.received.get(),
                 &writer.Pending());
      for (const RawLink& link : result.links) {
        ++care_[link.receiver_patch].links;
      }
    }
    if (links > 0) {
      pager_.MarkDirty(r.id);
      pager_.MarkReceivedDirty(r.id);
      pager_.MarkDirty(source.source);
    }
    if (writer.Full()) {
      writer.Flush();
      state_.cursor.chunk = writer.Chunks();
      CheckPoint();
    }
  }
  writer.Flush();
  pager_.Order().SetLinked(r.id, source.source, writer.Chunks() > 0);
}

// Refines the parts at the cursor and moves it; returns the number of links.
// Where one overflows, those before it count, and it comes again: with fewer
// beside it, so that it may have more links, or cut into parts.
size_t Engine::RefineGroup(const Refiner& refiner,
                           std::vector<RawLinks>* results) {
  const Stopwatch watch(&state_.times.refine_seconds);
  PairCursor& cursor = state_.cursor;
  std::vector<WorkPart> parts;
  for (WorkPart next = cursor.work;
       parts.size() < cursor.group && next.item < refiner.ItemCount();
       next = next.Next()) {
    parts.push_back(next);
  }
  const size_t most = std::min(kMostPartLinks, kMostGroupLinks / parts.size());
  results->resize(parts.size());
  ParallelFor(parts.size(), [&](size_t i) {
    (*results)[i].Clear();
    refiner.Refine(parts[i], most, &(*results)[i]);
  });
  cursor.work = parts.back().Next();
  size_t links = 0;
  for (size_t i = 0; i < parts.size(); ++i) {
    if ((*results)[i].overflowed) {
      cursor.work = most < kMostPartLinks ? parts[i] : parts[i].Narrowed();
      cursor.group = kPartsOfMostLinks;
      results->resize(i);
      return links;
    }
    links += (*results)[i].links.size();
  }
  if (links < kFewGroupLinks) {
    cursor.group = std::min(2 * cursor.group, kMostGroupParts);
  } else if (links > kManyGroupLinks) {
    cursor.group = std::max(cursor.group / 2, 1U);
  }
  return links;
}

void Engine::GatherPair(const Receiver& r, CellId source) {
  // A half of all visible pairs has no links, and a tree is much to read for
  // nothing: docs/decisions/schedules.md.
  if (!pager_.Order().IsLinked(r.id, source)) {
    return;
  }
  pager_.Order().MoveTo(r.id, source);
  const auto geometry = pager_.Geometry(source);
  const auto tree = pager_.Tree(source);
  if (!tree->HasDelta()) {
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
               tree->Delta(),
               r.received->gathered);
      });
  pager_.MarkReceivedDirty(r.id);
}

}  // namespace enfilade
