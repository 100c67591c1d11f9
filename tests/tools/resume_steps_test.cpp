// A solve that is stopped after every few of its steps and resumed each time
// ends with the bits of one that runs through, so that anything a step leaves
// undone or unwritten shows. A solve that is resumed for another error goes on
// to that error.

#include "base/error.h"
#include "base/stopwatch.h"
#include "partition/partition.h"
#include "scene/import.h"
#include "solver/solution/solution.h"
#include "solver/solve.h"
#include "store/sqlite_store.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/budgets.h"
#include "tests/temporary_folder.h"
#include "tests/tools/run_program.h"
#include "tests/visibility/map_storage.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Some rooms with doorways, so that light goes to and fro between cells.
class ResumedFloor : public ::testing::Test {
 protected:
  void ImportInto(BlockStorage& store) {
    const std::string scene = folder_ / "rooms.obj";
    const ProgramResult written = RunProgram(
        {"scene", "floorplan", "--rooms", "2", "--furniture", "0", scene});
    EXPECT_EQ(written.exit_code, 0) << written.err;
    MemoryBudget budget(kRoomy);
    ImportScene(scene, {}, budget, store);
    BuildVisibleSets(BuildPartition(store, {}, budget), {}, budget, store);
    BuildTraceChunks(store, budget);
  }

  std::unique_ptr<BlockStorage> Import() {
    auto store = CreateStoreInMemory();
    ImportInto(*store);
    return store;
  }

  static SolveOptions Options(double error = 0.5) {
    SolveOptions options;
    options.error = error;
    return options;
  }

  static SolveSummary SolveTo(double error, BlockStorage& store) {
    MemoryBudget budget(kRoomy);
    return Solve(store, Options(error), budget);
  }

  // Stops the solve after so many steps.
  static void Begin(double error, int steps, BlockStorage& store) {
    std::atomic<bool> stop = false;
    SolveOptions options = Options(error);
    options.commit_seconds = 0;
    options.stop = &stop;
    options.progress = [&](const SolveProgress&) { stop = --steps <= 0; };
    MemoryBudget budget(kRoomy);
    EXPECT_THROW(Solve(store, options, budget), InterruptedError);
  }

  static std::string DigestOf(const BlockStorage& store) {
    MemoryBudget budget(kRoomy);
    return Solution(store, budget).Digest();
  }

  TemporaryFolder folder_;
};

class ResumeSteps : public ResumedFloor,
                    public ::testing::WithParamInterface<int> {};

