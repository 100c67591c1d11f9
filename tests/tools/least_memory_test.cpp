// The least cap, named before a solve begins.

#include "solver/least_memory.h"

#include "base/error.h"
#include "partition/partition.h"
#include "scene/import.h"
#include "solver/engine.h"
#include "solver/paging/cell_pager.h"
#include "solver/state/solve_state.h"
#include "store/sqlite_store.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <atomic>
#include <memory>
#include <string>

#include "tests/budgets.h"
#include "tests/tools/run_program.h"
#include "tools/scenes/floorplan.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

SolveOptions Coarse() {
  SolveOptions options;
  options.error = 0.7;
  options.basis = "haar";
  return options;
}

// A floor, ready to be solved.
class LeastMemoryOfFloor : public ::testing::Test {
 protected:
  explicit LeastMemoryOfFloor(uint32_t rooms = 2)
      : store_(CreateStoreInMemory()) {
    ObjWriter writer(dir_ / "floor.obj");
    WriteFloorplan({rooms, 1, 0.5, 1}, writer);
    writer.Finish();
    MemoryBudget budget(kRoomy);
    ImportScene(dir_ / "floor.obj", {}, budget, *store_);
    partition_ = BuildPartition(*store_, {}, budget);
    BuildVisibleSets(partition_, {}, budget, *store_);
    BuildTraceChunks(*store_, budget);
  }

  LeastMemory AtLeast(const SolveOptions& options) const {
    MemoryBudget budget(kRoomy);
    return FindLeastMemory(*store_, options, budget).first;
  }

  LeastMemory AtTheEnd(const SolveOptions& options) const {
    MemoryBudget budget(kRoomy);
    return FindLeastMemory(*store_, options, budget).last;
  }

  TemporaryFolder dir_;
  std::unique_ptr<BlockStorage> store_;
  Partition partition_;
};

TEST_F(LeastMemoryOfFloor, WithSoMuchTheSolveEnds) {
  const LeastMemory least = AtLeast(Coarse());
  MemoryBudget budget(least.budget_bytes);
  EXPECT_TRUE(Solve(*store_, Coarse(), budget).converged);
  EXPECT_LE(budget.PeakBytes(), least.budget_bytes);
}

TEST_F(LeastMemoryOfFloor, WithLessItDoesNotBegin) {
  const LeastMemory least = AtLeast(Coarse());
  MemoryBudget budget(least.budget_bytes - 1);
  try {
    Solve(*store_, Coarse(), budget);
    FAIL() << "no DoesNotFitError";
  } catch (const DoesNotFitError& error) {
    const std::string first = std::to_string(least.cap_bytes >> 20);
    const std::string last = std::to_string(AtTheEnd(Coarse()).cap_bytes >> 20);
    EXPECT_NE(std::string(error.what()).find("at least " + first + "M"),
              std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("--memory " + last + "M"),
              std::string::npos);
  }
  SolveState state;
  EXPECT_FALSE(LoadSolveState(*store_, &state));
  EXPECT_EQ(budget.UsedBytes(), 0U);
}

// The bound is not far too large: beside the work space, an eighth of it is too
// little even here, although most of it allows for the growth of trees.
TEST_F(LeastMemoryOfFloor, FarLessIsTooLittle) {
  const uint64_t least = AtLeast(Coarse()).budget_bytes;
  constexpr uint64_t kWorkspace = kSolveWorkspaceBytes + kRefineWorkspaceBytes;
  MemoryBudget budget(kWorkspace + (least - kWorkspace) / 8);
  EXPECT_THROW(Engine(*store_, Coarse(), budget).Run(), DoesNotFitError);
}

TEST_F(LeastMemoryOfFloor, HigherBasesAndGrownTreesNeedMore) {
  SolveOptions m2 = Coarse();
  m2.basis = "m2";
  const uint64_t least = AtLeast(Coarse()).budget_bytes;
  EXPECT_GT(AtLeast(m2).budget_bytes, least);
  MemoryBudget budget(kRoomy);
  Solve(*store_, Coarse(), budget);
  EXPECT_GE(AtLeast(Coarse()).budget_bytes, least);
}

TEST_F(LeastMemoryOfFloor, SmallerErrorsNeedMoreAtTheEnd) {
  SolveOptions options = Coarse();
  uint64_t before = AtLeast(options).budget_bytes;
  for (const double error : {0.3, 0.1, 0.02}) {
    options.error = error;
    const uint64_t now = AtTheEnd(options).budget_bytes;
    EXPECT_GT(now, before) << error;
    before = now;
  }
}

