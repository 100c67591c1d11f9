// The part of refinement that goes from items of work down to pairs of elements
// at which refinement begins, or draws the few that matter among many.

#include "base/random.h"
#include "solver/refiner_task.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// Pairs of clusters are sampled where each pair of their items is kept with at
// most this probability, and these many are to be expected.
constexpr float kMostProbable = 0.5F;
constexpr float kFewLinks = 2;

float LongestExtent(const Cluster& c) {
  const Vec3f e = c.box.Extent();
  return std::max({e.x, e.y, e.z});
}

}  // namespace

void Refiner::Refine(const WorkPart& part,
                     const LinkLimit& limit,
                     RawLinks* out) const {
  Task task;
  task.out = out;
  task.part = part;
  task.limit = limit;
  task.limit.most = part.depth < WorkPart::kMostDepth ? limit.most : SIZE_MAX;
  const size_t columns = source_front_.size() + GroupCount();
  const uint32_t r = receiver_front_[part.item / columns];
  const size_t column = part.item % columns;
  task.first_receiver = receiver_.clusters->Clusters()[r].first;
  if (column < source_front_.size()) {
    VisitSources(r, source_front_[column], &task);
  } else {
    VisitGroups(receiver_.clusters->Clusters()[r],
                source_.groups->Roots()[column - source_front_.size()],
                &task);
    TakeBlocked(&task);
  }
  FlushWeak(&task);
  out->rays += task.rays.traced;
}

// What a pair of clusters is, by its bounds.
Refiner::ClusterVisit Refiner::LookAt(ClusterPair pair) const {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const Cluster& s = source_.clusters->Clusters()[pair.source];
  const ClusterBound bound = BoundOf(r, s);
  ClusterVisit visit;
  visit.behind = bound.behind;
  if (bound.behind) {
    return visit;
  }
  visit.form_factor = bound.form_factor;
  const float transfer = receiver_.weights[pair.receiver] *
                         std::min(peaks_[pair.source] * bound.form_factor,
                                  fluxes_[pair.source] * bound.per_area);
  visit.probability = WeakProbability(transfer, bound.form_factor);
  visit.expected = static_cast<float>(r.count) * static_cast<float>(s.count) *
                   visit.probability;
  return visit;
}

// From the sources of an item down to those of kItemSources, or to where
// few links are to be expected: what is far or dark is never looked at.
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
  const ClusterVisit visit = LookAt({receiver, source});
  if (visit.behind || task->out->overflowed) {
    return;
  }
  if (visit.probability < kMostProbable && visit.expected < kFewLinks) {
    SamplePairs({receiver, source}, visit, task);
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
  const ClusterVisit visit = LookAt({receiver, source});
  if (visit.behind) {
    return;
  }
  const bool are_leaves = r.child == 0 && s.child == 0;
  if (visit.probability < kMostProbable &&
      (visit.expected < kFewLinks || are_leaves)) {
    SamplePairs({receiver, source}, visit, task);
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
      if (task->Meets(i, 1) && !InGroup(source_.clusters->Items()[k].patch)) {
        Visit(ReceiverAt(i, task), SourceAt(k, task), 0, task);
      }
    }
  }
}

// Draws the pairs of items whose weak links are kept, without looking at the
// others: first by `probability`, which none of them exceeds, jumping from one
// success to the next; then, of those, by what is their own.
void Refiner::SamplePairs(ClusterPair pair,
                          const ClusterVisit& visit,
                          Task* task) const {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const Cluster& s = source_.clusters->Clusters()[pair.source];
  const uint64_t pairs = uint64_t{r.count} * s.count;
  Random random(
      MixKey(PairKey(), ~(uint64_t{pair.receiver} << 32 | pair.source)));
  const double log_miss = std::log1p(-static_cast<double>(visit.probability));
  uint64_t at = 0;
  while (true) {
    const double misses = std::log1p(-random.Next()) / log_miss;
    if (!(misses < static_cast<double>(pairs - at))) {
      return;
    }
    at += static_cast<uint64_t>(misses);
    const uint32_t i = r.first + static_cast<uint32_t>(at / s.count);
    const uint32_t k = s.first + static_cast<uint32_t>(at % s.count);
    if (task->Meets(i, 1) && !InGroup(source_.clusters->Items()[k].patch)) {
      const Receiver& receiver = ReceiverAt(i, task);
      const Source source = s.count <= kItemSources
                                ? SourceAt(k, task)
                                : RootSource(source_.clusters->Items()[k]);
      const float f = std::min(visit.form_factor,
                               FormFactorBound(receiver.end, source.end));
      AddWeak(receiver,
              source,
              f,
              receiver.weight * PeakOf(source) * f,
              visit.probability,
              task);
    }
    if (++at == pairs) {
      return;
    }
  }
}

const Refiner::Receiver& Refiner::ReceiverAt(uint32_t item, Task* task) const {
  return task->receivers.At(item - task->first_receiver, [&] {
    return RootReceiver(receiver_.clusters->Items()[item]);
  });
}

// Of the sources that the task is at.
const Refiner::Source& Refiner::SourceAt(uint32_t item, Task* task) const {
  return task->sources.At(item - task->first_source, [&] {
    return RootSource(source_.clusters->Items()[item]);
  });
}

}  // namespace enfilade
