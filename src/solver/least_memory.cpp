#include "solver/least_memory.h"

#include "base/error.h"
#include "base/stop.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "solver/elements/cell_care.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/received_light.h"
#include "solver/paging/access_trace.h"
#include "solver/paging/cell_pager.h"
#include "solver/paging/next_use.h"
#include "solver/refine/source_weights.h"
#include "solver/residual/residual_check.h"
#include "solver/state/held_gain.h"
#include "solver/transfer/cluster_tree.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Elements per patch at the end of a solve with basis M2 at error
// kErrorOfGrowth, in cells with lamps and in other cells. The number grows with
// the power kGrowthPerError of the inverse error; constant bases have
// kHaarGrowth times as many (docs/decisions/least-memory.md).
constexpr double kWithLamps = 40;
constexpr double kWithoutLamps = 25;
constexpr double kErrorOfGrowth = 0.1;
constexpr double kGrowthPerError = 1.7;
constexpr double kHaarGrowth = 3;

// Receivers of a cell. Measured at errors 0.1 and 0.05: up to 5.7 per patch in
// small cells of floors, 1.5 in large ones, 3.4 among 36 chairs.
constexpr size_t kReceivers = 1000;
constexpr size_t kReceiversPerPatch = 3;

// The number of cells between two others whose blockers should stay in memory.
constexpr size_t kKeptBetween = 8;

// What the store has of one cell, whatever the solve asks for.
struct CellSize {
  size_t patches = 0;
  size_t lamps = 0;  // emitting patches
  size_t blockers = 0;
  size_t portal_triangles = 0;
  size_t elements = 0;  // of the tree; 0 if there is none
};

// Bytes of one cell.
struct CellNeed {
  uint64_t geometry = 0;
  uint64_t tree = 0;
  uint64_t received = 0;  // needed only in the cell's own turn
  uint64_t balance = 0;   // working arrays of its balance
  uint64_t clusters = 0;  // of its receiving elements
  uint64_t weights = 0;   // bounds of what it sends
  uint64_t care = 0;      // of its patches
  uint64_t blockers = 0;  // for shafts and rays
  uint64_t build = 0;     // in addition, while the blockers are built
};

// What a solve needs if trees grow as given.
struct Need {
  TreeGrowth growth;
  std::vector<CellNeed> cells;  // by CellId
  LeastMemory least;
};

class NeedFinder {
 public:
  NeedFinder(const BlockStorage& store,
             const SolveOptions& options,
             MemoryBudget& budget)
      : store_(&store),
        budget_(&budget),
        basis_(BasisNamed(options.basis)),
        shape_{&basis_, kRgbChannels},
        first_{kFirstGrowth, {}, {}},
        last_{LastGrowth(options), {}, {}} {
    const size_t cells = LoadCells(store).size();
    charge_ = MemoryCharge(budget,
                           cells * (sizeof(CellSize) + 2 * sizeof(CellNeed)),
                           "what each cell needs");
    sizes_.resize(cells);
  }

  LeastMemories Find() {
    MeasureCells();
    for (Need* need : {&first_, &last_}) {
      need->cells.reserve(sizes_.size());
      for (const CellSize& size : sizes_) {
        need->cells.push_back(NeedOf(size, need->growth));
      }
    }
    for (size_t i = 0; i < sizes_.size(); ++i) {
      LookAt(CellId(i));
    }
    for (Need* need : {&first_, &last_}) {
      ConsiderRays(need);
      AddWhatStays(&need->least);
    }
    return {first_.least, last_.least};
  }

 private:
  void MeasureCells() {
    ForEachPortal(*store_, [&](const Portal& portal) {
      const size_t triangles = portal.vertices.size() - 2;
      sizes_.at(portal.front.Index()).portal_triangles += triangles;
      sizes_.at(portal.back.Index()).portal_triangles += triangles;
      portal_bytes_ += BytesOf(portal);
    });
    const bool has_trees = store_->Count(BlockKind::kCellTree) > 0;
    for (size_t i = 0; i < sizes_.size(); ++i) {
      ThrowIfStopRequested();
      const CellPatches stored = LoadCellPatches(*store_, CellId(i));
      CellSize& size = sizes_[i];
      size.patches = stored.patches.size();
      size.lamps = static_cast<size_t>(std::count_if(
          stored.patches.begin(), stored.patches.end(), [](const Patch& patch) {
            return patch.emits;
          }));
      size.blockers = BlockerCount(stored);
      size.elements = has_trees ? CellTree::StoredSize(*store_, CellId(i)) : 0;
      patches_ += size.patches;
      lamps_ += size.lamps;
    }
  }