// The test does not stop a solve while rays measure the residual: the
// measurement begins anew after a stop, and would never end if it takes longer
// than the time between two reports.
TEST_P(ResumeSteps, ComeToTheSameBits) {
  const auto whole = Import();
  SolveTo(0.5, *whole);
  const auto stepped = Import();
  std::atomic<bool> stop = false;
  int steps = 0;
  SolveOptions options = Options();
  options.commit_seconds = 0;
  options.stop = &stop;
  options.progress = [&](const SolveProgress& progress) {
    const bool is_step = progress.part.find("residual") == std::string::npos;
    stop = is_step && ++steps % GetParam() == 0;
  };
  int runs = 1;
  for (bool done = false; !done; ++runs) {
    stop = false;
    MemoryBudget budget(kRoomy);
    try {
      Solve(*stepped, options, budget);
      done = true;
    } catch (const InterruptedError&) {
    }
    ASSERT_LT(runs, 100'000);
  }
  EXPECT_GT(runs, 10);
  EXPECT_EQ(DigestOf(*stepped), DigestOf(*whole));
}

class SlowStore : public test::MapStorage {
 public:
  static constexpr double kCommitSeconds = 0.02;

  void Commit() override {
    ++commits_;
    std::this_thread::sleep_for(std::chrono::duration<double>(kCommitSeconds));
  }

  [[nodiscard]] int Commits() const { return commits_; }

 private:
  int commits_ = 0;
};

TEST_F(ResumedFloor, SpendsATwentiethOfItsTimeOnCommitsThatAreSlow) {
  SlowStore store;
  ImportInto(store);
  const int before = store.Commits();
  SolveOptions options = Options();
  options.commit_seconds = 1e-6;
  int rounds = 0;
  int steps = 0;
  options.round_ended = [&](const RoundSummary&) { ++rounds; };
  options.progress = [&](const SolveProgress&) { ++steps; };
  MemoryBudget budget(kRoomy);
  const auto begin = std::chrono::steady_clock::now();
  Solve(store, options, budget);
  // A round ends with two commits, the solve with one.
  const double most =
      2.0 * rounds + 2 + SecondsSince(begin) / (20 * SlowStore::kCommitSeconds);
  EXPECT_LE(store.Commits() - before, most);
  EXPECT_GE(store.Commits() - before, rounds);
  EXPECT_GE(steps, rounds);
}

TEST_F(ResumedFloor, MeetsASmallerErrorThanItWasBegunWith) {
  const auto store = Import();
  Begin(0.5, 5, *store);
  const SolveSummary summary = SolveTo(0.2, *store);
  EXPECT_TRUE(summary.converged);
  EXPECT_LE(summary.estimated_error, 0.2);
}

// The solve may have stopped because of the memory that the round in progress
// asks for.
TEST_F(ResumedFloor, MakesNoMoreLinksThanALargerErrorNeeds) {
  const auto store = Import();
  SolveTo(0.5, *store);
  Begin(0.05, 5, *store);
  const SolveSummary larger = SolveTo(0.4, *store);
  EXPECT_TRUE(larger.converged);
  EXPECT_LE(larger.estimated_error, 0.4);
  const SolveSummary smaller = SolveTo(0.05, *store);
  EXPECT_TRUE(smaller.converged);
  EXPECT_LT(2 * larger.links, smaller.links);
}

TEST_F(ResumedFloor, IsNotSolvedWhileItIsRefinedAgain) {
  const auto store = Import();
  EXPECT_TRUE(SolveTo(0.5, *store).converged);
  Begin(0.1, 2, *store);
  EXPECT_FALSE(LoadSolveSummary(*store).converged);
}

// The cells' light at the middles of their patches.
std::vector<double> LightOfCells(const BlockStorage& store) {
  MemoryBudget budget(kRoomy);
  const Solution solution(store, budget);
  std::vector<double> light(solution.CellCount());
  for (size_t i = 0; i < light.size(); ++i) {
    std::vector<PatchPoint> points;
    const size_t patches = LoadCellPatches(store, CellId(i)).patches.size();
    for (size_t k = 0; k < patches; ++k) {
      points.push_back({CellId(i), PatchId(k), 0.4, 0.4});
    }
    for (const Rgb& irradiance : solution.Irradiance(points)) {
      light[i] += MeanChannel(irradiance);
    }
  }
  return light;
}

// A cell gathers its light anew in each round, pair by pair: a reader in
// between sees the light of the round before.
TEST_F(ResumedFloor, IsAsBrightAsBeforeWhereverARoundIsStopped) {
  const auto store = Import();
  std::atomic<bool> stop = false;
  SolveOptions options = Options(0.1);
  options.commit_seconds = 0;
  options.stop = &stop;
  options.progress = [&](const SolveProgress& progress) {
    stop = progress.part == "round 2 refine";
  };
  std::vector<double> before;
  options.round_ended = [&](const RoundSummary&) {
    if (before.empty()) {
      before = LightOfCells(*store);
    }
  };
  int stops = 0;
  for (bool done = false; !done;) {
    stop = false;
    MemoryBudget budget(kRoomy);
    try {
      Solve(*store, options, budget);
      done = true;
    } catch (const InterruptedError&) {
      ++stops;
      const std::vector<double> light = LightOfCells(*store);
      for (size_t i = 0; i < light.size(); ++i) {
        EXPECT_GE(light[i], before[i] / 2)
            << "cell " << i << ", stop " << stops;
      }
    }
  }
  EXPECT_GT(stops, 5);
  for (uint32_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(store->Count(BlockKind::kReceived, i, 2), 0U) << "kept for good";
  }
}

TEST_F(ResumedFloor, IsLeftAsItIsWhereItMeetsTheError) {
  const auto store = Import();
  const SolveSummary first = SolveTo(0.5, *store);
  const std::string digest = DigestOf(*store);
  for (const double error : {(0.5 + first.estimated_error) / 2, 0.9}) {
    EXPECT_TRUE(SolveTo(error, *store).converged);
    EXPECT_EQ(DigestOf(*store), digest);
  }
}

INSTANTIATE_TEST_SUITE_P(Strides, ResumeSteps, ::testing::Values(1, 2, 7, 31));

}  // namespace
}  // namespace enfilade
