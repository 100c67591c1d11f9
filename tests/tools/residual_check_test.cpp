// The residual that rays measure, against solutions whose residual is known.

#include "solver/residual/residual_check.h"

#include "base/error.h"
#include "base/parallel.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "scene/import.h"
#include "solver/elements/basis.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/received_light.h"
#include "solver/residual/residual_probes.h"
#include "solver/solve.h"
#include "solver/state/solve_state.h"
#include "store/sqlite_store.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/budgets.h"
#include "tests/tools/run_program.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr int kSeedsOfDark = 4;

class SolvedScene {
 public:
  SolvedScene(const std::string& obj, const std::string& mtl, double error)
      : store(CreateStoreInMemory()) {
    WriteFile(dir_ / "scene.mtl", mtl);
    WriteFile(dir_ / "scene.obj", "mtllib scene.mtl\n" + obj);
    SolveIt(error);
  }

  // A floor with furniture.
  SolvedScene(int rooms, double error) : store(CreateStoreInMemory()) {
    const ProgramResult written = RunProgram({"scene",
                                              "floorplan",
                                              "--rooms",
                                              std::to_string(rooms),
                                              dir_ / "scene.obj"});
    EXPECT_EQ(written.exit_code, 0) << written.err;
    SolveIt(error);
  }

  // Multiplies the irradiance that the solution has by a factor, everywhere or
  // on one patch.
  void Scale(float factor, std::optional<PatchId> only = {}) {
    const SceneInfo scene = LoadSceneInfo(*store);
    const Basis basis(BasisNamed("m2"));
    const size_t cells = LoadPartition(*store).cells.size();
    for (size_t i = 0; i < cells; ++i) {
      std::vector<PatchGeometry> patches;
      for (const Patch& p : LoadCellPatches(*store, CellId(i)).patches) {
        patches.push_back(MakePatchGeometry(
            p, scene.materials.at(p.material.Index()), scene.bounds.Center()));
      }
      const TreeShape shape{&basis, kRgbChannels};
      const auto tree = CellTree::Load(*store, CellId(i), shape, patches);
      if (tree) {
        auto gathered =
            ReceivedLight::LoadGathered(*store, CellId(i), shape, tree->Size());
        for (size_t e = 0; e < tree->Size(); ++e) {
          const bool scaled =
              !only || tree->At(ElementId(e)).patch == only->value;
          for (float& value : gathered[ElementId(e)]) {
            value *= scaled ? factor : 1;
          }
        }
        ReceivedLight::SaveGathered(*store, CellId(i), gathered);
      }
    }
  }

  std::unique_ptr<BlockStorage> store;

 private:
  void SolveIt(double error) {
    MemoryBudget budget(kRoomy);
    ImportScene(dir_ / "scene.obj", {}, budget, *store);
    BuildVisibleSets(BuildPartition(*store, {}, budget), {}, budget, *store);
    BuildTraceChunks(*store, budget);
    SolveOptions options;
    options.error = error;
    Solve(*store, options, budget);
  }

  TemporaryFolder dir_;
};

// A cube of 1 m that emits 1 W/m2 and reflects half of what it gets, seen from
// inside: H = 2 W/m2 everywhere.
SolvedScene Furnace() {
  return {
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
      "usemtl wall\nf 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\n"
      "f 4 8 5 1\n",
      "newmtl wall\nKd 0.5 0.5 0.5\nKe 1 1 1\n",
      0.05};
}

// A lamp of 1 m2 and 1 W/m2, and 1 m below it a square that reflects half.
SolvedScene LampOverSquare() {
  return {
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
      "usemtl square\nf 1 2 3 4\nusemtl lamp\nf 8 7 6 5\n",
      "newmtl square\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n",
      0.1};
}

// Numbers that are drawn independently of each other.
class Draws {
 public:
  void Add(double x) {
    ++count_;
    sum_ += x;
    squares_ += x * x;
  }

