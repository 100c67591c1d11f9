// The display mesh of a solved scene has no steps, the same mean, and the same
// bits under any cap and number of threads.

#include "base/planar_polygon.h"
#include "solver/solution/display_solution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include "tools/commands/options.h"
#include "tools/export/elements.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

constexpr uint64_t kBudgetBytes = 256ULL << 20;

// The chairs of the 1997 study, solved to an error of 0.1.
class DisplayOfChairs : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    ASSERT_EQ(
        RunProgram({"scene", "chairs", "--count", GetParam(), Path("c.obj")})
            .exit_code,
        0);
    ASSERT_EQ(
        RunProgram(
            {"solve", Path("c.obj"), "-o", Path("c.enf"), "--error", "0.1"})
            .exit_code,
        0);
  }

  [[nodiscard]] std::string Path(const std::string& name) const {
    return folder_ / name;
  }

  // Exports and returns the file.
  [[nodiscard]] std::string Export(const std::string& name,
                                   const std::vector<std::string>& more) const {
    std::vector<std::string> words = {"export", Path("c.enf"), Path(name)};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult result = RunProgram(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return ReadFile(Path(name));
  }

  TemporaryFolder folder_;
};

// Patch coordinates of a point.
PatchPoint OnPatch(CellId cell, PatchId id, const Patch& patch, Point3 p) {
  const Vec3 n = Cross(patch.u, patch.v);
  const Vec3 d = p - patch.origin;
  return {cell,
          id,
          Dot(Cross(d, patch.v), n) / Dot(n, n),
          Dot(Cross(patch.u, d), n) / Dot(n, n)};
}

bool IsInside(const Patch& patch, const PatchPoint& p) {
  const double most = patch.shape == PatchShape::kTriangle ? 1 - p.a : 1;
  return p.a > 0 && p.b > 0 && p.a < 1 && p.b < most;
}

// Pairs of points, a hair on either side of the edges of the leaves of a cell,
// a quarter along the edge.
std::vector<PatchPoint> AcrossBorders(const Solution& solution,
                                      CellId cell,
                                      const CellPatches& patches) {
  constexpr double kHair = 1e-5;
  std::vector<PatchPoint> pairs;
  solution.ForEachLeaf(cell, [&](const LeafElement& leaf) {
    const Patch& patch = patches.patches[leaf.patch.Index()];
    const size_t n = leaf.corners.size();
    const Point3 centre = Lerp(Lerp(leaf.corners[0], leaf.corners[1], 0.5),
                               leaf.corners[2],
                               n == 4 ? 0.5 : 1.0 / 3);
    for (size_t i = 0; i < n; ++i) {
      const Point3 at = Lerp(leaf.corners[i], leaf.corners[(i + 1) % n], 0.25);
      const PatchPoint in =
          OnPatch(cell, leaf.patch, patch, Lerp(at, centre, kHair));
      const PatchPoint out =
          OnPatch(cell, leaf.patch, patch, Lerp(at, centre, -kHair));
      if (IsInside(patch, out)) {
        pairs.push_back(in);
        pairs.push_back(out);
      }
    }
  });
  return pairs;
}

double LargestStep(const std::vector<Rgb>& pairs) {
  double largest = 0;
  for (size_t i = 0; i + 1 < pairs.size(); i += 2) {
    for (size_t c = 0; c < kRgbChannels; ++c) {
      largest = std::max(largest, std::abs(pairs[i][c] - pairs[i + 1][c]));
    }
  }
  return largest;
}

// The integrals of irradiance by channel, and the area.
struct Total {
  Rgb integral{};
  double area_m2 = 0;
};

Total TotalOf(const MeshSource& mesh) {
  Total total;
  MeshSink sink;
  sink.vertex = [&](const MeshVertex& v) {
    for (size_t c = 0; c < kRgbChannels; ++c) {
      total.integral[c] += v.area_m2 * v.irradiance[c];
    }
    total.area_m2 += v.area_m2;
  };
  sink.face = [](const MeshFace&) {};
  ForEachFace(mesh, {}, sink);
  return total;
}

MeshSource LeavesOf(const Solution& solution) {
  ElementSource source;
  source.cells = solution.CellCount();
  source.for_each_leaf =
      [&solution](CellId cell,
                  const std::function<void(const LeafElement&)>& visit) {
        solution.ForEachLeaf(cell, visit);
      };
  return LeavesOf(source);
}