  [[nodiscard]] CellNeed NeedOf(const CellSize& size,
                                const TreeGrowth& growth) const {
    const size_t patches = size.patches;
    const size_t blockers = size.blockers;
    // A tree that the store already has may be larger.
    const size_t elements = std::max(GrownSize(size, growth), size.elements);
    const size_t receivers = std::clamp(
        elements, patches, kReceivers + kReceiversPerPatch * patches);
    CellNeed need;
    need.geometry = CellGeometry::BytesFor(patches, size.portal_triangles);
    need.tree = CellTree::BytesFor(elements, shape_);
    need.received = ReceivedLight::BytesFor(elements, shape_);
    // The delta, or the step that replaces it during a cycle (cell_balance.h).
    need.balance = CoefficientArray::BytesFor(elements, shape_.Stride()) +
                   HeldSharesBytesFor(elements, shape_);
    need.clusters =
        ClusterTree::BytesFor(receivers) + receivers * sizeof(float);
    need.weights = SourceWeights::BytesFor(patches);
    need.care = patches * sizeof(PatchCare);
    const uint64_t held = BlockersHeldBytes(blockers);
    need.blockers = ShaftBlockers::BytesFor(blockers) + held;
    need.build = std::max(BlockersBuildBytes(blockers) - held,
                          blockers * sizeof(PatchGeometry));
    return need;
  }

  static size_t GrownSize(const CellSize& size, const TreeGrowth& growth) {
    if (size.patches == 0) {
      return 0;
    }
    const double per_patch =
        size.lamps > 0 ? growth.with_lamps : growth.without_lamps;
    return static_cast<size_t>(growth.extra +
                               per_patch * static_cast<double>(size.patches));
  }

  void LookAt(CellId receiver) {
    ThrowIfStopRequested();
    MemoryCharge charge;
    const VisibleSet visible =
        LoadVisibleSet(*store_, receiver, [&](uint64_t bytes) {
          charge = MemoryCharge(*budget_, bytes, "what a cell sees");
        });
    for (Need* need : {&first_, &last_}) {
      ConsiderReceiver(receiver, visible, need);
    }
  }

  static void ConsiderReceiver(CellId receiver,
                               const VisibleSet& visible,
                               Need* need) {
    LeastMemory* least = &need->least;
    const CellNeed& r = need->cells[receiver.Index()];
    const uint64_t own = r.geometry + r.tree + r.received + BytesOf(visible);
    const VisibleCell alone{receiver, {receiver}};
    Consider(own + r.balance + r.weights, alone, receiver, least);
    const uint64_t refined = own + r.care + kRefineWorkspaceBytes;
    Consider(refined + r.blockers + std::max(r.build, r.clusters),
             alone,
             receiver,
             least);
    for (const VisibleCell& v : visible) {
      Consider(refined + r.clusters + PairNeed(receiver, v, need->cells),
               v,
               receiver,
               least);
    }
  }

