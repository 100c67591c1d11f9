// The part of refinement that goes from items of work down to the pairs of
// elements at which refinement begins, or draws the few pairs that are kept
// among many.

#include "solver/refine/refiner_task.h"

#include <algorithm>

namespace enfilade {

void Refiner::Refine(const WorkPart& part,
                     const LinkLimit& limit,
                     RawLinks* out) const {
  Task task;
  task.out = out;
  task.part = part;
  task.limit = limit;
  task.limit.most = part.depth < WorkPart::kMostDepth ? limit.most : SIZE_MAX;
  const WorkItem& item = work_.Items()[part.item];
  const Cluster& r = receiver_.clusters->Clusters()[item.receiver];
  task.first_receiver = r.first;
  if (item.is_drawn && part.part == 0) {
    task.part = {part.item};  // a drawn item has too few links to be cut
    DrawItem(item, &task);
  } else if (!item.is_drawn && item.is_group) {
    VisitGroups(r, item.source, &task);
    TakeBlocked(&task);
  } else if (!item.is_drawn) {
    VisitSources(item.receiver, item.source, &task);
  }
  FlushWeak(&task);
  out->rays += task.rays.traced;
}

// Goes from the sources of an item down to clusters of at most kItemSources, or
// to clusters from which few links are expected: far or dark sources are never
// looked at.
void Refiner::VisitSources(uint32_t receiver,
                           uint32_t source,
                           Task* task) const {
  const Cluster& s = source_.clusters->Clusters()[source];
  if (s.count <= kItemSources) {
    task->first_source = s.first;
    task->sources.Clear();
    VisitClusters(receiver, source, task);
    TakeBlocked(task);
    return;
  }
  const PairBounds bounds = work_.BoundPair({receiver, source});
  if (bounds.hidden || task->out->overflowed) {
    return;
  }
  if (bounds.IsFew()) {
    SamplePairs({receiver, source}, bounds, task);
    return;
  }
  VisitSources(receiver, s.child, task);
  VisitSources(receiver, s.child + 1, task);
}

void Refiner::VisitClusters(uint32_t receiver,
                            uint32_t source,
                            Task* task) const {
  const Cluster& r = receiver_.clusters->Clusters()[receiver];
  const Cluster& s = source_.clusters->Clusters()[source];
  if (task->out->overflowed || !task->Meets(r.first, r.count)) {
    return;
  }
  const PairBounds bounds = work_.BoundPair({receiver, source});
  if (bounds.hidden) {
    return;
  }
  const bool are_leaves = r.child == 0 && s.child == 0;
  if (bounds.IsFew() || (are_leaves && bounds.IsUnlikely())) {
    SamplePairs({receiver, source}, bounds, task);
  } else if (are_leaves) {
    VisitItems(r, s, task);
  } else if (s.child == 0 ||
             (r.child != 0 && LongestExtent(r) >= LongestExtent(s))) {
    VisitClusters(r.child, source, task);
    VisitClusters(r.child + 1, source, task);
  } else {
    VisitClusters(receiver, s.child, task);
    VisitClusters(receiver, s.child + 1, task);
  }
}

void Refiner::VisitItems(const Cluster& r, const Cluster& s, Task* task) const {
  for (uint32_t i = r.first; i < r.first + r.count; ++i) {
    for (uint32_t k = s.first; k < s.first + s.count; ++k) {
      if (task->Meets(i, 1) &&
          !source_.InGroup(source_.clusters->Items()[k].patch)) {
        Visit(ReceiverAt(i, task), SourceAt(k, task), 0, task);
      }
    }
  }
}

// Does an item that is expected to have few links.
void Refiner::DrawItem(const WorkItem& item, Task* task) const {
  const ClusterPair pair{item.receiver, item.source};
  if (item.is_group) {
    SampleGroup(pair, work_.BoundGroup(pair), task);
  } else {
    task->first_source = source_.clusters->Clusters()[item.source].first;
    SamplePairs(pair, work_.BoundPair(pair), task);
  }
}

// Draws the pairs of items whose weak links are kept, without looking at the
// other pairs. The first draw uses `bounds.probability`, an upper bound for all
// pairs, and jumps from one success to the next. AddWeak then draws among the
// successes by each pair's own probability.
void Refiner::SamplePairs(ClusterPair pair,
                          const PairBounds& bounds,
                          Task* task) const {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const Cluster& s = source_.clusters->Clusters()[pair.source];
  RareDraws draws = work_.DrawsOf(pair, bounds, uint64_t{r.count} * s.count);
  for (; !draws.AtEnd(); draws.Next()) {
    const uint32_t i = r.first + static_cast<uint32_t>(draws.Trial() / s.count);
    const uint32_t k = s.first + static_cast<uint32_t>(draws.Trial() % s.count);
    if (!task->Meets(i, 1) ||
        source_.InGroup(source_.clusters->Items()[k].patch)) {
      continue;
    }
    const Receiver receiver =
        r.count <= kItemReceivers
            ? ReceiverAt(i, task)
            : RootReceiver(receiver_.clusters->Items()[i]);
    const Source source = s.count <= kItemSources
                              ? SourceAt(k, task)
                              : RootSource(source_.clusters->Items()[k]);
    if (!MaySee(receiver, source)) {
      continue;
    }
    const float f =
        std::min(bounds.form_factor, FormFactorBound(receiver.end, source.end));
    AddWeak(receiver,
            source,
            f,
            receiver.weight * PeakOf(source) * f,
            bounds.probability,
            task);
  }
}

const Refiner::Receiver& Refiner::ReceiverAt(uint32_t item, Task* task) const {
  return task->receivers.At(item - task->first_receiver, [&] {
    return RootReceiver(receiver_.clusters->Items()[item]);
  });
}

// The source must be among the task's current sources.
const Refiner::Source& Refiner::SourceAt(uint32_t item, Task* task) const {
  return task->sources.At(item - task->first_source, [&] {
    return RootSource(source_.clusters->Items()[item]);
  });
}

}  // namespace enfilade