  [[nodiscard]] double Mean() const { return sum_ / count_; }

  [[nodiscard]] double Deviation() const {
    return std::sqrt(std::max(0.0, squares_ / count_ - Mean() * Mean()));
  }

  // Five standard deviations of the mean.
  [[nodiscard]] double Off() const {
    return 5 * Deviation() / std::sqrt(count_);
  }

 private:
  double count_ = 0;
  double sum_ = 0;
  double squares_ = 0;
};

ResidualEstimate Measure(const SolvedScene& scene,
                         double mean_reflected,
                         uint64_t budget_bytes = kRoomy,
                         uint64_t seed = 1) {
  ResidualOptions options;
  options.seed = seed;
  options.mean_reflected = mean_reflected;
  options.most_rays = 4 << 20;
  MemoryBudget budget(budget_bytes);
  return MeasureResidual(*scene.store, options, budget);
}

TEST(ResidualCheck, IsSmallWhereTheSolutionIsRight) {
  EXPECT_LT(Measure(Furnace(), 1).high, 0.05);
}

// At twice the irradiance, H' = 2 E / (1 - rho), one bounce leaves E + rho H':
// the residual is E, or 1 - rho of H. Reflection makes the residual the error
// H, of which rho is reflected: 1 W/m2. The series of bounces ends when a
// bounce adds a thousandth. No light reaches the outer sides, which are half of
// the area.
TEST(ResidualCheck, IsTheErrorOfTwiceTheLight) {
  SolvedScene scene = Furnace();
  scene.Scale(2);
  const ResidualEstimate residual = Measure(scene, 1);
  EXPECT_NEAR(residual.value, 1 / std::sqrt(2), 0.01);
  EXPECT_LT(residual.low, residual.value);
  EXPECT_GT(residual.high, residual.value);
}

// The form factor of a point below the corner of a rectangle a by b at distance
// 1, parallel to it (Modest, Radiative Heat Transfer, configuration 14).
double CornerFormFactor(double a, double b) {
  const double p = std::sqrt(1 + a * a);
  const double q = std::sqrt(1 + b * b);
  return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kPi);
}

// The residual of a solution without light is the direct light.
TEST(ResidualCheck, IsTheDirectLightOfADarkSolution) {
  SolvedScene scene = LampOverSquare();
  scene.Scale(0);
  constexpr int kSteps = 200;
  double squares = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      const double a = (i + 0.5) / kSteps;
      const double b = (k + 0.5) / kSteps;
      const double f = CornerFormFactor(a, b) + CornerFormFactor(1 - a, b) +
                       CornerFormFactor(a, 1 - b) +
                       CornerFormFactor(1 - a, 1 - b);
      squares += 0.25 * f * f / (kSteps * kSteps);
    }
  }
  // The sides of the lamp are black and do not count.
  const double reflecting_sides = 2;  // m2
  const double expected = std::sqrt(squares / reflecting_sides);
  const ResidualEstimate residual = Measure(scene, 1);
  EXPECT_LT(residual.low, expected);
  EXPECT_GT(residual.high, expected);
  // The squares are unbiased; the ends of the intervals are 1.96 deviations of
  // the squares away from them.
  double mean = 0;
  double variance = 0;
  for (uint64_t seed = 1; seed <= kSeedsOfDark; ++seed) {
    const ResidualEstimate r = Measure(scene, 1, kRoomy, seed);
    const double deviation = (r.high * r.high - r.low * r.low) / (2 * 1.96);
    mean += r.value * r.value / kSeedsOfDark;
    variance += deviation * deviation / kSeedsOfDark;
  }
  const double off = 5 * std::sqrt(variance / kSeedsOfDark);
  EXPECT_NEAR(mean, expected * expected, off);
  EXPECT_LT(off, 0.1 * expected * expected) << "or this would say little";
}

