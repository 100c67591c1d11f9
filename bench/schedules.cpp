// Measures how much the order of the cell pairs matters: the bytes that the
// best possible cache reads in one sweep over a solved store, for several
// orders of the receivers and of the sources of each receiver, and the
// compulsory bytes, which any order reads.
//
//   bench_schedules [--json FILE] [--memory MIB] STORE...
//
// For each pair, a sweep of propagation needs the trees and the geometry of the
// two cells and the received light of the receiver. A sweep of refinement also
// needs the blockers of the cells between the two, one cell after the other.
// Sizes in memory are the solver's own estimates; sizes read are those of the
// store's frames. Every order reads the link chunks once in a sweep, so that
// they are counted separately; the chunks within a cell are read again in each
// step of the cell's balance. With --memory, the budget of that cap is measured
// as a further capacity. See docs/decisions/schedules.md.

#include "base/memory.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/received_light.h"
#include "solver/least_memory.h"
#include "solver/links/link_block.h"
#include "solver/paging/cell_pager.h"
#include "solver/state/solve_state.h"
#include "store/sqlite_store.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/cell_orders.h"
#include "bench/step_cache.h"
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

// The capacities are the memory of all cells divided by these.
constexpr std::array<uint64_t, 5> kParts = {2, 4, 8, 20, 100};
// Steps of the balance within a cell; each step reads the cell's inner links.
constexpr int kBalanceSteps = 8;

enum class Sweep { kPropagate, kRefine };
enum class SourceOrder { kAsReceivers, kBackAndForth, kSharedOutside };

// The items of the cache are first these parts of each cell, then the chunks of
// links.
enum class Part : uint32_t { kTree, kReceived, kGeometry, kBlockers };
constexpr uint32_t kPartsOfCell = 4;

uint32_t ItemOf(uint32_t cell, Part part) {
  return kPartsOfCell * cell + static_cast<uint32_t>(part);
}

struct Building {
  std::vector<OrderedCell> cells;
  std::vector<VisibleSet> visible;
  std::vector<CacheItem> items;
  std::map<std::pair<uint32_t, uint32_t>, std::vector<uint32_t>> chunks;
  uint64_t pairs = 0;
  CacheItem links;
};

// The content of a block, and the bytes that were read for it.
std::pair<Bytes, uint64_t> Read(const BlockStorage& store,
                                const BlockKey& key) {
  const uint64_t before = store.Stats().bytes_read;
  Bytes content = store.GetOrThrow(key);
  return {std::move(content), store.Stats().bytes_read - before};
}

void LoadCells(const BlockStorage& store, Building* b) {
  SolveState state;
  if (!LoadSolveState(store, &state)) {
    throw InputError("the store is not solved");
  }
  const Basis basis(BasisNamed(state.basis));
  const TreeShape shape{&basis, kRgbChannels};
  const Partition partition = LoadPartition(store);
  std::vector<size_t> portal_triangles(partition.cells.size(), 0);
  for (const Portal& portal : partition.portals) {
    for (const CellId cell : {portal.front, portal.back}) {
      portal_triangles[cell.Index()] += portal.vertices.size() - 2;
    }
  }
  for (uint32_t i = 0; i < partition.cells.size(); ++i) {
    const CellInfo& info = partition.cells[i];
    const size_t elements = CellTree::StoredSize(store, CellId(i));
    const uint64_t tree = CellTree::BytesFor(elements, shape);
    const uint64_t received = ReceivedLight::BytesFor(elements, shape);
    const uint64_t geometry =
        CellGeometry::BytesFor(info.patches, portal_triangles[i]);
    const uint64_t patches = Read(store, {BlockKind::kCellPatches, i}).second;
    b->items.push_back({tree, 0});
    b->items.push_back({received, 0});
    b->items.push_back({geometry, patches});
    b->items.push_back({ShaftBlockers::BytesFor(info.patches) +
                            BlockersHeldBytes(info.patches),
                        patches});
    b->visible.push_back(LoadVisibleSet(store, CellId(i)));
    b->pairs += b->visible.back().size();
    OrderedCell cell{info.bounds.Center(), {}, tree + received + geometry};
    for (const VisibleCell& v : b->visible.back()) {
      cell.sees.push_back(v.source.value);
    }
    b->cells.push_back(std::move(cell));
  }
  const auto add_stored = [&](BlockKind kind, Part part) {
    store.ForEachKey(kind, [&](const BlockKey& key) {
      b->items[ItemOf(key.a, part)].stored_bytes += Read(store, key).second;
    });
  };
  add_stored(BlockKind::kCellTree, Part::kTree);
  add_stored(BlockKind::kReceived, Part::kReceived);
}

