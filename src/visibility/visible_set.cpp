#include "visibility/visible_set.h"

#include "base/error.h"
#include "base/parallel.h"
#include "partition/partition_store.h"
#include "visibility/beam_flood.h"
#include "visibility/cell_explorer.h"
#include "visibility/portal_graph.h"
#include "visibility/set_agreement.h"

#include <algorithm>
#include <functional>
#include <sstream>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr const char* kSummaryMeta = "visibility";
constexpr size_t kMostExploredAtOnce = 8;  // cells

// If the store has no regions, every cell is a region.
RegionGraph RegionGraphOf(size_t cells,
                          const PortalSource& portals,
                          const BlockStorage& store,
                          MemoryBudget& budget) {
  if (auto cell_of = LoadRegionCells(store)) {
    return {cells,
            std::move(*cell_of),
            [&store](const std::function<void(const Portal&)>& visit) {
              ForEachOpening(store, visit);
            },
            budget};
  }
  return {cells, FirstIds<CellId>(cells), portals, budget};
}

// The most memory that exploring a cell takes.
uint64_t ExplorationBytes(size_t cells,
                          const RegionGraph& regions,
                          uint32_t max_steps) {
  return BeamFlood::MostBytes(regions) + ReachedParts::BytesFor(cells) +
         BytesToNoteSeen(cells, max_steps);
}

// The number of cells to explore side by side. The result does not depend on
// it.
size_t CellsAtOnce(uint64_t bytes_each, const MemoryBudget& budget) {
  return std::clamp<uint64_t>(
      budget.FreeBytes() / 2 / std::max<uint64_t>(bytes_each, 1),
      1,
      kMostExploredAtOnce);
}

// Explores all cells in parallel batches and returns the number of cells whose
// steps were spent.
uint64_t ExploreAll(std::span<const CellInfo> cells,
                    const PortalGraph& graph,
                    const RegionGraph& regions,
                    const VisibilityOptions& options,
                    MemoryBudget& budget,
                    SetAgreement& sets) {
  const size_t count = cells.size();
  const uint64_t bytes_each =
      ExplorationBytes(count, regions, options.max_steps_per_cell);
  const size_t at_once = CellsAtOnce(bytes_each, budget);
  const MemoryCharge of_floods(
      budget, at_once * bytes_each, "looking through the doorways");
  uint64_t spent = 0;
  for (size_t first = 0; first < count; first += at_once) {
    std::vector<Exploration> batch(std::min(at_once, count - first));
    ParallelFor(batch.size(), [&](size_t i) {
      batch[i] = ExploreFrom(CellId(first + i),
                             cells,
                             graph,
                             regions,
                             options.max_steps_per_cell,
                             budget);
    });
    // The memory that floods have freed is still resident, and the pager, which
    // would otherwise check for that, is not running yet.
    if (budget.ResidentExcess() > 0) {
      ReleaseFreedMemory();
    }
    for (size_t i = 0; i < batch.size(); ++i) {
      sets.Put(CellId(first + i), batch[i].seen);
      if (batch[i].budget_spent) {
        ++spent;
      }
    }
    if (options.progress) {
      options.progress(0.9 * static_cast<double>(first + batch.size()) /
                       static_cast<double>(count));
    }
  }
  return spent;
}

}  // namespace

VisibilitySummary BuildVisibleSets(std::span<const CellInfo> cells,
                                   const PortalSource& portals,
                                   const VisibilityOptions& options,
                                   MemoryBudget& budget,
                                   BlockStorage& store) {
  store.EraseAll(BlockKind::kVisibleSet);
  store.EraseAll(BlockKind::kScratch);
  VisibilitySummary summary;
  SetAgreement sets(cells, budget, store);
  {
    const RegionGraph regions =
        RegionGraphOf(cells.size(), portals, store, budget);
    const PortalGraph graph(cells.size(), portals, budget);
    summary.budget_spent_cells =
        ExploreAll(cells, graph, regions, options, budget, sets);
  }
  sets.Agree();
  for (size_t i = 0; i < cells.size(); ++i) {
    summary.visible_pairs += sets.Finish(CellId(i));
  }
  store.EraseAll(BlockKind::kScratch);
  store.SetMeta(
      kSummaryMeta,
      fmt::format("{} {}", summary.visible_pairs, summary.budget_spent_cells));
  if (options.progress) {
    options.progress(1);
  }
  return summary;
}

VisibilitySummary BuildVisibleSets(const Partition& partition,
                                   const VisibilityOptions& options,
                                   MemoryBudget& budget,
                                   BlockStorage& store) {
  const auto portals = [&](const std::function<void(const Portal&)>& visit) {
    std::for_each(partition.portals.begin(), partition.portals.end(), visit);
  };
  return BuildVisibleSets(partition.cells, portals, options, budget, store);
}

VisibilitySummary LoadVisibilitySummary(const BlockStorage& store) {
  std::istringstream text(store.Meta(kSummaryMeta).value_or(""));
  VisibilitySummary summary;
  if (!(text >> summary.visible_pairs >> summary.budget_spent_cells)) {
    ThrowDamaged(store, "holds no visible sets");
  }
  return summary;
}

uint64_t BytesOf(const VisibleSet& set) {
  size_t between = 0;
  for (const VisibleCell& visible : set) {
    between += visible.between.size();
  }
  return VisibleSetBytes(set.size(), between);
}

uint64_t VisibleSetBytes(size_t sources, size_t between) {
  return sources * (sizeof(VisibleCell) + kAllocationHeaderBytes) +
         between * sizeof(CellId);
}

std::vector<CellId> LoadVisibleSources(const BlockStorage& store,
                                       CellId receiver) {
  return ReadBlock(
      store, {BlockKind::kVisibleSet, receiver.value}, [](ByteReader& in) {
        return DecodeVisibleSources(in.TakeRest());
      });
}

VisibleSet LoadVisibleSet(const BlockStorage& store,
                          CellId receiver,
                          const std::function<void(uint64_t)>& reserve) {
  return ReadBlock(
      store, {BlockKind::kVisibleSet, receiver.value}, [&](ByteReader& in) {
        return DecodeVisibleSet(in.TakeRest(), reserve);
      });
}

}  // namespace enfilade
