// The work between a receiver and a source cell: which clusters of one cell may
// exchange light with clusters of the other, judged by bounds alone. Cells that
// hardly see each other have next to no work. Finding that out needs neither
// the light of the source nor what stands between; most pairs of a large
// building are of this kind.

#pragma once

#include "solver/refine/rare_draws.h"
#include "solver/refine/refine_options.h"
#include "solver/refine/refine_receiver.h"
#include "solver/refine/refine_source.h"
#include "solver/refine/source_weights.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

// The number of sources that are looked at together.
inline constexpr size_t kItemSources = 32;

// A cluster of receivers, and a cluster of sources or a group.
struct ClusterPair {
  uint32_t receiver = 0;
  uint32_t source = 0;
};

// Bounds on the pairs of items of two clusters.
struct PairBounds {
  bool hidden = false;    // no item of one faces or sees any of the other
  float form_factor = 0;  // upper bound
  float probability = 0;  // upper bound, that a pair is kept
  float expected = 0;     // upper bound: number of weak links

  // Whether so few pairs are kept that they are drawn without a look at the
  // others.
  [[nodiscard]] bool IsFew() const;
  [[nodiscard]] bool IsUnlikely() const;
};

// The part of all transfers from one cell to another that is looked at
// together.
struct WorkItem {
  uint32_t receiver = 0;  // cluster
  uint32_t source = 0;    // cluster, or group
  bool is_group = false;
  bool is_drawn = false;  // few pairs are kept: they are drawn
};

class PairWork {
 public:
  PairWork(const RefineOptions& options,
           const RefineReceiver& receiver,
           const RefineSource& source);

  // With the items that a call of the other constructor has found.
  PairWork(const RefineOptions& options,
           const RefineReceiver& receiver,
           const RefineSource& source,
           std::vector<WorkItem> items);

  [[nodiscard]] const RefineOptions& Options() const { return options_; }

  [[nodiscard]] const RefineReceiver& Receiver() const { return receiver_; }

  [[nodiscard]] const RefineSource& Source() const { return source_; }

  // Items are sorted by receiver, so that links come nearly in the order in
  // which they are stored. The number of items grows with the number of
  // receivers and of the links that they may get, not with the number of all
  // pairs.
  [[nodiscard]] std::span<const WorkItem> Items() const { return items_; }

  [[nodiscard]] std::vector<WorkItem> TakeItems() { return std::move(items_); }

  // The bounds on a pair of clusters.
  [[nodiscard]] PairBounds BoundPair(ClusterPair pair) const;
  // The bounds on a cluster of receivers and a group.
  [[nodiscard]] PairBounds BoundGroup(ClusterPair pair) const;

  // Draws which of the `count` transfers of a pair are looked at. Requires that
  // few are kept (PairBounds::IsFew or IsUnlikely).
  [[nodiscard]] RareDraws DrawsOf(ClusterPair pair,
                                  const PairBounds& bounds,
                                  uint64_t count) const;

  // The probability with which a transfer is kept, from bounds of the transfer
  // (W/m, weighted) and of its form factor.
  [[nodiscard]] float WeakProbability(float transfer, float form_factor) const;

  // The key of the random numbers of this pair of cells.
  [[nodiscard]] uint64_t Key() const;

 private:
  void FindItems();
  void FindPairs(ClusterPair pair);
  void FindGroups(ClusterPair pair);
  void SortItems();

  RefineOptions options_;
  RefineReceiver receiver_;
  RefineSource source_;
  std::vector<WorkItem> items_;
};

// An upper bound of the form factor from a point within `radius` of `middle` to
// the group; 1 if the two spheres around them may touch.
float FormFactorOfGroup(const SourceGroup& group, Vec3f middle, float radius);

float LongestExtent(const Cluster& cluster);

}  // namespace enfilade
