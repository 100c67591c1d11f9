#include "solver/refine/pair_work.h"

#include "base/check.h"
#include "base/random.h"
#include "solver/state/work_part.h"

#include <algorithm>
#include <tuple>

namespace enfilade {
namespace {

// For each few receivers, the sources of a cell are split into about this many
// items of work. More items would be in vain, because most sources are too far
// or too dark to be looked at.
constexpr size_t kSourceParts = 16;
constexpr size_t kMostSources = 2048;  // per item

size_t SourcesOfItem(size_t sources) {
  return std::clamp(sources / kSourceParts, kItemSources, kMostSources);
}

// Pairs of clusters are sampled if each pair of their items is kept with less
// than this probability and fewer than kFewLinks links are expected.
constexpr float kMostProbable = 0.5F;
constexpr float kFewLinks = 2;

// A sampled transfer is kept with at least this multiple of its form factor as
// probability, so that no coefficient exceeds the inverse of kWeakGain: what is
// dark now may be lit later.
constexpr float kWeakGain = 1;

}  // namespace

bool PairBounds::IsUnlikely() const {
  return probability < kMostProbable;
}

bool PairBounds::IsFew() const {
  return IsUnlikely() && expected < kFewLinks;
}

float LongestExtent(const Cluster& cluster) {
  const Vec3f e = cluster.box.Extent();
  return std::max({e.x, e.y, e.z});
}

float FormFactorOfGroup(const SourceGroup& group, Vec3f middle, float radius) {
  const Vec3f group_middle = (group.box.low + group.box.high) * 0.5F;
  const float gap = Length(group_middle - middle) -
                    (radius + 0.5F * Length(group.box.Extent()));
  return gap > 0 ? std::min(1.0F,
                            group.area / (static_cast<float>(kPi) * gap * gap))
                 : 1.0F;
}

PairWork::PairWork(const RefineOptions& options,
                   const RefineReceiver& receiver,
                   const RefineSource& source)
    : PairWork(options, receiver, source, {}) {
  FindItems();
}

PairWork::PairWork(const RefineOptions& options,
                   const RefineReceiver& receiver,
                   const RefineSource& source,
                   std::vector<WorkItem> items)
    : options_(options),
      receiver_(receiver),
      source_(source),
      items_(std::move(items)) {
  ENFILADE_CHECK(
      receiver.weights.size() == receiver.clusters->Clusters().size(),
      "{} weights of {} clusters",
      receiver.weights.size(),
      receiver.clusters->Clusters().size());
  ENFILADE_CHECK(source.sent != nullptr, "a source without weights");
  ENFILADE_CHECK(
      source.sent->peaks.size() == source.clusters->Clusters().size() &&
          (source.groups == nullptr ||
           source.sent->groups.size() == source.groups->All().size()),
      "weights of {} clusters and {} groups are of another source",
      source.sent->peaks.size(),
      source.sent->groups.size());
}

uint64_t PairWork::Key() const {
  return MixKey(options_.seed,
                uint64_t{receiver_.id.value} << 32 | source_.id.value);
}

float PairWork::WeakProbability(float transfer, float form_factor) const {
  return std::min(1.0F,
                  std::max(transfer / static_cast<float>(options_.tau_weak),
                           kWeakGain * form_factor));
}

void PairWork::FindItems() {
  if (receiver_.clusters->Items().empty() ||
      source_.clusters->Items().empty()) {
    return;
  }
  FindPairs({0, 0});
  if (source_.groups != nullptr) {
    for (const uint32_t group : source_.groups->Roots()) {
      FindGroups({0, group});
    }
  }
  SortItems();
}

void PairWork::FindPairs(ClusterPair pair) {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const Cluster& s = source_.clusters->Clusters()[pair.source];
  const PairBounds bounds = BoundPair(pair);
  if (bounds.hidden) {
    return;
  }
  if (bounds.IsFew()) {
    if (!DrawsOf(pair, bounds, uint64_t{r.count} * s.count).AtEnd()) {
      items_.push_back({pair.receiver, pair.source, false, true});
    }
    return;
  }
  const bool splits_r = r.count > kItemReceivers && r.child != 0;
  const bool splits_s =
      s.count > SourcesOfItem(source_.clusters->Items().size()) && s.child != 0;
  if (splits_r && (!splits_s || LongestExtent(r) >= LongestExtent(s))) {
    FindPairs({r.child, pair.source});
    FindPairs({r.child + 1, pair.source});
  } else if (splits_s) {
    FindPairs({pair.receiver, s.child});
    FindPairs({pair.receiver, s.child + 1});
  } else {
    items_.push_back({pair.receiver, pair.source, false, false});
  }
}

void PairWork::FindGroups(ClusterPair pair) {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const PairBounds bounds = BoundGroup(pair);
  if (bounds.hidden) {
    return;
  }
  if (bounds.IsFew()) {
    if (!DrawsOf(pair, bounds, r.count).AtEnd()) {
      items_.push_back({pair.receiver, pair.source, true, true});
    }
  } else if (r.count > kItemReceivers && r.child != 0) {
    FindGroups({r.child, pair.source});
    FindGroups({r.child + 1, pair.source});
  } else {
    items_.push_back({pair.receiver, pair.source, true, false});
  }
}

// Sorts items by receiver, so that links come nearly in the order in which they
// are stored. No two items compare equal.
void PairWork::SortItems() {
  const auto key = [this](const WorkItem& item) {
    const uint32_t source =
        item.is_group ? item.source
                      : source_.clusters->Clusters()[item.source].first;
    return std::tuple(receiver_.clusters->Clusters()[item.receiver].first,
                      item.is_group,
                      source);
  };
  std::sort(
      items_.begin(), items_.end(), [&](const WorkItem& a, const WorkItem& b) {
        return key(a) < key(b);
      });
}

PairBounds PairWork::BoundPair(ClusterPair pair) const {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const Cluster& s = source_.clusters->Clusters()[pair.source];
  if (!receiver_.part.Overlaps(r.box) || !source_.part.Overlaps(s.box)) {
    return {.hidden = true};
  }
  const ClusterBound bound = BoundOf(r, s);
  if (bound.behind) {
    return {.hidden = true};
  }
  PairBounds bounds;
  bounds.form_factor = bound.form_factor;
  const float transfer =
      receiver_.weights[pair.receiver] *
      std::min(source_.sent->peaks[pair.source] * bound.form_factor,
               source_.sent->fluxes[pair.source] * bound.per_area);
  bounds.probability = WeakProbability(transfer, bound.form_factor);
  bounds.expected = static_cast<float>(r.count) * static_cast<float>(s.count) *
                    bounds.probability;
  return bounds;
}

PairBounds PairWork::BoundGroup(ClusterPair pair) const {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const SourceGroup& g = source_.groups->All()[pair.source];
  if (!receiver_.part.Overlaps(r.box) || !source_.part.Overlaps(g.box)) {
    return {.hidden = true};
  }
  PairBounds bounds;
  bounds.form_factor = FormFactorOfGroup(
      g, (r.box.low + r.box.high) * 0.5F, 0.5F * Length(r.box.Extent()));
  bounds.probability = WeakProbability(
      receiver_.weights[pair.receiver] *
          source_.sent->groups[pair.source].Most() * bounds.form_factor,
      bounds.form_factor);
  bounds.expected = static_cast<float>(r.count) * bounds.probability;
  return bounds;
}

RareDraws PairWork::DrawsOf(ClusterPair pair,
                            const PairBounds& bounds,
                            uint64_t count) const {
  return {MixKey(Key(), ~(uint64_t{pair.receiver} << 32 | pair.source)),
          static_cast<double>(bounds.probability),
          count};
}

}  // namespace enfilade
