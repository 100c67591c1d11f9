#include "visibility/visible_set.h"

#include "base/error.h"
#include "base/parallel.h"
#include "visibility/cell_explorer.h"
#include "visibility/portal_graph.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr const char* kSummaryMeta = "visibility";
constexpr size_t kCellsPerBatch = 8;

void PutAscending(const std::vector<CellId>& cells, ByteWriter& writer) {
  writer.PutVarint(cells.size());
  uint32_t last = 0;
  for (const CellId cell : cells) {
    writer.PutVarint(cell.value - last);
    last = cell.value;
  }
}

std::vector<CellId> GetAscending(ByteReader& reader) {
  const uint64_t count = reader.GetVarint();
  if (count > reader.Remaining()) {
    throw DamagedStoreError("a stored visible set ends too early");
  }
  std::vector<CellId> cells(count);
  uint32_t last = 0;
  for (CellId& cell : cells) {
    last += static_cast<uint32_t>(reader.GetVarint());
    cell = CellId(last);
  }
  return cells;
}

Bytes Encode(const VisibleSet& set) {
  ByteWriter writer;
  writer.PutVarint(set.size());
  for (const VisibleCell& v : set) {
    writer.PutVarint(v.source.value);
    PutAscending(v.between, writer);
  }
  return writer.Take();
}

VisibleSet Decode(const Bytes& bytes) {
  ByteReader reader(bytes);
  const uint64_t count = reader.GetVarint();
  VisibleSet set;
  for (uint64_t i = 0; i < count; ++i) {
    const CellId source(static_cast<uint32_t>(reader.GetVarint()));
    set.push_back({source, GetAscending(reader)});
  }
  return set;
}

uint64_t BytesOf(const VisibleSet& set) {
  uint64_t bytes = sizeof(VisibleSet);
  for (const VisibleCell& v : set) {
    bytes += sizeof(VisibleCell) + v.between.size() * sizeof(CellId);
  }
  return bytes;
}

// What each cell found by itself, kept in scratch blocks until all are known.
class OneSidedSets {
 public:
  explicit OneSidedSets(BlockStorage& store) : store_(&store) {}

  void Put(CellId cell, const VisibleSet& set) {
    store_->Put({BlockKind::kScratch, cell.value}, Encode(set));
  }

  // Read again or still in memory.
  std::shared_ptr<const VisibleSet> Get(CellId cell) {
    const auto found = cached_.find(cell);
    if (found != cached_.end()) {
      return found->second;
    }
    if (cached_bytes_ > kMaxCachedBytes) {
      cached_.clear();
      cached_bytes_ = 0;
    }
    auto set = std::make_shared<const VisibleSet>(
        Decode(store_->GetOrThrow({BlockKind::kScratch, cell.value})));
    cached_bytes_ += BytesOf(*set);
    cached_[cell] = set;
    return set;
  }

 private:
  static constexpr uint64_t kMaxCachedBytes = 4 << 20;

  BlockStorage* store_;
  std::map<CellId, std::shared_ptr<const VisibleSet>> cached_;
  uint64_t cached_bytes_ = 0;
};

// The cells that both ends found: each end's answer never leaves out what a
// ray can reach, so neither does what they have in common.
VisibleSet Agreed(CellId receiver, OneSidedSets& sets) {
  VisibleSet agreed;
  const auto mine = sets.Get(receiver);
  for (const VisibleCell& v : *mine) {
    const auto theirs = sets.Get(v.source);
    const auto back = std::lower_bound(
        theirs->begin(),
        theirs->end(),
        receiver,
        [](const VisibleCell& a, CellId cell) { return a.source < cell; });
    if (back == theirs->end() || back->source != receiver) {
      continue;
    }
    VisibleCell both{v.source, {}};
    std::set_intersection(v.between.begin(),
                          v.between.end(),
                          back->between.begin(),
                          back->between.end(),
                          std::back_inserter(both.between));
    agreed.push_back(std::move(both));
  }
  return agreed;
}

// Explores all cells, in parallel batches; counts cells with spent budgets.
uint64_t ExploreAll(const Partition& partition,
                    const VisibilityOptions& options,
                    OneSidedSets& sets) {
  const PortalGraph graph(partition);
  const size_t count = partition.cells.size();
  uint64_t spent = 0;
  for (size_t first = 0; first < count; first += kCellsPerBatch) {
    std::vector<Exploration> batch(std::min(kCellsPerBatch, count - first));
    ParallelFor(batch.size(), [&](size_t i) {
      batch[i] = ExploreFrom(
          CellId(first + i), partition, graph, options.max_steps_per_cell);
    });
    for (size_t i = 0; i < batch.size(); ++i) {
      VisibleSet set;
      for (SeenCell& seen : batch[i].seen) {
        set.push_back({seen.cell, std::move(seen.between)});
      }
      sets.Put(CellId(first + i), set);
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

VisibilitySummary BuildVisibleSets(const Partition& partition,
                                   const VisibilityOptions& options,
                                   BlockStorage& store) {
  store.EraseAll(BlockKind::kVisibleSet);
  store.EraseAll(BlockKind::kScratch);
  VisibilitySummary summary;
  OneSidedSets sets(store);
  summary.budget_spent_cells = ExploreAll(partition, options, sets);
  for (size_t i = 0; i < partition.cells.size(); ++i) {
    const CellId receiver(i);
    const VisibleSet agreed = Agreed(receiver, sets);
    summary.visible_pairs += agreed.size();
    store.Put({BlockKind::kVisibleSet, receiver.value}, Encode(agreed));
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

VisibilitySummary LoadVisibilitySummary(const BlockStorage& store) {
  std::istringstream text(store.Meta(kSummaryMeta).value_or(""));
  VisibilitySummary summary;
  if (!(text >> summary.visible_pairs >> summary.budget_spent_cells)) {
    throw DamagedStoreError("the store holds no visible sets");
  }
  return summary;
}

VisibleSet LoadVisibleSet(const BlockStorage& store, CellId receiver) {
  return Decode(store.GetOrThrow({BlockKind::kVisibleSet, receiver.value}));
}

}  // namespace enfilade
