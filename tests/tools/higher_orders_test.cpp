// The bases beyond Haar and M2 through the whole program: closed forms, and all
// that is done with a store.

#include "solver/solution/solution.h"
#include "solver/transfer/form_factor.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

// A point of a patch, its share of the patch's area, and what the solution has.
struct GridSample {
  Point3 at;
  Vec3 normal;
  double area = 0;       // m2
  double radiosity = 0;  // red, W/m2
  bool emits = false;
};

constexpr int kGridEdge = 37;

// A grid of points on a patch; a triangle takes the lower half of it, twice.
std::vector<PatchPoint> GridOn(const Patch& patch, CellId cell, size_t index) {
  std::vector<PatchPoint> points;
  for (int j = 0; j < kGridEdge; ++j) {
    for (int i = 0; i < kGridEdge; ++i) {
      double a = (i + 0.5) / kGridEdge;
      double b = (j + 0.5) / kGridEdge;
      if (patch.shape == PatchShape::kTriangle && a + b > 1) {
        a = 1 - a;
        b = 1 - b;
      }
      points.push_back({cell, PatchId(index), a, b});
    }
  }
  return points;
}

std::vector<GridSample> GridSamplesOf(const std::string& store_path) {
  const auto store = OpenStore(store_path, StoreAccess::kRead);
  MemoryBudget budget(1ULL << 30);
  const Solution solution(*store, budget);
  std::vector<GridSample> samples;
  for (size_t c = 0; c < solution.CellCount(); ++c) {
    const CellPatches cell = LoadCellPatches(*store, CellId(c));
    for (size_t i = 0; i < cell.patches.size(); ++i) {
      const Patch& patch = cell.patches[i];
      const auto points = GridOn(patch, CellId(c), i);
      const std::vector<Rgb> values = solution.Radiosity(points);
      for (size_t k = 0; k < points.size(); ++k) {
        samples.push_back(
            {patch.origin + patch.u * points[k].a + patch.v * points[k].b,
             PatchNormal(patch),
             PatchArea(patch) / static_cast<double>(points.size()),
             values[k][0],
             patch.emits});
      }
    }
  }
  return samples;
}

// A column of a table of numbers and names without commas.
std::vector<double> ColumnOf(const std::string& csv, const std::string& name) {
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  const auto cells = [&line] {
    std::vector<std::string> fields;
    std::istringstream row(line);
    for (std::string field; std::getline(row, field, ',');) {
      fields.push_back(field);
    }
    return fields;
  };
  const std::vector<std::string> names = cells();
  const auto column = static_cast<size_t>(
      std::find(names.begin(), names.end(), name) - names.begin());
  std::vector<double> values;
  while (std::getline(lines, line)) {
    values.push_back(std::stod(cells().at(column)));
  }
  return values;
}

class HigherOrders : public ::testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] std::string Store() const { return folder_ / "a.enf"; }

  void MakeScene(std::vector<std::string> scene) {
    scene.insert(scene.begin(), "scene");
    scene.push_back(folder_ / "a.obj");
    ASSERT_EQ(RunProgram(scene).exit_code, 0);
  }

  void Solve(const std::string& error) {
    std::filesystem::remove(Store());
    const ProgramResult solved = RunProgram({"solve",
                                             folder_ / "a.obj",
                                             "-o",
                                             Store(),
                                             "--basis",
                                             GetParam(),
                                             "--error",
                                             error});
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
  }

  // The RMS error of the square at z = 0, of reflectance 1/2, over its mean:
  // B = 1/2 F(y -> emitter), exact at every point.
  [[nodiscard]] double ErrorOfReceiver(
      const std::array<Vec3f, 4>& emitter) const {
    double square = 0;
    double exact = 0;
    double area = 0;
    for (const GridSample& s : GridSamplesOf(Store())) {
      if (std::abs(s.at.z) < 1e-6 && s.normal.z > 0.5) {
        const double b0 =
            0.5 * static_cast<double>(PointToPolygon(
                      ToFloat(s.at - Point3{}), {0, 0, 1}, emitter));
        square += s.area * (s.radiosity - b0) * (s.radiosity - b0);
        exact += s.area * b0;
        area += s.area;
      }
    }
    EXPECT_NEAR(area, 1, 1e-6);
    return std::sqrt(square) / exact;
  }

  // The RMS of B / B0 - 1 over what emits, B0 = E / (1 - rho) = 2.
  [[nodiscard]] double ErrorOfFurnace() const {
    double square = 0;
    double area = 0;
    for (const GridSample& s : GridSamplesOf(Store())) {
      if (s.emits) {
        square += s.area * (s.radiosity / 2 - 1) * (s.radiosity / 2 - 1);
        area += s.area;
      }
    }
    EXPECT_GT(area, 0);
    return std::sqrt(square / area);
  }

  TemporaryFolder folder_;
};

TEST_P(HigherOrders, SquaresFaceToFaceMeetTheErrorAskedFor) {
  for (const char* separation : {"0.5", "1", "2"}) {
    MakeScene({"parallel", "--separation", separation});
    Solve("0.01");
    const float z = std::stof(separation);
    EXPECT_LE(ErrorOfReceiver({{{0, 0, z}, {0, 1, z}, {1, 1, z}, {1, 0, z}}}),
              0.01)
        << separation;
  }
}