// The error is relative to a mean over the sides that reflect: a black backdrop
// of 100 m2, which lights nothing, changes neither the mean nor what is
// predicted. With the backdrop in the mean, light that the links lack would
// weigh a tenth.
TEST(ResidualCheck, IsAMeanOverWhatReflects) {
  const std::string black = "newmtl black\nKd 0 0 0\n";
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
      "usemtl square\nf 1 2 3 4\nusemtl lamp\nf 8 7 6 5\n";
  const std::string mtl =
      "newmtl square\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n";
  const SolvedScene bare(obj, mtl, 0.05);
  const SolvedScene before_black(
      obj +
          "v -5 -5 -1\nv 5 -5 -1\nv 5 5 -1\nv -5 5 -1\nusemtl black\n"
          "f 9 10 11 12\n",
      mtl + black,
      0.05);
  SolveState without;
  SolveState with;
  ASSERT_TRUE(LoadSolveState(*bare.store, &without));
  ASSERT_TRUE(LoadSolveState(*before_black.store, &with));
  EXPECT_NEAR(with.mean_reflected,
              without.mean_reflected,
              0.01 * without.mean_reflected);
  EXPECT_LT(with.rounds.back().predicted_error,
            2 * without.rounds.back().predicted_error);
  EXPECT_GT(with.rounds.back().predicted_error,
            0.5 * without.rounds.back().predicted_error);
}

// Inside of the furnace a bounce leaves half of the light, outside nothing is
// seen.
TEST(ResidualCheck, OfAConstantBasisItCountsWhatSlopesBecome) {
  SolvedScene scene = Furnace();
  scene.Scale(2);
  const double without = Measure(scene, 1).value;
  ResidualOptions options;
  options.seed = 1;
  options.most_rays = 4 << 20;
  options.unseen = kUnseenErrorOfConstants;
  MemoryBudget budget(kRoomy);
  const double with = MeasureResidual(*scene.store, options, budget).value;
  EXPECT_NEAR(with / without, 1.05 + 0.75 * 0.5, 1e-9);
}

// The furnace is lit inside, evenly but for the error of its solution, and has
// as much area outside. A wall k times as bright as five others has them all
// count for less: (5 + k)^2 / (12 (5 + k^2)).
TEST(ResidualCheck, TellsOnWhatShareOfTheAreaTheLightIs) {
  SolvedScene scene = Furnace();
  EXPECT_NEAR(Measure(scene, 1).lit_share, 0.5, 0.5 * 0.05);
  for (const size_t bright : {0U, 1U}) {  // one of two sides of the same face
    scene.Scale(4, PatchId(bright));
  }
  EXPECT_NEAR(Measure(scene, 1).lit_share, 81 / (12 * 21.0), 0.02);
}

// At twice the irradiance one wall reflects 1 W/m2 too much; the other walls,
// which see it as a fifth of their hemispheres, lack a tenth of that.
TEST(ResidualCheck, SaysOnWhichPatchesTheErrorIs) {
  size_t wrong = 0;
  for (const size_t bright : {0U, 1U}) {  // one of two sides of the same face
    SolvedScene scene = Furnace();
    scene.Scale(2, PatchId(bright));
    ResidualOptions options;
    options.seed = 1;
    options.least_rays.above = 4 << 20;
    options.most_rays = 8 << 20;
    MemoryBudget budget(kRoomy);
    PatchErrors errors;
    MeasureResidual(*scene.store, options, budget, &errors);
    const Partition partition = LoadPartition(*scene.store);
    for (size_t cell = 0; cell < partition.cells.size(); ++cell) {
      const std::vector<float> square =
          errors.Of(CellId(cell), partition.cells[cell].patches);
      for (size_t i = 0; i < square.size(); ++i) {
        if (i == bright && square[i] > 0.02F) {
          ++wrong;
          EXPECT_NEAR(square[i], 1, 0.05);
          EXPECT_NEAR(errors.OfAll(), 1.05, 0.05);
        } else {
          EXPECT_LT(square[i], 0.02);
        }
      }
    }
  }
  EXPECT_GE(wrong, 1U);
}

