// Measures the gather of a solved store's links by one thread, and in the same
// run two limits of its speed: reading and decoding the same links from the
// store, and the memory bandwidth for the bytes of their blocks.
//
//   bench_gather STORE
//
// Each chunk of links is read and decoded once and gathered several times from
// memory. The elements and the light of its two cells stay in memory.

#include "solver/links/gather.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "base/stopwatch.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "scene/scene_store.h"
#include "solver/paging/cell_pager.h"
#include "solver/state/solve_state.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <vector>

namespace enfilade {
namespace {

constexpr int kRepeats = 5;
constexpr uint64_t kUnlimited = std::numeric_limits<uint64_t>::max() / 4;
// Far more than the processor's caches hold.
constexpr size_t kStreamedFloats = size_t{64} << 20;

struct Totals {
  uint64_t links = 0;
  uint64_t stored_bytes = 0;
  uint64_t held_bytes = 0;
  double decode_seconds = 0;
  double gather_seconds = 0;  // of the fastest repeat of each chunk
};

// Bytes per second that one thread reads from memory.
double MemoryBandwidth() {
  const std::vector<float> values(kStreamedFloats, 1.0F);
  double best = std::numeric_limits<double>::infinity();
  float sum = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    double seconds = 0;
    {
      const Stopwatch watch(&seconds);
      sum += std::transform_reduce(
          values.begin(), values.end(), 0.0F, std::plus<>(), [](float v) {
            return v;
          });
    }
    best = std::min(best, seconds);
  }
  // Using `sum` keeps the compiler from leaving out the sums.
  return sum > 0 ? static_cast<double>(kStreamedFloats * sizeof(float)) / best
                 : 0;
}

// Gathers a block several times and returns the seconds of the fastest gather.
double GatherSeconds(const LinkBlock& block,
                     const GatherSide& receiver,
                     const GatherSide& source,
                     ReceivedLight* received) {
  double best = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    double seconds = 0;
    {
      const Stopwatch watch(&seconds);
      Gather(block, receiver, source, source.tree->Sent(), received->gathered);
    }
    best = std::min(best, seconds);
  }
  return best;
}

Totals GatherAll(BlockStorage& store, CellPager& pager) {
  std::vector<BlockKey> keys;
  store.ForEachKey(BlockKind::kLinks,
                   [&](const BlockKey& key) { keys.push_back(key); });
  Totals totals;
  for (const BlockKey& key : keys) {
    const CellPair pair{CellId(key.a), CellId(key.b)};
    const auto receiver = pager.Geometry(pair.receiver);
    const auto receiver_tree = pager.Tree(pair.receiver);
    const auto received = pager.Received(pair.receiver);
    const auto source = pager.Geometry(pair.source);
    const auto source_tree = pager.Tree(pair.source);
    const uint64_t read_before = store.Stats().bytes_read;
    std::optional<LinkBlock> block;
    {
      const Stopwatch watch(&totals.decode_seconds);
      block = ReadLinks(store,
                        pair,
                        key.c,
                        {receiver_tree->Size(),
                         source_tree->Size(),
                         source->groups.All().size()});
    }
    totals.stored_bytes += store.Stats().bytes_read - read_before;
    totals.held_bytes += block->SizeBytes();
    totals.links += block->links.size();
    totals.gather_seconds +=
        GatherSeconds(*block,
                      {receiver->patches, receiver_tree.get(), nullptr},
                      {source->patches, source_tree.get(), &source->groups},
                      received.get());
  }
  return totals;
}

void Print(const Totals& totals, double bandwidth) {
  const auto links = static_cast<double>(totals.links);
  const auto per_second = [&](double seconds) { return links / seconds / 1e6; };
  const double by_memory = static_cast<double>(totals.held_bytes) / bandwidth;
  const double limit = std::max(by_memory, totals.decode_seconds);
  std::printf("links    %.0f, stored in %.2f bytes, held in %.1f\n",
              links,
              static_cast<double>(totals.stored_bytes) / links,
              static_cast<double>(totals.held_bytes) / links);
  std::printf("gather   %.1f M links/s\n", per_second(totals.gather_seconds));
  std::printf("decode   %.1f M links/s\n", per_second(totals.decode_seconds));
  std::printf("memory   %.1f M links/s, %.1f GB/s\n",
              per_second(by_memory),
              bandwidth / 1e9);
  std::printf("ratio    %.2f of the lower\n", limit / totals.gather_seconds);
}

void Run(const char* path) {
  const ThreadLimit one(1);
  const auto store = OpenStore(path, StoreAccess::kRead);
  SolveState state;
  if (!LoadSolveState(*store, &state)) {
    throw std::runtime_error("the store holds no solution");
  }
  const SceneInfo scene = LoadSceneInfo(*store);
  const Partition partition = LoadPartition(*store);
  const Basis basis(BasisNamed(state.basis));
  MemoryBudget budget(kUnlimited);
  const OcclusionDevice device(budget, scene.bounds.Center());
  CellPager pager(
      *store, scene, partition, {&basis, kRgbChannels}, device, budget);
  Print(GatherAll(*store, pager), MemoryBandwidth());
}

}  // namespace
}  // namespace enfilade

int main(int argc, char** argv) {
  try {
    if (argc != 2) {
      std::fprintf(stderr, "usage: bench_gather STORE\n");
      return 2;
    }
    enfilade::Run(argv[1]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_gather: %s\n", error.what());
    return 1;
  }
}