void LoadLinks(const BlockStorage& store, Building* b) {
  constexpr size_t kAny = std::numeric_limits<uint32_t>::max();
  store.ForEachKey(BlockKind::kLinks, [&](const BlockKey& key) {
    const auto [content, stored] = Read(store, key);
    const uint64_t held = DecodeLinks(content, {kAny, kAny, kAny}).SizeBytes();
    b->chunks[{key.a, key.b}].push_back(static_cast<uint32_t>(b->items.size()));
    b->items.push_back({held, stored});
    b->links.held_bytes += held;
    b->links.stored_bytes += stored;
  });
}

Building LoadBuilding(const std::string& path) {
  const auto store = OpenStore(path, StoreAccess::kRead);
  Building building;
  LoadCells(*store, &building);
  LoadLinks(*store, &building);
  return building;
}

// -------------------------------------------------------------- the sequence

// The sources of the receiver at `turn` in the order of `sources`; the receiver
// itself comes last.
std::vector<const VisibleCell*> SourcesOf(const Building& b,
                                          const CellOrder& order,
                                          size_t turn,
                                          SourceOrder sources) {
  std::vector<uint32_t> rank(order.size());
  for (uint32_t i = 0; i < order.size(); ++i) {
    rank[order[i]] = i;
  }
  const auto is_seen_at = [&](uint32_t cell, size_t at) {
    const auto& sees = b.cells[order[at]].sees;
    return std::binary_search(sees.begin(), sees.end(), cell);
  };
  // With kSharedOutside, the sources that the previous receiver also sees come
  // first, and those that the next receiver also sees come last.
  const auto place = [&](uint32_t cell) -> int64_t {
    const auto n = static_cast<int64_t>(order.size());
    int64_t at = rank[cell];
    if (sources == SourceOrder::kBackAndForth && turn % 2 == 1) {
      at = n - at;
    } else if (sources == SourceOrder::kSharedOutside) {
      at -= turn > 0 && is_seen_at(cell, turn - 1) ? n : 0;
      at += turn + 1 < order.size() && is_seen_at(cell, turn + 1) ? n : 0;
    }
    return cell == order[turn] ? std::numeric_limits<int64_t>::max() : at;
  };
  std::vector<std::pair<int64_t, const VisibleCell*>> placed;
  for (const VisibleCell& v : b.visible[order[turn]]) {
    placed.emplace_back(place(v.source.value), &v);
  }
  std::sort(placed.begin(), placed.end());
  std::vector<const VisibleCell*> result;
  result.reserve(placed.size());
  for (const auto& [at, v] : placed) {
    result.push_back(v);
  }
  return result;
}

std::vector<uint32_t> ItemsOfPair(uint32_t receiver, uint32_t source) {
  std::vector<uint32_t> items = {ItemOf(receiver, Part::kTree),
                                 ItemOf(receiver, Part::kReceived),
                                 ItemOf(receiver, Part::kGeometry)};
  if (source != receiver) {
    items.push_back(ItemOf(source, Part::kTree));
    items.push_back(ItemOf(source, Part::kGeometry));
  }
  return items;
}

struct Schedule {
  CellOrder order;
  SourceOrder sources = SourceOrder::kAsReceivers;
  bool only_linked = false;  // leaves out pairs without links
};

// Adds a step for the pair, and then one for the pair and each of `others`.
void AddPair(uint32_t receiver,
             uint32_t source,
             std::span<const uint32_t> others,
             Steps* steps) {
  std::vector<uint32_t> items = ItemsOfPair(receiver, source);
  steps->Add(items);
  items.push_back(0);
  for (const uint32_t other : others) {
    items.back() = other;
    steps->Add(items);
  }
}

// The blockers of the cells between the two cells of a pair, if the sweep needs
// them.
std::vector<uint32_t> BlockersOf(const VisibleCell& v, Sweep sweep) {
  std::vector<uint32_t> blockers;
  blockers.reserve(v.between.size());
  for (const CellId cell : v.between) {
    blockers.push_back(ItemOf(cell.value, Part::kBlockers));
  }
  return sweep == Sweep::kRefine ? blockers : std::vector<uint32_t>();
}

Steps StepsOf(const Building& b, const Schedule& s, Sweep sweep) {
  Steps steps;
  for (size_t turn = 0; turn < s.order.size(); ++turn) {
    const uint32_t receiver = s.order[turn];
    for (const VisibleCell* v : SourcesOf(b, s.order, turn, s.sources)) {
      const uint32_t source = v->source.value;
      if (!s.only_linked || source == receiver ||
          b.chunks.contains({receiver, source})) {
        AddPair(receiver, source, BlockersOf(*v, sweep), &steps);
      }
    }
  }
  return steps;
}

