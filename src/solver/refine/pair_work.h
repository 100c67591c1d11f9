// The work between a receiver and a source cell: which clusters of the one are
// worth a look from the other, by bounds alone. Between cells that hardly see
// each other there is next to none, and to know that takes neither the light of
// the source nor what stands between: such pairs are most of a large
// building's.

#pragma once

#include "solver/refine/rare_draws.h"
#include "solver/refine/refine_side.h"
#include "solver/refine/source_weights.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// Sources are looked at by so many.
inline constexpr size_t kItemSources = 32;

// A cluster of receivers, and one of sources or a group.
struct ClusterPair {
  uint32_t receiver = 0;
  uint32_t source = 0;
};

// What is known of the pairs of items of two clusters.
struct ClusterVisit {
  bool hidden = false;    // no item of one faces, or sees, one of the other
  float form_factor = 0;  // at most
  float probability = 0;  // with which each is kept, at most
  float expected = 0;     // so many links, at most, where they are weak

  // Whether the few that are kept are drawn without a look at the others.
  [[nodiscard]] bool IsFew() const;
  [[nodiscard]] bool IsUnlikely() const;
};

// What is looked at in one go, of all transfers from a cell to another.
struct WorkItem {
  uint32_t receiver = 0;  // cluster
  uint32_t source = 0;    // cluster, or group
  bool is_group = false;
  bool is_drawn = false;  // few among them will be kept: those are drawn
};

class PairWork {
 public:
  // All sides are borrowed. The tree of the source is not needed.
  PairWork(const RefineOptions& options,
           const RefineSide& receiver,
           const RefineSide& source);

  [[nodiscard]] const RefineOptions& Options() const { return options_; }

  [[nodiscard]] const RefineSide& Receiver() const { return receiver_; }

  [[nodiscard]] const RefineSide& Source() const { return source_; }

  // By receiver, so that links come nearly as they will be stored. Their number
  // grows with that of the receivers and with what they may get, not with that
  // of all pairs.
  [[nodiscard]] std::span<const WorkItem> Items() const { return items_; }

  // What a pair of clusters is, by its bounds.
  [[nodiscard]] ClusterVisit LookAt(ClusterPair pair) const;
  // The same of a cluster and a group.
  [[nodiscard]] ClusterVisit LookAtGroup(ClusterPair pair) const;

  // Which of the `count` transfers of a pair are looked at, where those are
  // few.
  [[nodiscard]] RareDraws DrawsOf(ClusterPair pair,
                                  const ClusterVisit& visit,
                                  uint64_t count) const;

  // With which probability a transfer is kept, by bounds of itself (W/m,
  // weighted) and of its form factor.
  [[nodiscard]] float WeakProbability(float transfer, float form_factor) const;

  // For random numbers of this pair of cells.
  [[nodiscard]] uint64_t Key() const;

 private:
  void FindItems();
  void FindPairs(ClusterPair pair);
  void FindGroups(ClusterPair pair);
  void SortItems();

  RefineOptions options_;
  RefineSide receiver_;
  RefineSide source_;
  std::vector<WorkItem> items_;
};

// A bound, from a point within `radius` of `middle`; 1 where that may touch.
float FormFactorOfGroup(const SourceGroup& group, Vec3f middle, float radius);

float LongestExtent(const Cluster& cluster);

}  // namespace enfilade