TEST_P(DisplayOfChairs, HasNoStepsAtElementBorders) {
  MemoryBudget budget(kBudgetBytes);
  const auto store = OpenSolvedStore(Path("c.enf"));
  const Solution solution(*store, budget);
  double before = 0;
  double after = 0;
  Rgb sum{};
  double area_m2 = 0;
  for (size_t c = 0; c < solution.CellCount(); ++c) {
    const CellPatches patches = LoadCellPatches(*store, CellId(c));
    const auto pairs = AcrossBorders(solution, CellId(c), patches);
    before = std::max(before, LargestStep(solution.Radiosity(pairs)));
    after = std::max(after,
                     LargestStep(DisplaySolution(solution).Radiosity(pairs)));
    solution.ForEachLeaf(CellId(c), [&](const LeafElement& leaf) {
      if (patches.patches[leaf.patch.Index()].emits) {
        return;
      }
      const double area = PolygonArea(leaf.corners);
      area_m2 += area;
      for (const Rgb& b : leaf.radiosity) {
        for (size_t k = 0; k < kRgbChannels; ++k) {
          sum[k] += area * b[k] / static_cast<double>(leaf.radiosity.size());
        }
      }
    });
  }
  const double mean = (sum[0] + sum[1] + sum[2]) / (kRgbChannels * area_m2);
  RecordProperty("step_before", std::to_string(before / mean));
  RecordProperty("step_after", std::to_string(after / mean));
  EXPECT_GT(before, 0.1 * mean);  // there is something to smooth
  EXPECT_LE(after, 0.02 * mean);
}

// The means are equal up to single precision: values and weights are good to
// 1e-7 each.
TEST_P(DisplayOfChairs, HasTheMeanOfTheSolution) {
  MemoryBudget budget(kBudgetBytes);
  const auto store = OpenSolvedStore(Path("c.enf"));
  const Solution solution(*store, budget);
  const Total leaves = TotalOf(LeavesOf(solution));
  const Total shown = TotalOf(DisplayMeshOf(solution, {}));
  EXPECT_NEAR(shown.area_m2, leaves.area_m2, 1e-9 * leaves.area_m2);
  for (size_t c = 0; c < kRgbChannels; ++c) {
    EXPECT_NEAR(
        shown.integral[c], leaves.integral[c], 1e-5 * leaves.integral[c]);
  }
  EXPECT_EQ(budget.UsedBytes(), 0U);
}

TEST_P(DisplayOfChairs, HasTheSameBitsForAnyThreadsAndCap) {
  for (const std::string name : {"c.ply", "c.glb", "c.png"}) {
    const auto with = [&](std::vector<std::string> words) {
      if (name == "c.png") {
        words.insert(words.end(), {"--size", "160,90"});
      }
      return Export(name, words);
    };
    const std::string one = with({"--threads", "1", "--memory", "none"});
    EXPECT_GT(one.size(), 1000U);
    EXPECT_EQ(with({"--threads", "2"}), one);
    EXPECT_EQ(with({"--memory", "34M"}), one);
  }
}

TEST_P(DisplayOfChairs, MeshIsAsAsked) {
  const auto faces = [&](const std::string& name,
                         const std::vector<std::string>& more) {
    std::vector<std::string> words = more;
    words.insert(words.end(), {"--report", Path("r.json")});
    static_cast<void>(Export(name, words));
    return nlohmann::json::parse(ReadFile(Path("r.json")))
        .at("elements")
        .get<uint64_t>();
  };
  const uint64_t leaves = faces("c.vtu", {});
  EXPECT_EQ(faces("c.ply", {"--mesh", "leaves"}), leaves);
  const uint64_t smooth = faces("c.ply", {});
  EXPECT_GT(smooth, 2 * leaves);  // triangles
  EXPECT_EQ(faces("c.glb", {"--mesh", "anchored"}), smooth);
  EXPECT_EQ(faces("c.vtu", {"--mesh", "smooth"}), smooth);
  EXPECT_NE(Export("a.png", {"--size", "80,45"}),
            Export("b.png", {"--size", "80,45", "--mesh", "leaves"}));
}

TEST_P(DisplayOfChairs, ExportSaysWhatItWrote) {
  const auto said = [&](const std::string& name) {
    std::vector<std::string> words = {"export", Path("c.enf"), Path(name)};
    if (name == "c.png") {
      words.insert(words.end(), {"--size", "80,45"});
    }
    return RunProgram(words).out;
  };
  EXPECT_EQ(said("c.ply").find("wrote " + Path("c.ply") + ": "), 0U);
  EXPECT_NE(said("c.ply").find(" elements, "), std::string::npos);
  EXPECT_EQ(said("c.png").find("wrote " + Path("c.png") + ": 80 x 45 pixels, "),
            0U);
}

TEST_P(DisplayOfChairs, WhatAFormatCannotHoldIsAUsageError) {
  const std::string store = Path("c.enf");
  EXPECT_EQ(RunProgram({"export", store, Path("c.csv"), "--mesh", "leaves"})
                .exit_code,
            2);
  EXPECT_EQ(RunProgram({"export", store, Path("c.png"), "--mesh", "anchored"})
                .exit_code,
            2);
}

INSTANTIATE_TEST_SUITE_P(Counts,
                         DisplayOfChairs,
                         ::testing::Values("16", "36"));

}  // namespace
}  // namespace enfilade