// The link chunks of a pair in the order in which the receiver reads them.
std::vector<uint32_t> ChunksOf(const Building& b,
                               uint32_t receiver,
                               uint32_t source) {
  std::vector<uint32_t> chunks;
  const auto found = b.chunks.find({receiver, source});
  const int times = receiver == source ? kBalanceSteps : 1;
  for (int i = 0; found != b.chunks.end() && i < times; ++i) {
    chunks.insert(chunks.end(), found->second.begin(), found->second.end());
  }
  return chunks;
}

// Sweeps of propagation in the store's order, including the link chunks: the
// sequence of requests of the solver.
Steps StepsWithLinks(const Building& b, int sweeps) {
  Steps steps;
  const CellOrder order = StoreOrder(b.cells.size());
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (const uint32_t cell : order) {
      for (const VisibleCell* v :
           SourcesOf(b, order, cell, SourceOrder::kAsReceivers)) {
        const uint32_t source = v->source.value;
        AddPair(cell, source, ChunksOf(b, cell, source), &steps);
      }
    }
  }
  return steps;
}

// ----------------------------------------------------------------- the tables

double Megabytes(uint64_t bytes) {
  return static_cast<double>(bytes) / 1e6;
}

std::vector<uint64_t> CapacitiesFor(uint64_t all_bytes,
                                    uint64_t largest_step,
                                    std::optional<uint64_t> budget) {
  std::vector<uint64_t> capacities;
  capacities.reserve(kParts.size() + 1);
  for (const uint64_t part : kParts) {
    capacities.push_back(std::max(all_bytes / part, largest_step));
  }
  capacities.erase(std::unique(capacities.begin(), capacities.end()),
                   capacities.end());
  if (budget) {
    capacities.push_back(std::max(*budget, largest_step));
  }
  return capacities;
}

struct Row {
  std::string name;
  std::vector<Schedule> schedules;  // one for all capacities, or one for each
};

std::vector<Row> RowsOf(const Building& b,
                        Sweep sweep,
                        const std::vector<uint64_t>& capacities) {
  const CellOrder store = StoreOrder(b.cells.size());
  const CellOrder path = PathOrder(b.cells);
  std::vector<Row> rows = {
      {"store", {{store}}},
      {"random", {{RandomOrder(b.cells.size())}}},
      {"Hilbert", {{HilbertOrder(b.cells)}}},
      {"Cuthill-McKee", {{CuthillMcKeeOrder(b.cells)}}},
      {"path", {{path}}},
      {"store, shortened", {{ShortenedOrder(b.cells, store)}}},
      {"Hilbert, shortened",
       {{ShortenedOrder(b.cells, HilbertOrder(b.cells))}}},
      {"store, sources to and fro", {{store, SourceOrder::kBackAndForth}}},
      {"store, shared outside", {{store, SourceOrder::kSharedOutside}}},
      {"path, sources to and fro", {{path, SourceOrder::kBackAndForth}}},
      {"path, shared outside", {{path, SourceOrder::kSharedOutside}}},
  };
  if (sweep == Sweep::kPropagate) {  // before refinement, links are not known
    rows.push_back(
        {"store, linked pairs", {{store, SourceOrder::kAsReceivers, true}}});
    rows.push_back(
        {"path, linked pairs", {{path, SourceOrder::kAsReceivers, true}}});
  }
  Row most{"greedy: most in memory", {}};
  Row least{"greedy: least to read", {}};
  for (const uint64_t capacity : capacities) {
    most.schedules.push_back(
        {GreedyOrder(b.cells, capacity, GreedyRule::kMostResident)});
    least.schedules.push_back(
        {GreedyOrder(b.cells, capacity, GreedyRule::kLeastMissing)});
  }
  rows.push_back(std::move(most));
  rows.push_back(std::move(least));
  return rows;
}

json MeasureSweep(const Building& b,
                  Sweep sweep,
                  std::optional<uint64_t> budget) {
  const Steps today = StepsOf(b, {StoreOrder(b.cells.size())}, sweep);
  const CacheItem all = SumOfItems(today, b.items);
  const uint64_t largest = LargestStep(today, b.items);
  const std::vector<uint64_t> capacities =
      CapacitiesFor(all.held_bytes, largest, budget);
  json result = {{"sweep", sweep == Sweep::kRefine ? "refine" : "propagate"},
                 {"held_bytes", all.held_bytes},
                 {"largest_pair_bytes", largest},
                 {"compulsory_bytes", all.stored_bytes},
                 {"capacities", capacities},
                 {"orders", json::array()}};
  std::printf(
      "\n%s: %.1f MB in memory, largest pair %.1f; MB read, compulsory "
      "%.2f, under\n| order |",
      sweep == Sweep::kRefine ? "refinement" : "propagation",
      Megabytes(all.held_bytes),
      Megabytes(largest),
      Megabytes(all.stored_bytes));
  for (const uint64_t capacity : capacities) {
    std::printf(" %.1f MB |", Megabytes(capacity));
  }
  std::printf("\n|---|");
  for (size_t i = 0; i < capacities.size(); ++i) {
    std::printf("---|");
  }
  std::printf("\n");
  for (const Row& row : RowsOf(b, sweep, capacities)) {
    std::printf("| %s |", row.name.c_str());
    std::vector<uint64_t> reads;
    for (size_t i = 0; i < capacities.size(); ++i) {
      const Schedule& s = row.schedules[std::min(i, row.schedules.size() - 1)];
      reads.push_back(LeastReads(StepsOf(b, s, sweep), b.items, capacities[i]));
      std::printf(" %.2f |", Megabytes(reads.back()));
    }
    std::printf("\n");
    result["orders"].push_back({{"order", row.name}, {"bytes_read", reads}});
  }
  return result;
}

