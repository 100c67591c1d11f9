// A solve that is stopped after every few of its steps and resumed each time
// comes to the bits of one that runs through: whatever a step leaves undone or
// unwritten shows.

#include "base/error.h"
#include "partition/partition.h"
#include "scene/import.h"
#include "solver/solution.h"
#include "solver/solve.h"
#include "store/sqlite_store.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "tests/budgets.h"
#include "tests/temporary_folder.h"
#include "tests/tools/run_program.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Some rooms with doorways, so that light goes to and fro between cells.
class ResumeSteps : public ::testing::TestWithParam<int> {
 protected:
  std::unique_ptr<BlockStorage> Import() {
    const std::string scene = folder_ / "rooms.obj";
    const ProgramResult written = RunProgram(
        {"scene", "floorplan", "--rooms", "2", "--furniture", "0", scene});
    EXPECT_EQ(written.exit_code, 0) << written.err;
    auto store = CreateStoreInMemory();
    MemoryBudget budget(kRoomy);
    ImportScene(scene, {}, budget, *store);
    BuildVisibleSets(BuildPartition(*store, {}, budget), {}, *store);
    BuildTraceChunks(*store, budget);
    return store;
  }

  static SolveOptions Options() {
    SolveOptions options;
    options.error = 0.5;
    return options;
  }

  static std::string DigestOf(const BlockStorage& store) {
    MemoryBudget budget(kRoomy);
    return Solution(store, budget).Digest();
  }

  TemporaryFolder folder_;
};

TEST_P(ResumeSteps, ComeToTheSameBits) {
  const auto whole = Import();
  {
    MemoryBudget budget(kRoomy);
    Solve(*whole, Options(), budget);
  }
  const auto stepped = Import();
  std::atomic<bool> stop = false;
  int steps = 0;
  SolveOptions options = Options();
  options.commit_seconds = 0;
  options.stop = &stop;
  options.progress = [&](double, const std::string&) {
    stop = ++steps % GetParam() == 0;
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

INSTANTIATE_TEST_SUITE_P(Strides, ResumeSteps, ::testing::Values(1, 2, 7, 31));

}  // namespace
}  // namespace enfilade