// Under a cap between the one at which a solve begins and the one at which it
// should end, the solve goes on with a warning.
TEST_F(LeastMemoryOfFloor, BetweenTheTwoCapsItSaysSo) {
  SolveOptions fine = Coarse();
  fine.error = 0.02;
  std::atomic<bool> stop = true;  // after its first step
  fine.stop = &stop;
  uint64_t named = 0;
  fine.may_not_fit = [&](uint64_t cap_bytes) { named = cap_bytes; };
  const LeastMemory last = AtTheEnd(fine);
  MemoryBudget ample(last.budget_bytes);
  EXPECT_THROW(Solve(*store_, fine, ample), InterruptedError);
  EXPECT_EQ(named, 0U);
  MemoryBudget scant(last.budget_bytes - 1);
  EXPECT_THROW(Solve(*store_, fine, scant), InterruptedError);
  EXPECT_EQ(named, last.cap_bytes);
}

TEST_F(LeastMemoryOfFloor, GeometryIsForeseen) {
  const SceneInfo scene = LoadSceneInfo(*store_);
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, scene.bounds.Center());
  const Basis basis(1);
  CellPager pager(
      *store_, scene, partition_, {&basis, kRgbChannels}, device, budget);
  uint64_t taken = 0;
  uint64_t foreseen = 0;
  for (size_t i = 0; i < partition_.cells.size(); ++i) {
    taken += pager.Geometry(CellId(i))->SizeBytes() +
             pager.ShaftBlockersOf(CellId(i))->SizeBytes();
    const CellPatches stored = LoadCellPatches(*store_, CellId(i));
    size_t triangles = 0;
    for (const Portal& p : partition_.portals) {
      triangles += p.front == CellId(i) || p.back == CellId(i)
                       ? p.vertices.size() - 2
                       : 0;
    }
    foreseen += CellGeometry::BytesFor(stored.patches.size(), triangles) +
                ShaftBlockers::BytesFor(BlockerCount(stored));
  }
  EXPECT_GE(foreseen, taken);
  EXPECT_LE(static_cast<double>(foreseen), 1.3 * static_cast<double>(taken));
}

// With room for everything nothing is read twice, and Belady's measure says the
// same.
TEST_F(LeastMemoryOfFloor, WithRoomForAllTheRoundsReadWhatTheyMust) {
  MemoryBudget budget(kRoomy);
  const SolveSummary roomy = Solve(*store_, Coarse(), budget);
  EXPECT_GT(roomy.bytes_read, 0U);
  EXPECT_EQ(roomy.bytes_read, roomy.bytes_compulsory);
  EXPECT_EQ(roomy.bytes_belady, roomy.bytes_compulsory);
}

class LeastMemoryOfManyRooms : public LeastMemoryOfFloor {
 protected:
  LeastMemoryOfManyRooms() : LeastMemoryOfFloor(16) {}
};

TEST_F(LeastMemoryOfManyRooms, WithLittleRoomTheBestCacheReadsMoreThanItMust) {
  MemoryBudget budget(AtLeast(Coarse()).budget_bytes);
  const SolveSummary narrow = Solve(*store_, Coarse(), budget);
  EXPECT_GT(narrow.bytes_belady, narrow.bytes_compulsory);
  EXPECT_GE(narrow.bytes_read, narrow.bytes_belady);
}

// As an option takes it.
std::string CapNamedBy(const ProgramResult& refused) {
  return std::to_string(NamedCapMiB(refused.err)) + "M";
}

// So is the error that a refused resume was asked for: the resume that the
// refusal advises is to that error.
TEST(LeastMemoryOfProgram, IsNamedBeforeTheSolveAndIsEnoughToResume) {
  const TemporaryFolder dir;
  ObjWriter writer(dir / "floor.obj");
  WriteFloorplan({2, 1, 0.5, 1}, writer);
  writer.Finish();
  const auto refused = RunProgram({"solve",
                                   dir / "floor.obj",
                                   "-o",
                                   dir / "s.enf",
                                   "--memory",
                                   "30M",
                                   "--error",
                                   "0.7",
                                   "--basis",
                                   "haar"});
  ASSERT_EQ(refused.exit_code, 4) << refused.err;
  const std::string store = dir / "s.enf";
  const auto resumed =
      RunProgram({"resume", store, "--memory", CapNamedBy(refused)});
  EXPECT_EQ(resumed.exit_code, 0) << refused.err << resumed.err;

  const auto finer =
      RunProgram({"resume", store, "--error", "0.4", "--memory", "30M"});
  ASSERT_EQ(finer.exit_code, 4) << finer.err;
  const std::string report = dir / "resume.json";
  const auto meanwhile = RunProgram({"info", store, "--report", report});
  EXPECT_TRUE(Contains(meanwhile.out, "state     unfinished")) << meanwhile.out;
  const auto refused_report = nlohmann::json::parse(ReadFile(report));
  EXPECT_EQ(refused_report.at("requested_error"), 0.4);
  EXPECT_EQ(refused_report.at("converged"), false);
  EXPECT_EQ(refused_report.at("stage"), "traceable");
  const auto advised = RunProgram(
      {"resume", store, "--memory", CapNamedBy(finer), "--report", report});
  EXPECT_EQ(advised.exit_code, 0) << finer.err << advised.err;
  EXPECT_EQ(nlohmann::json::parse(ReadFile(report)).at("requested_error"), 0.4);
}

}  // namespace
}  // namespace enfilade
