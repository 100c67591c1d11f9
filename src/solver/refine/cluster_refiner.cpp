#include "solver/refine/cluster_refiner.h"

#include "solver/refine/rare_draws.h"

#include <algorithm>

namespace enfilade {

ClusterRefiner::ClusterRefiner(const PairContext& pair,
                               const WorkPart& part,
                               LinkSink* sink)
    : pair_(&pair),
      part_(part),
      sink_(sink),
      elements_(pair, part, sink),
      groups_(pair, part, sink),
      first_receiver_(
          ReceiverCluster(pair.work.Items()[part.item].receiver).first) {}

void ClusterRefiner::Visit(const WorkItem& item) {
  if (item.is_group) {
    VisitGroup(ReceiverCluster(item.receiver), item.source);
    sink_->TakeBlocked();
  } else {
    VisitSources({item.receiver, item.source});
  }
}

void ClusterRefiner::Draw(const WorkItem& item) {
  const ClusterPair pair{item.receiver, item.source};
  if (item.is_group) {
    DrawGroup(pair, pair_->work.BoundGroup(pair));
  } else {
    BeginSources(SourceCluster(item.source));
    DrawPairs(pair, pair_->work.BoundPair(pair));
  }
}

// Goes from the sources of an item down to clusters of at most kItemSources, or
// to clusters from which few links are expected: far or dark sources are never
// looked at.
void ClusterRefiner::VisitSources(ClusterPair pair) {
  const Cluster& s = SourceCluster(pair.source);
  if (s.count <= kItemSources) {
    BeginSources(s);
    VisitClusters(pair);
    sink_->TakeBlocked();
    return;
  }
  const PairBounds bounds = pair_->work.BoundPair(pair);
  if (bounds.hidden || sink_->Overflowed()) {
    return;
  }
  if (bounds.IsFew()) {
    DrawPairs(pair, bounds);
    return;
  }
  VisitSources({pair.receiver, s.child});
  VisitSources({pair.receiver, s.child + 1});
}

void ClusterRefiner::VisitClusters(ClusterPair pair) {
  const Cluster& r = ReceiverCluster(pair.receiver);
  const Cluster& s = SourceCluster(pair.source);
  if (sink_->Overflowed() || !InPart(r.first, r.count)) {
    return;
  }
  const PairBounds bounds = pair_->work.BoundPair(pair);
  if (bounds.hidden) {
    return;
  }
  const bool are_leaves = r.child == 0 && s.child == 0;
  if (bounds.IsFew() || (are_leaves && bounds.IsUnlikely())) {
    DrawPairs(pair, bounds);
  } else if (are_leaves) {
    VisitItems(r, s);
  } else if (s.child == 0 ||
             (r.child != 0 && LongestExtent(r) >= LongestExtent(s))) {
    VisitClusters({r.child, pair.source});
    VisitClusters({r.child + 1, pair.source});
  } else {
    VisitClusters({pair.receiver, s.child});
    VisitClusters({pair.receiver, s.child + 1});
  }
}

void ClusterRefiner::VisitItems(const Cluster& r, const Cluster& s) {
  for (uint32_t i = r.first; i < r.first + r.count; ++i) {
    for (uint32_t k = s.first; k < s.first + s.count; ++k) {
      if (InPart(i, 1) && !InGroup(k)) {
        elements_.Visit(ReceiverAt(i), SourceAt(k), 0);
      }
    }
  }
}

void ClusterRefiner::VisitGroup(const Cluster& r, uint32_t group) {
  for (uint32_t i = r.first; i < r.first + r.count; ++i) {
    if (InPart(i, 1)) {
      groups_.Draw(ReceiverAt(i), group, 1);
    }
  }
}

// Draws the pairs of items whose weak links are kept, without looking at the
// other pairs. The first draw uses `bounds.probability`, an upper bound for all
// pairs, and jumps from one success to the next. DrawWeak then draws among the
// successes by each pair's own probability.
void ClusterRefiner::DrawPairs(ClusterPair pair, const PairBounds& bounds) {
  const Cluster& r = ReceiverCluster(pair.receiver);
  const Cluster& s = SourceCluster(pair.source);
  RareDraws draws =
      pair_->work.DrawsOf(pair, bounds, uint64_t{r.count} * s.count);
  for (; !draws.AtEnd(); draws.Next()) {
    const uint32_t i = r.first + static_cast<uint32_t>(draws.Trial() / s.count);
    const uint32_t k = s.first + static_cast<uint32_t>(draws.Trial() % s.count);
    if (!InPart(i, 1) || InGroup(k)) {
      continue;
    }
    const ReceiverElement receiver =
        r.count <= kItemReceivers ? ReceiverAt(i) : MakeReceiver(i);
    const SourceElement source =
        s.count <= kItemSources ? SourceAt(k) : MakeSource(k);
    if (!pair_->MaySee(receiver.end, source.end)) {
      continue;
    }
    const float form_factor =
        std::min(bounds.form_factor, FormFactorBound(receiver.end, source.end));
    const float brightness = receiver.weight * PeakOf(source);
    elements_.DrawWeak(
        receiver, source, {brightness, form_factor, bounds.probability});
  }
}

// Draws the receivers of a cluster for a group, as DrawPairs draws pairs.
void ClusterRefiner::DrawGroup(ClusterPair pair, const PairBounds& bounds) {
  const Cluster& r = ReceiverCluster(pair.receiver);
  RareDraws draws = pair_->work.DrawsOf(pair, bounds, r.count);
  for (; !draws.AtEnd(); draws.Next()) {
    const auto i = r.first + static_cast<uint32_t>(draws.Trial());
    groups_.Draw(MakeReceiver(i), pair.source, bounds.probability);
  }
}

// Makes the items of a cluster the current sources. There may be more than
// kItemSources, if none of them is asked for by SourceAt.
void ClusterRefiner::BeginSources(const Cluster& s) {
  first_source_ = s.first;
  sources_.Clear();
}

// Whether one of the receivers [first, first + count) is in the part.
bool ClusterRefiner::InPart(uint32_t first, uint32_t count) const {
  return part_.Meets(first - first_receiver_, count);
}

bool ClusterRefiner::InGroup(uint32_t source_item) const {
  const RefineSource& source = pair_->Source();
  return source.InGroup(source.clusters->Items()[source_item].patch);
}

ReceiverElement ClusterRefiner::MakeReceiver(uint32_t item) const {
  const RefineReceiver& receiver = pair_->Receiver();
  return RootReceiver(receiver, receiver.clusters->Items()[item]);
}

SourceElement ClusterRefiner::MakeSource(uint32_t item) const {
  return pair_->sources.OfPatch(pair_->Source().clusters->Items()[item].patch);
}

const ReceiverElement& ClusterRefiner::ReceiverAt(uint32_t item) {
  return receivers_.At(item - first_receiver_,
                       [&] { return MakeReceiver(item); });
}

const SourceElement& ClusterRefiner::SourceAt(uint32_t item) {
  return sources_.At(item - first_source_, [&] { return MakeSource(item); });
}

}  // namespace enfilade
