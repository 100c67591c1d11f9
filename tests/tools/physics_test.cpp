// Light whose answer is known: the whole way from the scene to the stored
// solution against the closed forms of scenes/.

#include "solver/form_factor.h"
#include "solver/solution.h"
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
struct Sample {
  Point3 at;
  Vec3 normal;
  double area = 0;       // m2
  double radiosity = 0;  // red, W/m2
  std::pair<CellId, PatchId> patch;
  bool emits = false;  // the patch does
};

// The points of a leaf at which a polynomial of its corners' values, squared,
// is integrated exactly: Gauss points of a parallelogram, middles of the edges
// of a triangle. By their weights of the corners.
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
                   Sample sample,
                   std::vector<Sample>* samples) {
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

std::vector<Sample> SamplesOf(const std::string& store_path) {
  const auto store = OpenStore(store_path, StoreAccess::kRead);
  MemoryBudget budget(1ULL << 30);
  const Solution solution(*store, budget);
  std::vector<Sample> samples;
  for (size_t i = 0; i < solution.CellCount(); ++i) {
    const CellPatches cell = LoadCellPatches(*store, CellId(i));
    solution.ForEachLeaf(CellId(i), [&](const LeafElement& leaf) {
      Sample sample;
      sample.patch = {CellId(i), leaf.patch};
      sample.emits = cell.patches[leaf.patch.Index()].emits;
      AppendSamples(leaf, sample, &samples);
    });
  }
  return samples;
}

// A generated scene, solved.
std::vector<Sample> Solve(const std::vector<std::string>& scene,
                          const std::string& basis,
                          const std::string& error) {
  const TemporaryFolder folder;
  std::vector<std::string> words = {"scene"};
  words.insert(words.end(), scene.begin(), scene.end());
  words.push_back(folder / "a.obj");
  const ProgramResult written = RunProgram(words);
  EXPECT_EQ(written.exit_code, 0) << written.err;
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
                               : std::vector<Sample>();
}

// -------------------------------------------------------------- two squares

// The upper side of the unit square at z = 0, of reflectance 1/2.
bool IsOnReceiver(const Sample& s) {
  return std::abs(s.at.z) < 1e-6 && s.normal.z > 0.5;
}

struct Comparison {
  double rms = 0;        // of B - B0 over the mean of B0
  double deviation = 0;  // of the means
};

// The receiver against B0 = 1/2 F(y -> emitter), exact at every point.
Comparison CompareReceiver(const std::vector<Sample>& samples,
                           const std::array<Vec3f, 4>& emitter) {
  double square = 0;
  double sum = 0;
  double exact = 0;
  double area = 0;
  for (const Sample& s : samples) {
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
  return {std::sqrt(square) / exact, sum / exact - 1};
}

constexpr double kSquaresBound = 0.005;

// The squares d apart face to face.
void ExpectParallelSquares(const std::string& d,
                           const std::string& basis,
                           const std::string& error) {
  const float z = std::stof(d);
  const Comparison c =
      CompareReceiver(Solve({"parallel", "--separation", d}, basis, error),
                      {{{0, 0, z}, {0, 1, z}, {1, 1, z}, {1, 0, z}}});
  EXPECT_LE(c.rms, kSquaresBound) << basis << ", " << d << " apart";
  EXPECT_LE(std::abs(c.deviation), c.rms);
}

// The squares at a right angle, with a gap of s.
void ExpectPerpendicularSquares(const std::string& gap,
                                const std::string& basis,
                                const std::string& error) {
  const float x = -std::stof(gap);
  const Comparison c = CompareReceiver(
      Solve({"perpendicular", "--separation", gap}, basis, error),
      {{{x, 0, 0}, {x, 1, 0}, {x, 1, 1}, {x, 0, 1}}});
  EXPECT_LE(c.rms, kSquaresBound) << basis << ", gap of " << gap;
  EXPECT_LE(std::abs(c.deviation), c.rms);
}

TEST(Squares, FaceToFaceMatchTheClosedForm) {
  for (const char* d : {"0.5", "1", "2"}) {
    ExpectParallelSquares(d, "m2", "0.01");
    ExpectParallelSquares(d, "haar", "0.01");
  }
}

TEST(Squares, AtARightAngleMatchTheClosedForm) {
  for (const char* gap : {"0", "0.1", "1"}) {
    ExpectPerpendicularSquares(gap, "m2", "0.01");
  }
  ExpectPerpendicularSquares("0.4", "haar", "0.01");
}

// ------------------------------------------------------------------ furnace

struct Furnace {
  double rms = 0;      // of B (1 - rho) / E - 1, by area
  double mean = 0;     // of the same
  double largest = 0;  // deviation of the mean of a patch
};

// E = 1 and rho = 1/2 everywhere, so B = 2 on every emitting side.
Furnace MeasureFurnace(const std::vector<Sample>& samples) {
  Furnace f;
  double area = 0;
  std::map<std::pair<CellId, PatchId>, std::pair<double, double>> patches;
  for (const Sample& s : samples) {
    if (s.emits) {
      const double off = 0.5 * s.radiosity - 1;
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
  const Furnace f =
      MeasureFurnace(Solve({"furnace", "--count", chairs}, basis, error));
  EXPECT_LE(f.rms, 0.01) << basis << " at " << error;
  EXPECT_LE(f.largest, 0.05) << basis << " at " << error;
}

TEST(FurnaceRoom, EmptyRoomComesOutFlat) {
  ExpectFlat("0", "haar", "0.02");
  ExpectFlat("0", "m2", "0.02");
}

// The errors asked for here are what the bounds take: at 0.05 the RMS is 0.013,
// nearly all of it in contact shadows that links blur.
TEST(SlowFurnaceRoom, NineChairsComeOutFlat) {
  ExpectFlat("9", "haar", "0.025");
  ExpectFlat("9", "m2", "0.025");
}

}  // namespace
}  // namespace enfilade