  // Bytes needed in addition to those of the receiver. Of the cells between,
  // the blockers of both ends are held, and those of the others are paged in
  // one after the other. The kKeptBetween largest of the others must stay, or
  // every ray would build them anew.
  static uint64_t PairNeed(CellId receiver,
                           const VisibleCell& v,
                           const std::vector<CellNeed>& needs) {
    uint64_t bytes = needs[v.source.Index()].weights;
    uint64_t build = 0;
    if (v.source != receiver) {
      const CellNeed& s = needs[v.source.Index()];
      bytes += s.geometry + s.tree;
    }
    std::vector<uint64_t> inner;
    for (const CellId cell : v.between) {
      const CellNeed& b = needs[cell.Index()];
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

  // The rays after each round need one cell in memory at a time.
  void ConsiderRays(Need* need) const {
    constexpr double kLinksPerElement = 6;  // seen: 5.5 (floors), 8 (chairs)
    const double links = kLinksPerElement * need->growth.without_lamps *
                         static_cast<double>(patches_);
    uint64_t cell = 0;
    for (const CellNeed& c : need->cells) {
      cell = std::max(cell, c.geometry + c.tree + c.received);
    }
    const uint64_t bytes =
        cell +
        LeastResidualBytes(need->cells.size(),
                           patches_,
                           lamps_,
                           MostResidualRays(static_cast<uint64_t>(links)));
    if (bytes > need->least.budget_bytes) {
      need->least.budget_bytes = bytes;
      need->least.is_of_rays = true;
    }
  }

  // What is in memory whichever subproblem is solved.
  void AddWhatStays(LeastMemory* least) const {
    least->budget_bytes +=
        kSolveWorkspaceBytes + portal_bytes_ +
        kSceneCopies * BytesOf(LoadSceneInfo(*store_)) +
        sizes_.size() * kSolveBytesPerCell +
        PairTable::BytesFor(sizes_.size(),
                            LoadVisibilitySummary(*store_).visible_pairs);
    // The access trace takes a share of the whole budget, the trace included.
    const uint64_t share = AccessTrace::OwnBytesUnder(least->budget_bytes);
    least->budget_bytes += share + AccessTrace::OwnBytesUnder(2 * share);
    least->cap_bytes = MemoryBudget::CapForBudget(least->budget_bytes);
  }

  static void Consider(uint64_t bytes,
                       const VisibleCell& pair,
                       CellId receiver,
                       LeastMemory* least) {
    if (bytes > least->budget_bytes) {
      least->budget_bytes = bytes;
      least->receiver = receiver;
      least->source = pair.source;
      least->cells_between = pair.between.size();
    }
  }

  const BlockStorage* store_;
  MemoryBudget* budget_;
  MemoryCharge charge_;
  Basis basis_;
  TreeShape shape_;
  std::vector<CellSize> sizes_;  // by CellId
  Need first_;
  Need last_;
  uint64_t portal_bytes_ = 0;
  // Sums over all cells.
  size_t patches_ = 0;
  size_t lamps_ = 0;
};

}  // namespace

TreeGrowth LastGrowth(const SolveOptions& options) {
  const double finer =
      std::pow(kErrorOfGrowth / options.error, kGrowthPerError) *
      (options.basis == "haar" ? kHaarGrowth : 1);
  const auto at_least_first = [&](double first, double last) {
    return std::max(first, last * finer);
  };
  return {at_least_first(kFirstGrowth.with_lamps, kWithLamps),
          at_least_first(kFirstGrowth.without_lamps, kWithoutLamps),
          kFirstGrowth.extra};
}

LeastMemories FindLeastMemory(const BlockStorage& store,
                              const SolveOptions& options,
                              MemoryBudget& budget) {
  return NeedFinder(store, options, budget).Find();
}

void RequireLeastMemory(const BlockStorage& store,
                        const SolveOptions& options,
                        MemoryBudget& budget) {
  const auto [first, last] = FindLeastMemory(store, options, budget);
  const uint64_t cap = last.cap_bytes >> 20;
  if (first.budget_bytes <= budget.LimitBytes()) {
    if (last.budget_bytes > budget.LimitBytes() && options.may_not_fit) {
      options.may_not_fit(last.cap_bytes);
    }
    return;
  }
  std::string part = fmt::format("cell {}", first.receiver.value);
  if (first.source != first.receiver) {
    part = fmt::format("{} and cell {}", part, first.source.value);
  }
  if (first.cells_between > 2) {
    part = fmt::format("{} with what stands in the largest of {} cells between",
                       part,
                       first.cells_between - 2);
  }
  if (first.is_of_rays) {
    part = "the rays that measure the error";
  }
  std::string later;
  if (last.cap_bytes > first.cap_bytes) {
    later = fmt::format(
        " to begin, and some {}M to end at error {}, when "
        "there are more elements",
        cap,
        options.error);
  }
  throw DoesNotFitError(fmt::format(
      "the solve needs at least {}M{}: so much must be in memory at once for "
      "{}; run again, or go on with 'enfilade resume', with --memory {}M",
      first.cap_bytes >> 20,
      later,
      part,
      cap));
}

}  // namespace enfilade
