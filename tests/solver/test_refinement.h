// Cells to be linked, and what stands between them.

#pragma once

#include "base/memory.h"
#include "base/parallel.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/received_light.h"
#include "solver/refine/apply_links.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/refine_receiver.h"
#include "solver/refine/refine_source.h"
#include "solver/refine/refiner.h"
#include "solver/refine/source_weights.h"
#include "solver/transfer/blockers.h"
#include "solver/transfer/cluster_tree.h"
#include "solver/transfer/shaft.h"
#include "visibility/occlusion.h"

#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade::test {

inline constexpr double kReflectance = 0.5;

struct SourceAndTree : RefineSource {
  const CellTree* tree = nullptr;
};

// A cell that sends 1 W/m2 from everywhere.
class BrightCell {
 public:
  BrightCell(uint32_t id, const Basis& basis, const std::vector<Patch>& patches)
      : id_(id),
        geometry_(GeometryOf(patches, kReflectance)),
        tree_({&basis, kRgbChannels}, geometry_),
        received_(tree_.Shape()),
        clusters_(geometry_, WholePatches(geometry_.size())) {
    for (size_t i = 0; i < tree_.Size(); ++i) {
      for (float& b : tree_.Sent()[ElementId(i)]) {
        b = 1;
      }
    }
    tree_.UpdateDetail();
    weights_ = WeighReceiver(
        {.id = CellId(id_), .patches = geometry_, .clusters = &clusters_});
  }

  [[nodiscard]] RefineReceiver Receiver() const {
    return {.id = CellId(id_),
            .patches = geometry_,
            .clusters = &clusters_,
            .weights = weights_};
  }

  // The cell as it sends light now, with the given groups.
  [[nodiscard]] SourceAndTree Source(
      const SourceGroups* groups = nullptr) const {
    SourceAndTree source{{.id = CellId(id_),
                          .patches = geometry_,
                          .clusters = &clusters_,
                          .groups = groups},
                         &tree_};
    source.sent = &sent_.emplace_back(WeighSource(source, tree_));
    return source;
  }

  [[nodiscard]] const std::vector<PatchGeometry>& Geometry() const {
    return geometry_;
  }

  CellTree& Tree() { return tree_; }

  ReceivedLight& Received() { return received_; }

  // Applies links of the cell with itself.
  void Link(const RawLinks& raw, LinkBlock* block) {
    const GrowingSide side{geometry_, &tree_};
    ApplyLinks(raw, side, side, &received_, block);
  }

 private:
  uint32_t id_;
  std::vector<PatchGeometry> geometry_;
  CellTree tree_;
  ReceivedLight received_;
  ClusterTree clusters_;
  std::vector<float> weights_;
  mutable std::deque<SourceWeights> sent_;  // of all sources
};

inline Refiner MakeRefiner(const RefineOptions& options,
                           const RefineReceiver& receiver,
                           const SourceAndTree& source,
                           const Blockers& blockers) {
  return {PairWork(options, receiver, source), *source.tree, blockers};
}

// Blockers as rays and shafts see them.
class Scenery {
 public:
  explicit Scenery(std::vector<Patch> patches)
      : budget_(1ULL << 30),
        device_(budget_, Point3{}),
        shaft_(GeometryOf(patches)) {
    CellPatches cell;
    cell.bounds = {{-100, -100, -100}, {100, 100, 100}};
    cell.patches = std::move(patches);
    ray_blockers_ = device_.Build(cell);
    blockers_.rays = {ray_blockers_.get()};
    blockers_.shafts = {&shaft_};
  }

  [[nodiscard]] const Blockers& All() const { return blockers_; }

 private:
  MemoryBudget budget_;
  OcclusionDevice device_;
  std::shared_ptr<const RayBlockers> ray_blockers_;
  ShaftBlockers shaft_;
  Blockers blockers_;
};

inline std::vector<Patch> FurnishedRoom() {
  std::vector<Patch> patches = BoxPatches(kRoom, true);
  Append(patches, BoxPatches({{1, 1, 0}, {1.6, 1.5, 0.8}}, false));
  Append(patches, BoxPatches({{2.5, 3, 0.4}, {3, 4.2, 0.5}}, false));
  return patches;
}

// The link without the index of its shape, which counts the shapes of one part.
inline RawLink WithoutPlace(RawLink link) {
  link.more = link.kind == LinkKind::kShaped ? 0 : link.more;
  return link;
}

inline void ExpectSame(const RawLink& a, const RawLink& b) {
  EXPECT_EQ(a.receiver_patch, b.receiver_patch);
  EXPECT_EQ(a.receiver_path, b.receiver_path);
  EXPECT_EQ(a.source_patch, b.source_patch);
  EXPECT_EQ(a.source_path, b.source_path);
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.value, b.value);
  EXPECT_EQ(a.more, b.more);
  EXPECT_EQ(a.gain, b.gain);
}

// The links of all items of work.
inline std::vector<RawLinks> RefineAll(const RefineOptions& options,
                                       const RefineReceiver& receiver,
                                       const SourceAndTree& source,
                                       const Blockers& blockers) {
  const Refiner refiner = MakeRefiner(options, receiver, source, blockers);
  std::vector<RawLinks> links(refiner.ItemCount());
  ParallelFor(links.size(),
              [&](size_t i) { refiner.Refine({.item = i}, {}, &links[i]); });
  return links;
}

// The mean gain over a receiver that is a parallelogram.
inline double MeanGain(const RawLink& link) {
  double sum = 0;
  for (const float g : link.gain) {
    sum += static_cast<double>(g) / kTransferNodes;
  }
  return sum;
}

// A parallelogram as n x n patches.
inline std::vector<Patch> Tiled(const Patch& whole, int n) {
  std::vector<Patch> tiles;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      Patch p = whole;
      p.u = whole.u / n;
      p.v = whole.v / n;
      p.origin = whole.origin + p.u * i + p.v * j;
      tiles.push_back(p);
    }
  }
  return tiles;
}

// Squares of 1 m that face each other.
inline Patch Floor() {
  return Rectangle(Point3{}, {1, 0, 0}, {0, 1, 0});
}

inline Patch Ceiling(double height) {
  return Rectangle({0, 0, height}, {0, 1, 0}, {1, 0, 0});
}

struct RefinedPart {
  WorkPart work;
  RawLinks out;
};

// All parts in their order, one by one, cut until none has more than `most`
// links.
inline std::vector<RefinedPart> RefineInParts(const Refiner& refiner,
                                              size_t most) {
  std::vector<RefinedPart> parts;
  for (WorkPart next; next.item < refiner.ItemCount();) {
    RawLinks links;
    refiner.Refine(next, {most}, &links);
    if (links.overflowed) {
      next = next.Narrowed();
    } else {
      parts.push_back({next, std::move(links)});
      next = next.Next();
    }
  }
  return parts;
}

}  // namespace enfilade::test