TEST_P(HigherOrders, SquaresAtARightAngleMeetTheErrorAskedFor) {
  for (const char* separation : {"0", "0.1", "1"}) {
    MakeScene({"perpendicular", "--separation", separation});
    Solve("0.01");
    const float x = -std::stof(separation);
    EXPECT_LE(ErrorOfReceiver({{{x, 0, 0}, {x, 1, 0}, {x, 1, 1}, {x, 0, 1}}}),
              0.01)
        << separation;
  }
}

TEST_P(HigherOrders, FurnaceOfBoxesMeetsTheErrorAskedFor) {
  MakeScene({"furnace", "--count", "0"});
  Solve("0.02");
  EXPECT_LE(ErrorOfFurnace(), 0.02);
}

// On triangles the bases have nodes of their own; M4 and the flatlets have more
// nodes than functions.
TEST_P(HigherOrders, FurnaceOfTrianglesMeetsTheErrorAskedFor) {
  WriteFile(folder_.Path() / "a.mtl",
            "newmtl glow\nKd 0.5 0.5 0.5\nKe 1 1 1\n");
  WriteFile(folder_.Path() / "a.obj",
            "mtllib a.mtl\nusemtl glow\n"
            "v 0 0 0\nv 2 0 0\nv 0.3 1.5 0\nv 0.5 0.4 1.2\n"
            "f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n");
  Solve("0.02");
  EXPECT_LE(ErrorOfFurnace(), 0.02);
}

std::string DigestOf(const std::string& report) {
  return json::parse(ReadFile(report)).at("digest").get<std::string>();
}

TEST_P(HigherOrders, BitsDependNeitherOnThreadsNorOnTheCap) {
  WriteRoomScene(folder_.Path() / "a.obj", 2);
  std::vector<std::string> digests;
  for (const auto& [threads, memory] :
       {std::pair{"1", "1G"}, {"2", "1G"}, {"2", "48M"}}) {
    const std::string name = std::string("a") + threads + memory;
    const ProgramResult solved = RunProgram({"solve",
                                             folder_ / "a.obj",
                                             "-o",
                                             folder_ / (name + ".enf"),
                                             "--basis",
                                             GetParam(),
                                             "--error",
                                             "0.1",
                                             "--threads",
                                             threads,
                                             "--memory",
                                             memory,
                                             "--report",
                                             folder_ / (name + ".json")});
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
    digests.push_back(DigestOf(folder_ / (name + ".json")));
  }
  EXPECT_EQ(digests[0], digests[1]);
  EXPECT_EQ(digests[0], digests[2]);
}

TEST_P(HigherOrders, StoresAreResumedProbedVerifiedAndExported) {
  WriteRoomScene(folder_.Path() / "a.obj", 1);
  Solve("0.1");
  const std::string report = folder_ / "report.json";
  ASSERT_EQ(
      RunProgram({"resume", Store(), "--error", "0.07", "--report", report})
          .exit_code,
      0);
  const json resumed = json::parse(ReadFile(report));
  EXPECT_EQ(resumed.at("basis"), GetParam());
  EXPECT_LE(resumed.at("estimated_error").get<double>(), 0.07);
  ASSERT_EQ(
      RunProgram({"verify", Store(), "--report", report, "--seconds", "5"})
          .exit_code,
      0);
  const json verified = json::parse(ReadFile(report));
  EXPECT_LE(verified.at("error_low").get<double>(), 0.07);
  EXPECT_LE(verified.at("error_high").get<double>(), 2 * 0.07) << "not sure";
  WriteFile(folder_.Path() / "points.csv", "2,2,0,0,0,1\n");
  EXPECT_EQ(RunProgram({"probe", Store(), folder_ / "points.csv"}).exit_code,
            0);
  for (const char* name : {"a.ply", "a.csv", "a.vtu"}) {
    EXPECT_EQ(RunProgram({"export", Store(), folder_ / name}).exit_code, 0)
        << name;
    EXPECT_FALSE(ReadFile(folder_.Path() / name).empty()) << name;
  }
}

// The nodes of these bases are not at the corners of elements, so the mean of
// the corners is not the mean.
TEST_P(HigherOrders, TablesHaveTheMeanOfEachPatch) {
  WriteRoomScene(folder_.Path() / "a.obj", 1);
  Solve("0.2");
  ASSERT_EQ(RunProgram({"export", Store(), folder_ / "a.csv"}).exit_code, 0);
  const std::vector<double> means =
      ColumnOf(ReadFile(folder_.Path() / "a.csv"), "radiosity_r");
  const std::vector<GridSample> samples = GridSamplesOf(Store());
  ASSERT_GT(means.size(), 0U);
  ASSERT_EQ(samples.size(), means.size() * kGridEdge * kGridEdge);
  for (size_t p = 0; p < means.size(); ++p) {
    double sum = 0;
    double low = 1e300;
    double high = 0;
    for (size_t k = 0; k < kGridEdge * kGridEdge; ++k) {
      const double b = samples[p * kGridEdge * kGridEdge + k].radiosity;
      sum += b;
      low = std::min(low, b);
      high = std::max(high, b);
    }
    // A grid of n by n points misses a step by at most a row of points, or a
    // row in each direction: 2 / n of the range. A smooth function is met much
    // better.
    EXPECT_NEAR(means[p],
                sum / (kGridEdge * kGridEdge),
                2.0 / kGridEdge * (high - low) + 1e-6 * high)
        << p;
  }
}

INSTANTIATE_TEST_SUITE_P(Bases,
                         HigherOrders,
                         ::testing::Values("m3", "m4", "f2", "f3"),
                         [](const ::testing::TestParamInfo<const char*>& test) {
                           return std::string(test.param);
                         });

}  // namespace
}  // namespace enfilade