// Measures two sweeps with links twice: with the sizes that the items have in
// memory, and as if they had the sizes in memory that they have in the store.
json MeasureYardstick(const Building& b, std::optional<uint64_t> budget) {
  const Steps steps = StepsWithLinks(b, 2);
  std::vector<CacheItem> packed = b.items;
  for (CacheItem& item : packed) {
    item.held_bytes = item.stored_bytes;
  }
  const CacheItem all = SumOfItems(steps, b.items);
  const uint64_t largest = LargestStep(steps, b.items);
  const std::vector<uint64_t> capacities =
      CapacitiesFor(all.held_bytes, largest, budget);
  json result = {{"compulsory_bytes", all.stored_bytes},
                 {"held_bytes", all.held_bytes},
                 {"rows", json::array()}};
  std::printf(
      "\ntwo sweeps with links, %.1f MB in memory, %.1f stored\n"
      "| capacity, MB | read by sizes in memory | by stored sizes | "
      "ratio |\n|---|---|---|---|\n",
      Megabytes(all.held_bytes),
      Megabytes(all.stored_bytes));
  for (const uint64_t capacity : capacities) {
    const uint64_t held = LeastReads(steps, b.items, capacity);
    const uint64_t stored = LeastReads(steps, packed, capacity);
    std::printf("| %.1f | %.1f | %.1f | %.2f |\n",
                Megabytes(capacity),
                Megabytes(held),
                Megabytes(stored),
                static_cast<double>(held) / static_cast<double>(stored));
    result["rows"].push_back({{"capacity_bytes", capacity},
                              {"by_sizes_in_memory", held},
                              {"by_stored_sizes", stored}});
  }
  return result;
}

json Measure(const std::string& path, std::optional<uint64_t> budget) {
  const Building b = LoadBuilding(path);
  std::printf(
      "\n## %s: %zu cells, %llu pairs, %zu of them with links; links "
      "%.1f MB stored, %.1f in memory\n",
      path.c_str(),
      b.cells.size(),
      static_cast<unsigned long long>(b.pairs),
      b.chunks.size(),
      Megabytes(b.links.stored_bytes),
      Megabytes(b.links.held_bytes));
  json result = {{"store", path},
                 {"cells", b.cells.size()},
                 {"pairs", b.pairs},
                 {"linked_pairs", b.chunks.size()},
                 {"link_bytes", b.links.stored_bytes}};
  result["sweeps"] = {MeasureSweep(b, Sweep::kPropagate, budget),
                      MeasureSweep(b, Sweep::kRefine, budget)};
  result["yardstick"] = MeasureYardstick(b, budget);
  return result;
}

int Run(std::span<char*> arguments) {
  std::string json_path;
  std::optional<uint64_t> budget;
  std::vector<std::string> stores;
  for (size_t i = 1; i < arguments.size(); ++i) {
    const std::string_view argument = arguments[i];
    if (argument == "--json" && i + 1 < arguments.size()) {
      json_path = arguments[++i];
    } else if (argument == "--memory" && i + 1 < arguments.size()) {
      const uint64_t cap = std::stoull(arguments[++i]) << 20;
      budget = MemoryBudget::BudgetUnderCap(cap) - kSolveWorkspaceBytes;
    } else {
      stores.emplace_back(argument);
    }
  }
  json results = json::array();
  for (const std::string& store : stores) {
    results.push_back(Measure(store, budget));
  }
  if (!json_path.empty()) {
    std::ofstream(json_path) << results.dump(2) << '\n';
  }
  return 0;
}

}  // namespace
}  // namespace enfilade

int main(int argc, char** argv) {
  try {
    return enfilade::Run({argv, static_cast<size_t>(argc)});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_schedules: %s\n", error.what());
    return 1;
  }
}