// Leaves are chosen by their brightness, and the points on bright leaves stand
// for as much less area: in the mean all points together stand for the
// reflecting area.
TEST(ResidualProbes, StandForTheWholeArea) {
  const SolvedScene scene = LampOverSquare();
  MemoryBudget budget(kRoomy);
  const Solution solution(*scene.store, budget);
  const ProbeChooser chooser(
      *scene.store, LoadCells(*scene.store), solution, 0.1, budget);
  constexpr uint32_t kRounds = 64;
  constexpr uint32_t kProbes = 256;
  Draws area;
  Draws lit;
  for (uint64_t key = 1; key <= kRounds; ++key) {
    double of_all = 0;
    double of_lit = 0;
    for (const ResidualProbe& p :
         chooser.Choose(key, {0, kProbes, kProbes}).probes) {
      of_all += p.weight / kProbes;
      of_lit += p.normal.z > 0.5 ? p.weight / kProbes : 0;
      EXPECT_GE(p.on.a, 0);
      EXPECT_LE(p.on.a, 1);
    }
    area.Add(of_all);
    lit.Add(of_lit);
  }
  // The area is that of both sides of the square; the lamp reflects nothing.
  EXPECT_NEAR(area.Mean(), 2, area.Off());
  EXPECT_NEAR(lit.Mean(), 1, lit.Off());
  EXPECT_LT(std::max(area.Off(), lit.Off()), 0.02);
}

// The tight budget holds neither the building nor the solution, so that both
// are read again and again.
TEST(ResidualCheck, IsTheSameForEveryBudgetAndNumberOfThreads) {
  constexpr uint64_t kTight = 7 << 20;
  const SolvedScene scene(6, 0.5);
  const uint64_t begin = scene.store->Stats().bytes_read;
  const ResidualEstimate roomy = Measure(scene, 0.05);
  const uint64_t read = scene.store->Stats().bytes_read - begin;
  const ThreadLimit one_thread(1);
  const ResidualEstimate tight = Measure(scene, 0.05, kTight);
  const uint64_t read_again = scene.store->Stats().bytes_read - begin - read;
  EXPECT_GT(read_again, 2 * read) << "it is not tight";
  EXPECT_EQ(roomy.value, tight.value);
  EXPECT_EQ(roomy.low, tight.low);
  EXPECT_EQ(roomy.rays, tight.rays);
}

// The check stops when the interval lies on one side of the value, when it is
// narrow, or when the rays are spent.
TEST(ResidualCheck, StopsWhenItKnowsOrHasNoMoreRays) {
  SolvedScene scene = LampOverSquare();
  scene.Scale(0.99F);
  const double value = Measure(scene, 1).value;
  for (const double share : {0.01, 1.0, 3.0}) {
    for (const uint64_t most_rays : {uint64_t{1}, uint64_t{8} << 20}) {
      ResidualOptions options;
      options.seed = 2;
      options.decide_at = share * value;
      options.most_rays = most_rays;
      MemoryBudget budget(kRoomy);
      const ResidualEstimate e = MeasureResidual(*scene.store, options, budget);
      const uint64_t round = e.rays / e.points * 3072;
      EXPECT_LE(e.rays, std::max(most_rays, round));
      EXPECT_TRUE(e.low > options.decide_at || e.high < options.decide_at ||
                  e.high - e.low < 0.12 * e.value ||
                  e.rays + round > most_rays);
    }
  }
}

TEST(ResidualCheck, StopsWhenAsked) {
  const SolvedScene scene = LampOverSquare();
  const std::atomic<bool> stop = true;
  ResidualOptions options;
  options.stop = &stop;
  MemoryBudget budget(kRoomy);
  EXPECT_THROW(MeasureResidual(*scene.store, options, budget),
               InterruptedError);
  EXPECT_EQ(budget.UsedBytes(), 0U);
}

}  // namespace
}  // namespace enfilade
