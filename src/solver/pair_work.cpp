// The part of refinement that finds its items of work: from the pair of all
// receivers and all sources down to pairs of clusters that are worth a look.
// Between cells that hardly see each other there are next to none, and to know
// that must cost next to nothing: such pairs are most of a large building's.

#include "solver/rare_draws.h"
#include "solver/refiner_task.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace enfilade {
namespace {

// The sources of a cell are about so many items of work for each few receivers:
// more would be in vain, as most are too far or too dark to be looked at.
constexpr size_t kSourceParts = 16;
constexpr size_t kMostSources = 2048;  // of an item

size_t SourcesOfItem(size_t sources) {
  return std::clamp(sources / kSourceParts, kItemSources, kMostSources);
}

}  // namespace

void Refiner::FindItems() {
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

void Refiner::FindPairs(ClusterPair pair) {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const Cluster& s = source_.clusters->Clusters()[pair.source];
  const ClusterVisit visit = LookAt(pair);
  if (visit.behind) {
    return;
  }
  if (visit.IsFew()) {
    if (!DrawsOf(pair, visit, uint64_t{r.count} * s.count).AtEnd()) {
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

void Refiner::FindGroups(ClusterPair pair) {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const ClusterVisit visit = LookAtGroup(pair);
  if (visit.IsFew()) {
    if (!DrawsOf(pair, visit, r.count).AtEnd()) {
      items_.push_back({pair.receiver, pair.source, true, true});
    }
  } else if (r.count > kItemReceivers && r.child != 0) {
    FindGroups({r.child, pair.source});
    FindGroups({r.child + 1, pair.source});
  } else {
    items_.push_back({pair.receiver, pair.source, true, false});
  }
}

// By receiver, so that links come nearly as they will be stored; no two items
// compare equal.
void Refiner::SortItems() {
  const auto key = [this](const Item& item) {
    const uint32_t source =
        item.is_group ? item.source
                      : source_.clusters->Clusters()[item.source].first;
    return std::tuple(receiver_.clusters->Clusters()[item.receiver].first,
                      item.is_group,
                      source);
  };
  std::sort(items_.begin(), items_.end(), [&](const Item& a, const Item& b) {
    return key(a) < key(b);
  });
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

// The same of a cluster and a group.
Refiner::ClusterVisit Refiner::LookAtGroup(ClusterPair pair) const {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const SourceGroup& g = *groups_[pair.source].group;
  ClusterVisit visit;
  visit.form_factor = FormFactorOfGroup(
      g, (r.box.low + r.box.high) * 0.5F, Length(r.box.Extent()));
  visit.probability =
      WeakProbability(receiver_.weights[pair.receiver] *
                          groups_[pair.source].Most() * visit.form_factor,
                      visit.form_factor);
  visit.expected = static_cast<float>(r.count) * visit.probability;
  return visit;
}

// A bound, from a point of what lies about `middle`; 1 where that may touch.
float Refiner::FormFactorOfGroup(const SourceGroup& group,
                                 Vec3f middle,
                                 float diameter) {
  const Vec3f group_middle = (group.box.low + group.box.high) * 0.5F;
  const float gap = Length(group_middle - middle) -
                    0.5F * (diameter + Length(group.box.Extent()));
  return gap > 0 ? std::min(1.0F,
                            group.area / (static_cast<float>(kPi) * gap * gap))
                 : 1.0F;
}

// Which of the transfers of a pair are looked at, where those are few.
RareDraws Refiner::DrawsOf(ClusterPair pair,
                           const ClusterVisit& visit,
                           uint64_t count) const {
  return {MixKey(PairKey(), ~(uint64_t{pair.receiver} << 32 | pair.source)),
          static_cast<double>(visit.probability),
          count};
}

}  // namespace enfilade
