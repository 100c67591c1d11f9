// Light whose answer is known: the whole way from the scene to the stored
// solution against the closed forms of scenes/.

#include "base/planar_polygon.h"
#include "solver/solution/solution.h"
#include "solver/transfer/form_factor.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// What one point of a solution stands for.
struct SolvedPoint {
  Point3 at;
  Vec3 normal;
  double area = 0;       // m2
  double radiosity = 0;  // red, W/m2
  std::pair<CellId, PatchId> patch;
  bool emits = false;  // the patch does
};

// The points of a leaf at which the square of the polynomial of its corners'
// values is integrated exactly: Gauss points of a parallelogram, middles of the
// edges of a triangle. A point is given by its weights of the corners.
std::vector<std::vector<double>> QuadratureOf(size_t corners) {
  if (corners == 3) {
    return {{0.5, 0.5, 0}, {0, 0.5, 0.5}, {0.5, 0, 0.5}};
  }
  const double g = 0.5 - std::sqrt(1.0 / 12);
  std::vector<std::vector<double>> weights;
  for (const double a : {g, 1 - g}) {
    for (const double b : {g, 1 - g}) {
      weights.push_back({(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b});
    }
  }
  return weights;
}

void AppendSamples(const LeafElement& leaf,
                   SolvedPoint sample,
                   std::vector<SolvedPoint>* samples) {
  const Vec3 area = AreaVector(leaf.corners);
  const auto points = QuadratureOf(leaf.corners.size());
  sample.normal = Normalize(area);
  sample.area = Length(area) / static_cast<double>(points.size());
  for (const auto& weights : points) {
    Vec3 at;
    sample.radiosity = 0;
    for (size_t i = 0; i < weights.size(); ++i) {
      at = at + (leaf.corners[i] - Point3{}) * weights[i];
      sample.radiosity += weights[i] * leaf.radiosity[i][0];
    }
    sample.at = Point3{} + at;
    samples->push_back(sample);
  }
}

std::vector<SolvedPoint> SamplesOf(const std::string& store_path) {
  const auto store = OpenStore(store_path, StoreAccess::kRead);
  MemoryBudget budget(1ULL << 30);
  const Solution solution(*store, budget);
  std::vector<SolvedPoint> samples;
  for (size_t i = 0; i < solution.CellCount(); ++i) {
    const CellPatches cell = LoadCellPatches(*store, CellId(i));
    solution.ForEachLeaf(CellId(i), [&](const LeafElement& leaf) {
      SolvedPoint sample;
      sample.patch = {CellId(i), leaf.patch};
      sample.emits = cell.patches[leaf.patch.Index()].emits;
      AppendSamples(leaf, sample, &samples);
    });
  }
  return samples;
}

// The scene in the folder's a.obj, solved.
std::vector<SolvedPoint> SolveIn(const TemporaryFolder& folder,
                                 const std::string& basis,
                                 const std::string& error) {
  const ProgramResult solved = RunProgram({"solve",
                                           folder / "a.obj",
                                           "-o",
                                           folder / "a.enf",
                                           "--basis",
                                           basis,
                                           "--error",
                                           error});
  EXPECT_EQ(solved.exit_code, 0) << solved.err;
  return solved.exit_code == 0 ? SamplesOf(folder / "a.enf")
                               : std::vector<SolvedPoint>();
}

// A generated scene, solved.
std::vector<SolvedPoint> Solve(const std::vector<std::string>& scene,
                               const std::string& basis,
                               const std::string& error) {
  const TemporaryFolder folder;
  std::vector<std::string> words = {"scene"};
  words.insert(words.end(), scene.begin(), scene.end());
  words.push_back(folder / "a.obj");
  const ProgramResult written = RunProgram(words);
  EXPECT_EQ(written.exit_code, 0) << written.err;
  return SolveIn(folder, basis, error);
}

// -------------------------------------------------------------- two squares

// The upper side of the unit square at z = 0, of reflectance 1/2.
bool IsOnReceiver(const SolvedPoint& s) {
  return std::abs(s.at.z) < 1e-6 && s.normal.z > 0.5;
}

struct Comparison {
  double rms = 0;         // of B - B0 over the mean of B0
  double deviation = 0;   // of the means
  double exact_mean = 0;  // of B0
};

// The receiver against B0 = 1/2 F(y -> emitter), exact at every point.
Comparison CompareReceiver(const std::vector<SolvedPoint>& samples,
                           const std::array<Vec3f, 4>& emitter) {
  double square = 0;
  double sum = 0;
  double exact = 0;
  double area = 0;
  for (const SolvedPoint& s : samples) {
    if (IsOnReceiver(s)) {
      const double b0 =
          0.5 * static_cast<double>(PointToPolygon(
                    ToFloat(s.at - Point3{}), {0, 0, 1}, emitter));
      square += s.area * (s.radiosity - b0) * (s.radiosity - b0);
      sum += s.area * s.radiosity;
      exact += s.area * b0;
      area += s.area;
    }
  }
  EXPECT_NEAR(area, 1, 1e-6);
  return {std::sqrt(square) / exact, sum / exact - 1, exact};
}

constexpr double kSquaresBound = 0.005;

// The tolerance of the quadrature over the receiver against the closed forms,
// which have six digits; near a singular edge the quadrature is good to half a
// thousandth.
constexpr double kQuadrature = 5e-4;

// A separation and the mean of B at it, of scenes/*.md.
struct Expected {
  const char* separation;
  double mean;
};

void ExpectMatches(const Comparison& c, const Expected& expected) {
  EXPECT_LE(c.rms, kSquaresBound);
  EXPECT_LE(std::abs(c.deviation), kQuadrature);  // of the links' sums, too
  EXPECT_NEAR(c.exact_mean / expected.mean, 1, kQuadrature);
}

void ExpectParallelSquares(const Expected& expected, const std::string& basis) {
  SCOPED_TRACE(basis + " parallel " + expected.separation);
  const float z = std::stof(expected.separation);
  ExpectMatches(
      CompareReceiver(
          Solve(
              {"parallel", "--separation", expected.separation}, basis, "0.01"),
          {{{0, 0, z}, {0, 1, z}, {1, 1, z}, {1, 0, z}}}),
      expected);
}

void ExpectPerpendicularSquares(const Expected& expected,
                                const std::string& basis) {
  SCOPED_TRACE(basis + " perpendicular " + expected.separation);
  const float x = -std::stof(expected.separation);
  ExpectMatches(
      CompareReceiver(
          Solve({"perpendicular", "--separation", expected.separation},
                basis,
                "0.01"),
          {{{x, 0, 0}, {x, 1, 0}, {x, 1, 1}, {x, 0, 1}}}),
      expected);
}

TEST(Squares, FaceToFaceMatchTheClosedForm) {
  for (const Expected& expected :
       {Expected{"0.5", 0.207627}, {"1", 0.099913}, {"2", 0.034295}}) {
    ExpectParallelSquares(expected, "m2");
    ExpectParallelSquares(expected, "haar");
  }
}

// Where nothing reflects, irradiance is all there is to solve for.
TEST(Squares, BlackOnesReceiveTheClosedForm) {
  const TemporaryFolder folder;
  WriteFile(folder / "a.mtl",
            "newmtl black\nKd 0 0 0\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n");
  WriteFile(folder / "a.obj",
            "mtllib a.mtl\n"
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
            "v 0 0 1\nv 0 1 1\nv 1 1 1\nv 1 0 1\n"
            "usemtl black\nf 1 2 3 4\nusemtl lamp\nf 5 6 7 8\n");
  ASSERT_FALSE(SolveIn(folder, "m2", "0.01").empty());
  const auto store = OpenStore(folder / "a.enf", StoreAccess::kRead);
  MemoryBudget budget(1ULL << 30);
  const Solution solution(*store, budget);
  double received = 0;  // W, on the upper side of the square at z = 0
  for (size_t i = 0; i < solution.CellCount(); ++i) {
    solution.ForEachLeaf(CellId(i), [&](const LeafElement& leaf) {
      const Vec3 area = AreaVector(leaf.corners);
      if (area.z > 0 && std::abs(leaf.corners[0].z) < 1e-6) {
        for (const Rgb& irradiance : leaf.irradiance) {
          received += area.z * irradiance[0] /
                      static_cast<double>(leaf.irradiance.size());
        }
      }
    });
  }
  EXPECT_NEAR(received, 0.199825, 0.01 * 0.199825);
}

TEST(Squares, AtARightAngleMatchTheClosedForm) {
  for (const Expected& expected :
       {Expected{"0", 0.100022}, {"0.1", 0.081412}, {"1", 0.016405}}) {
    ExpectPerpendicularSquares(expected, "m2");
  }
  ExpectPerpendicularSquares({"0.4", 0.045734}, "haar");
}

// ------------------------------------------------------------------ furnace

struct FurnaceError {
  double rms = 0;      // of B (1 - rho) / E - 1, by area
  double mean = 0;     // of the same
  double largest = 0;  // deviation of the mean of a patch
};

// E = 1 and rho everywhere, so B = 1 / (1 - rho) on every emitting side.
FurnaceError MeasureFurnace(const std::vector<SolvedPoint>& samples,
                            double rho) {
  FurnaceError f;
  double area = 0;
  std::map<std::pair<CellId, PatchId>, std::pair<double, double>> patches;
  for (const SolvedPoint& s : samples) {
    if (s.emits) {
      const double off = (1 - rho) * s.radiosity - 1;
      f.rms += s.area * off * off;
      f.mean += s.area * off;
      area += s.area;
      patches[s.patch].first += s.area;
      patches[s.patch].second += s.area * off;
    }
  }
  f.rms = std::sqrt(f.rms / area);
  f.mean /= area;
  for (const auto& [patch, sums] : patches) {
    f.largest = std::max(f.largest, std::abs(sums.second / sums.first));
  }
  return f;
}

void ExpectFlat(const std::string& chairs,
                const std::string& basis,
                const std::string& error) {
  const FurnaceError f =
      MeasureFurnace(Solve({"furnace", "--count", chairs}, basis, error), 0.5);
  EXPECT_LE(f.rms, 0.01) << basis << " at " << error;
  EXPECT_LE(f.largest, 0.05) << basis << " at " << error;
}

TEST(FurnaceRoom, EmptyRoomComesOutFlat) {
  ExpectFlat("0", "haar", "0.02");
  ExpectFlat("0", "m2", "0.02");
}

// The requested errors are as small as the bounds need: an RMS of 0.011 (haar
// at 0.05 and m2 at 0.035) misses the bounds.
TEST(SlowFurnaceRoom, NineChairsComeOutFlat) {
  ExpectFlat("9", "haar", "0.035");
  ExpectFlat("9", "m2", "0.025");
}

// A room of 2 x 2 x 2 m whose walls the file has twice, as exporters do where
// two objects touch. Were both seen, light would grow with every bounce.
TEST(FurnaceRoom, WallsWrittenTwiceCountOnce) {
  const TemporaryFolder folder;
  WriteFile(folder / "a.mtl",
            "newmtl one\nKd 0.6 0.6 0.6\nKe 1 1 1\n"
            "newmtl two\nKd 0.6 0.6 0.6\nKe 1 1 1\n");
  std::string obj = "mtllib a.mtl\n";
  for (int i = 0; i < 8; ++i) {
    obj += "v " + std::to_string(2 * (i & 1)) + " " + std::to_string(i & 2) +
           " " + std::to_string((i & 4) / 2) + "\n";
  }
  for (const char* name : {"one", "two"}) {
    obj += std::string("o ") + name + "\nusemtl " + name + "\n" +
           "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\n"
           "f 2 6 8 4\n";
  }
  WriteFile(folder / "a.obj", obj);
  const FurnaceError f = MeasureFurnace(SolveIn(folder, "m2", "0.02"), 0.6);
  EXPECT_LE(f.rms, 0.01);
}

// Light is reflected twenty times, and with it the errors in the sums of the
// links: they must not be one-sided.
TEST(SlowFurnaceRoom, WhiteRoomIsAsBrightAsItShouldBe) {
  const FurnaceError f = MeasureFurnace(
      Solve({"furnace", "--count", "4", "--reflectance", "0.95"}, "m2", "0.05"),
      0.95);
  EXPECT_LE(f.rms, 0.05);
  // Were all errors of one sign, the mean would be nearly the RMS.
  EXPECT_LE(std::abs(f.mean), 0.05 / 4);
}

}  // namespace
}  // namespace enfilade
