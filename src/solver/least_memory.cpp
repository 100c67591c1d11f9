#include "solver/least_memory.h"

#include "base/error.h"
#include "partition/partition.h"
#include "solver/access_trace.h"
#include "solver/cell_care.h"
#include "solver/cell_pager.h"
#include "solver/cluster_tree.h"
#include "solver/element_tree.h"
#include "solver/held_gain.h"
#include "solver/next_use.h"
#include "solver/received_light.h"
#include "solver/source_weights.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <vector>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Cells between two others that should stay in memory.
constexpr size_t kKeptBetween = 8;

// Bytes of one cell.
struct CellNeed {
  uint64_t geometry = 0;
  uint64_t tree = 0;
  uint64_t received = 0;  // needed in its own turn
  uint64_t balance = 0;   // working arrays of its equilibrium
  uint64_t clusters = 0;  // of its receiving elements
  uint64_t weights = 0;   // what it sends at most
  uint64_t care = 0;      // of its patches
  uint64_t blockers = 0;  // for shafts and rays
  uint64_t build = 0;     // on top of the blockers, while they are built
};

class NeedFinder {
 public:
  NeedFinder(const BlockStorage& store, const SolveOptions& options)
      : store_(&store),
        basis_(BasisNamed(options.basis)),
        shape_{&basis_, kRgbChannels},
        partition_(LoadPartition(store)),
        has_trees_(store.Count(BlockKind::kCellTree) > 0) {}

  LeastMemory Find() {
    MeasureCells();
    for (size_t i = 0; i < needs_.size(); ++i) {
      LookAt(CellId(i));
    }
    least_.budget_bytes +=
        kSolveWorkspaceBytes +
        NextUse::BytesFor(needs_.size(),
                          LoadVisibilitySummary(*store_).visible_pairs);
    // The record of what is read has a share of it all, itself included.
    const uint64_t share = AccessTrace::OwnBytesUnder(least_.budget_bytes);
    least_.budget_bytes += share + AccessTrace::OwnBytesUnder(2 * share);
    least_.cap_bytes = MemoryBudget::CapForBudget(least_.budget_bytes);
    return least_;
  }

 private:
  void MeasureCells() {
    std::vector<size_t> portal_triangles(partition_.cells.size());
    for (const Portal& portal : partition_.portals) {
      const size_t triangles = portal.vertices.size() - 2;
      portal_triangles[portal.front.Index()] += triangles;
      portal_triangles[portal.back.Index()] += triangles;
    }
    needs_.reserve(partition_.cells.size());
    for (size_t i = 0; i < partition_.cells.size(); ++i) {
      needs_.push_back(NeedOf(CellId(i), portal_triangles[i]));
    }
  }

  CellNeed NeedOf(CellId cell, size_t portal_triangles) const {
    const CellPatches stored = LoadCellPatches(*store_, cell);
    const size_t patches = stored.patches.size();
    const size_t blockers = BlockerCount(stored);
    const size_t grown =
        patches == 0
            ? 0
            : kTreeExtra + static_cast<size_t>(kTreeGrowth *
                                               static_cast<double>(patches));
    // A tree that is there already may have grown further.
    const size_t elements =
        std::max(grown, has_trees_ ? CellTree::StoredSize(*store_, cell) : 0);
    CellNeed need;
    need.geometry = CellGeometry::BytesFor(patches, portal_triangles);
    need.tree = CellTree::BytesFor(elements, shape_);
    need.received = ReceivedLight::BytesFor(elements, shape_);
    // The delta, or the step in its place (cell_balance.h).
    need.balance = CoefficientArray::BytesFor(elements, shape_.Stride()) +
                   HeldSharesBytesFor(elements, shape_);
    need.clusters = ClusterTree::BytesFor(patches);
    need.weights = SourceWeights::BytesFor(patches);
    need.care = patches * sizeof(PatchCare);
    const uint64_t held = BlockersHeldBytes(blockers);
    need.blockers = ShaftBlockers::BytesFor(blockers) + held;
    need.build = std::max(BlockersBuildBytes(blockers) - held,
                          blockers * sizeof(PatchGeometry));
    return need;
  }

  void LookAt(CellId receiver) {
    const CellNeed& r = needs_[receiver.Index()];
    const VisibleSet visible = LoadVisibleSet(*store_, receiver);
    const uint64_t own = r.geometry + r.tree + r.received + BytesOf(visible);
    Consider(own + r.balance + r.weights, {receiver, {receiver}}, receiver);
    const uint64_t refined = own + r.care + kRefineWorkspaceBytes;
    Consider(refined + r.blockers + std::max(r.build, r.clusters),
             {receiver, {receiver}},
             receiver);
    for (const VisibleCell& v : visible) {
      Consider(refined + r.clusters + PairNeed(receiver, v), v, receiver);
    }
  }

  // On top of what the receiver needs. Of the cells between, both ends are held
  // and the others paged in one after the other; but some of these must stay,
  // or every ray would build them anew.
  [[nodiscard]] uint64_t PairNeed(CellId receiver, const VisibleCell& v) const {
    uint64_t bytes = needs_[v.source.Index()].weights;
    uint64_t build = 0;
    if (v.source != receiver) {
      const CellNeed& s = needs_[v.source.Index()];
      bytes += s.geometry + s.tree;
    }
    std::vector<uint64_t> inner;
    for (const CellId cell : v.between) {
      const CellNeed& b = needs_[cell.Index()];
      build = std::max(build, b.build);
      if (cell == receiver || cell == v.source) {
        bytes += b.blockers;
      } else {
        inner.push_back(b.blockers);
      }
    }
    const size_t kept = std::min(kKeptBetween, inner.size());
    std::partial_sort(inner.begin(),
                      inner.begin() + static_cast<std::ptrdiff_t>(kept),
                      inner.end(),
                      std::greater<>());
    return std::accumulate(inner.begin(),
                           inner.begin() + static_cast<std::ptrdiff_t>(kept),
                           bytes + build);
  }

  void Consider(uint64_t bytes, const VisibleCell& pair, CellId receiver) {
    if (bytes > least_.budget_bytes) {
      least_.budget_bytes = bytes;
      least_.receiver = receiver;
      least_.source = pair.source;
      least_.cells_between = pair.between.size();
    }
  }

  const BlockStorage* store_;
  Basis basis_;
  TreeShape shape_;
  Partition partition_;
  bool has_trees_;
  std::vector<CellNeed> needs_;  // by CellId
  LeastMemory least_;
};

}  // namespace

LeastMemory FindLeastMemory(const BlockStorage& store,
                            const SolveOptions& options) {
  return NeedFinder(store, options).Find();
}

void RequireLeastMemory(const BlockStorage& store,
                        const SolveOptions& options,
                        const MemoryBudget& budget) {
  const LeastMemory least = FindLeastMemory(store, options);
  if (least.budget_bytes <= budget.LimitBytes()) {
    return;
  }
  std::string part = fmt::format("cell {}", least.receiver.value);
  if (least.source != least.receiver) {
    part = fmt::format("{} and cell {}", part, least.source.value);
  }
  if (least.cells_between > 2) {
    part = fmt::format("{} with what stands in the largest of {} cells between",
                       part,
                       least.cells_between - 2);
  }
  throw DoesNotFitError(fmt::format(
      "the solve needs at least {}M: so much must be in memory at once for {}; "
      "run again, or go on with 'enfilade resume', with --memory {}M",
      least.cap_bytes >> 20,
      part,
      least.cap_bytes >> 20));
}

}  // namespace enfilade
