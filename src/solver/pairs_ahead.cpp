#include "solver/pairs_ahead.h"

#include "base/parallel.h"
#include "base/stopwatch.h"
#include "solver/refine/refined_parts.h"

#include <algorithm>

namespace enfilade {
namespace {

// The most pairs that are looked at together.
constexpr size_t kMostPairs = 64;
// A pair with more items keeps all threads busy by itself.
constexpr size_t kMostItems = 1024;
// No further item is begun while more than this many links wait for their turn.
// A pair whose links bring their number above kMostLinks is refined alone.
constexpr size_t kManyLinks = 8000;
constexpr size_t kMostLinks = 12000;

size_t CountLinks(const std::vector<RawLinks>& links) {
  size_t count = 0;
  for (const RawLinks& of_item : links) {
    count += of_item.links.size();
  }
  return count;
}

}  // namespace

// Whether a pair has work that is left to do, and little of it.
bool PairsAhead::HasLittleWork(const Pair& pair) {
  return pair.items && !pair.is_refined && !pair.items->empty() &&
         pair.items->size() <= kMostItems;
}

bool PairsAhead::IsInMemory(ItemKind kind, CellId cell) const {
  return context_->pager.Items().Has({kind, cell.value});
}

bool PairsAhead::KnowsItems(size_t source) const {
  return source >= first_ && source < first_ + window_.size() &&
         window_[source - first_].items.has_value();
}

std::optional<std::vector<RawLinks>> PairsAhead::TakeLinks(size_t source) {
  if (source >= first_ + window_.size()) {
    FindItems(source);
  }
  if (!KnowsItems(source)) {
    return std::nullopt;
  }
  Pair& pair = window_[source - first_];
  if (HasLittleWork(pair)) {
    RefineFrom(source - first_);
  }
  return pair.is_refined || pair.items->empty()
             ? std::optional(std::move(pair.links))
             : std::nullopt;
}

std::optional<std::vector<WorkItem>> PairsAhead::TakeItems(size_t source) {
  return KnowsItems(source)
             ? std::exchange(window_[source - first_].items, std::nullopt)
             : std::nullopt;
}

// Begins a window at a source, and finds the items of its pairs. The receiver
// as its own source, which comes last, is no pair for the window: its links
// are many.
void PairsAhead::FindItems(size_t first) {
  const size_t end =
      std::min(first + kMostPairs, receiver_->sources.size() - 1);
  first_ = first;
  window_.clear();
  window_.resize(end - std::min(first, end));
  std::vector<std::optional<SourceCell>> sources(window_.size());
  for (size_t i = 0; i < window_.size(); ++i) {
    const CellId id = Seen(i).source;
    if (context_->IsLit(id) && IsInMemory(ItemKind::kGeometry, id) &&
        IsInMemory(ItemKind::kWeights, id)) {
      sources[i].emplace(*context_, id);
    }
  }
  const Stopwatch watch(&context_->state.times.refine_seconds);
  ParallelFor(window_.size(), [&](size_t i) {
    if (sources[i]) {
      window_[i].items =
          WorkBetween(*context_, *receiver_, *sources[i], Seen(i)).TakeItems();
    }
  });
}

// Refines a pair of the window and those after it, if two or more of them have
// little work and all that they need is in memory.
void PairsAhead::RefineFrom(size_t first) {
  context_->pager.Order().MoveTo(receiver_->id, Seen(first).source);
  context_->pager.Items().HoldResident();
  HeldBlockers held;
  std::deque<Refining> pairs;
  for (size_t i = first; i < window_.size(); ++i) {
    if (CanBeRefined(i)) {
      pairs.emplace_back(SourceCell(*context_, Seen(i).source), i);
      if (!Hold(&pairs.back(), &held)) {
        pairs.pop_back();
      }
    }
  }
  if (pairs.size() < 2 || pairs.front().pair != first) {
    return;
  }
  RefineTogether(&pairs);
  for (Refining& pair : pairs) {
    if (pair.done == pair.links.size()) {
      window_[pair.pair].links = std::move(pair.links);
      window_[pair.pair].is_refined = true;
    }
  }
}

// Whether a pair has little work, and its source is in memory.
bool PairsAhead::CanBeRefined(size_t pair) const {
  const CellId source = Seen(pair).source;
  return HasLittleWork(window_[pair]) &&
         IsInMemory(ItemKind::kGeometry, source) &&
         IsInMemory(ItemKind::kWeights, source) &&
         IsInMemory(ItemKind::kTree, source);
}

// Refines the items of all pairs. Items are begun in their order, so that few
// links have to wait.
void PairsAhead::RefineTogether(std::deque<Refining>* pairs) {
  struct Task {
    Refining* pair;
    size_t item;
  };

  std::vector<Task> tasks;
  for (Refining& pair : *pairs) {
    for (size_t item = 0; item < pair.links.size(); ++item) {
      tasks.push_back({&pair, item});
    }
  }
  std::atomic<size_t> links = 0;
  for (const Pair& pair : window_) {
    links += CountLinks(pair.links);  // they have not had their turn
  }
  std::atomic<size_t> next = 0;
  const Stopwatch watch(&context_->state.times.refine_seconds);
  OnAllThreads([&] {
    for (size_t i = next++; i < tasks.size() && links <= kManyLinks;
         i = next++) {
      const auto [pair, item] = tasks[i];
      RawLinks& out = pair->links[item];
      pair->refiner->Refine(
          {item}, {RefinedParts::kMostPartLinks, &links, kMostLinks}, &out);
      pair->done += out.overflowed ? 0 : 1;
    }
  });
}

// Takes into use what it takes to refine a pair, and returns true, if all of
// that is in memory.
bool PairsAhead::Hold(Refining* pair, HeldBlockers* held) {
  CellPager& pager = context_->pager;
  const VisibleCell& seen = Seen(pair->pair);
  const auto is_there = [&](CellId cell) {
    return held->contains(cell) ||
           (IsInMemory(ItemKind::kShaftBlockers, cell) &&
            IsInMemory(ItemKind::kRayBlockers, cell));
  };
  if (!std::all_of(seen.between.begin(), seen.between.end(), is_there)) {
    return false;
  }
  for (const CellId cell : seen.between) {
    const auto [it, is_new] = held->try_emplace(cell);
    if (is_new) {
      it->second = pager.BlockersOf(cell);
    }
    pair->blockers.shafts.push_back(it->second.shafts.get());
    pair->blockers.rays.push_back(it->second.rays.get());
  }
  pair->blockers.gates = GatesBetween(*receiver_, pair->source);
  pair->source.tree = pager.Tree(pair->source.id);
  const std::vector<WorkItem>& items = *window_[pair->pair].items;
  pair->links.resize(items.size());
  pair->refiner.emplace(
      WorkBetween(*context_, *receiver_, pair->source, seen, items),
      *pair->source.tree,
      pair->blockers);
  return true;
}

}  // namespace enfilade
