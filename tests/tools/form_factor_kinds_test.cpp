// The kinds of form factors against closed forms, and which options go
// together.

#include "solver/reference/form_factors.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

const std::vector<std::string> kKinds = {
    "exact", "point", "polygon", "switch", "hemicube", "montecarlo"};
const std::vector<std::string> kTraced = {"hemicube", "montecarlo"};

// Two unit squares face to face at distance 1.
constexpr double kParallel = 0.199825;

// The panels of a scene and all form factors between them by a given kind,
// before any row is scaled.
class Panels {
 public:
  Panels(const std::string& store_path, double longest_edge)
      : store_(OpenStore(store_path, StoreAccess::kRead)),
        budget_(uint64_t{1} << 30),
        scene_(*store_, 1, budget_),
        panels_(scene_.Dice(longest_edge)),
        index_(scene_) {
    for (size_t i = 0; i < panels_.size(); ++i) {
      index_.Add(panels_[i], i);
    }
  }

  [[nodiscard]] const std::vector<Panel>& All() const { return panels_; }

  [[nodiscard]] bool Emits(size_t i) const {
    return scene_.ExitanceOf(panels_[i])[0] > 0;
  }

  // The center of a panel in world coordinates.
  [[nodiscard]] Point3 CenterOf(size_t i) const {
    const Vec3f center = panels_[i].end.center;
    return scene_.Origin() + Vec3{center.x, center.y, center.z};
  }

  // A_i F_ij of all panels i and j.
  std::vector<std::vector<float>> Exchanges(const std::string& kind,
                                            const std::string& projection) {
    MethodOptions method;
    method.form_factors = kind;
    method.projection = projection;
    FormFactors form_factors(
        scene_, FormFactorOptionsOf(method), *store_, budget_);
    std::vector<std::vector<float>> rows(panels_.size());
    for (size_t i = 0; i < panels_.size(); ++i) {
      if (form_factors.Options().AreTraced()) {
        rows[i] = form_factors.TraceRow(panels_[i], index_);
        continue;
      }
      for (const Panel& j : panels_) {
        rows[i].push_back(form_factors.Exchange(panels_[i], j));
      }
    }
    return rows;
  }

  [[nodiscard]] bool Face(size_t i, size_t j) const {
    return ReferenceScene::Face(panels_[i], panels_[j]);
  }

  [[nodiscard]] float VisibleShare(size_t i, size_t j) const {
    return scene_.VisibleShare(panels_[i], panels_[j]);
  }

  [[nodiscard]] bool IsEnclosed(size_t i) const {
    return scene_.IsEnclosed(panels_[i]);
  }

  // The mean form factor of the upper side of the plane z = 0 to all panels
  // that emit.
  double ToLights(const std::string& kind,
                  const std::string& projection = "galerkin") {
    const auto rows = Exchanges(kind, projection);
    double exchange = 0;
    double area = 0;
    for (size_t i = 0; i < panels_.size(); ++i) {
      if (panels_[i].end.patch->normal.z < 0.5F ||
          std::abs(CenterOf(i).z) > 1e-6) {
        continue;
      }
      area += static_cast<double>(panels_[i].end.area);
      for (size_t j = 0; j < panels_.size(); ++j) {
        exchange += Emits(j) ? static_cast<double>(rows[i][j]) : 0;
      }
    }
    return exchange / area;
  }

 private:
  std::unique_ptr<BlockStorage> store_;
  MemoryBudget budget_;
  ReferenceScene scene_;
  std::vector<Panel> panels_;
  PanelIndex index_;
};

class FormFactorKinds : public ::testing::Test {
 protected:
  ProgramResult Solve(std::vector<std::string> more) {
    std::vector<std::string> words = {"solve",
                                      folder_ / "a.obj",
                                      "-o",
                                      folder_ / "a.enf",
                                      "--elements",
                                      "30",
                                      "--report",
                                      folder_ / "a.json"};
    words.insert(words.end(), more.begin(), more.end());
    return RunProgram(words);
  }

  // Makes a store of a scene that has everything but fine elements.
  std::string StoreOf(std::vector<std::string> words) {
    words.insert(words.begin(), "scene");
    words.push_back(folder_ / "a.obj");
    EXPECT_EQ(RunProgram(words).exit_code, 0);
    std::filesystem::remove(folder_ / "a.enf");
    EXPECT_EQ(Solve({"--method", "matrix"}).exit_code, 0);
    return folder_ / "a.enf";
  }

  TemporaryFolder folder_;
};

// The floor lies half before a board that stands over its middle, and half
// behind it. There is nothing else, so that what faces the board sees all of
// it.
TEST_F(FormFactorKinds, ThatWhichLiesBehindAHorizonIsNotHidden) {
  WriteFile(folder_ / "a.mtl",
            "newmtl floor\nKd 0.5 0.5 0.5\n"
            "newmtl board\nKd 0.5 0.5 0.5\nKe 1 1 1\n");
  WriteFile(folder_ / "a.obj",
            "mtllib a.mtl\n"
            "v -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\n"
            "v 0 0 0.05\nv 0 1 0.05\nv 0 1 1.05\nv 0 0 1.05\n"
            "usemtl floor\nf 1 2 3 4\nusemtl board\nf 5 6 7 8\n");
  ASSERT_EQ(Solve({"--method", "matrix"}).exit_code, 0);
  for (const double edge : {2.0, 0.7}) {
    const Panels panels(folder_ / "a.enf", edge);
    size_t facing = 0;
    for (size_t i = 0; i < panels.All().size(); ++i) {
      for (size_t j = 0; j < panels.All().size(); ++j) {
        if (i != j && panels.Face(i, j)) {
          ++facing;
          EXPECT_EQ(panels.VisibleShare(i, j), 1) << i << " " << j;
        }
      }
    }
    EXPECT_GE(facing, 2U) << edge;
  }
}

// Between panels of edge h at distance 1 both midpoint rules are wrong by the
// second derivatives of 1 / (pi r^4), |f''| < 4 / pi: h^2 / 24 of them in each
// of four directions, 0.21 h^2 at most. The kind `polygon` has the error of
// half of the directions. The kind `exact` is wrong by what Gauss points leave
// out, far less.
TEST_F(FormFactorKinds, ParallelSquaresConvergeToTheClosedForm) {
  const std::string store = StoreOf({"parallel"});
  for (const char* kind : {"exact", "point", "polygon", "switch"}) {
    double before = 1;
    for (const double h : {0.5, 0.25, 0.125}) {
      const double error =
          std::abs(Panels(store, h).ToLights(kind) - kParallel);
      EXPECT_LE(error, 0.21 * h * h + 2e-4) << kind << " " << h;
      EXPECT_LE(error, before + 2e-4) << kind << " " << h;
      before = error;
    }
    EXPECT_LE(before, 0.002) << kind;
  }
}

// The form factor between the squares if all is at the middles of n x n panels:
// the kernel 1 / (pi r^4) at distance 1, for every distance aside.
double SumOverMiddles(int n) {
  double sum = 0;
  for (int i = 1 - n; i < n; ++i) {
    for (int k = 1 - n; k < n; ++k) {
      const double r2 = 1 + static_cast<double>(i * i + k * k) / (n * n);
      sum += (n - std::abs(i)) * (n - std::abs(k)) / (r2 * r2);
    }
  }
  return sum / (3.14159265 * std::pow(n, 4));
}

// The sum is exact but for single precision. It converges by slopes of 2.135
// and 2.028, whose excess falls to a quarter with the square of the edge.
TEST_F(FormFactorKinds, PointToPointConvergesAtTheSecondOrder) {
  const std::string store = StoreOf({"parallel"});
  const auto error = [&](double h) {
    return std::abs(Panels(store, h).ToLights("point") - kParallel);
  };
  const double coarse = error(0.25);
  EXPECT_NEAR(std::log2(error(0.5) / coarse), 2, 0.14);
  EXPECT_NEAR(std::log2(coarse / error(0.125)), 2, 0.14 / 4);
  for (const int n : {2, 4, 8}) {
    EXPECT_NEAR(
        Panels(store, 1.0 / n).ToLights("point"), SumOverMiddles(n), 1e-6);
  }
}

// A pixel is in or out by its center, so that a rim of the square is wrong by
// up to half a pixel, 1/64. The square is 32 pixels wide: the excess at one rim
// is lacking at the opposite rim. For each of the two pairs of rims the
// difference of their densities is left, below 1 / pi.
TEST_F(FormFactorKinds, HemicubeIsRightToItsPixels) {
  const std::string store = StoreOf({"parallel"});
  for (const double h : {0.25, 0.125}) {
    EXPECT_NEAR(Panels(store, h).ToLights("hemicube"),
                kParallel,
                2.0 / 64 / 3.14159265 + 0.11 * h * h)
        << h;
  }
}

// With 4,096 rays from each of n panels, four standard deviations are exceeded
// in one run of 16,000. Random points leave no error of dicing.
TEST_F(FormFactorKinds, MonteCarloIsRightToItsNoise) {
  const std::string store = StoreOf({"parallel"});
  for (const double h : {0.5, 0.25}) {
    const double rays = 4096 / (h * h);
    EXPECT_NEAR(Panels(store, h).ToLights("montecarlo"),
                kParallel,
                4 * std::sqrt(kParallel * (1 - kParallel) / rays))
        << h;
  }
}

// The center of a receiver that is one panel sees four quarters of the source:
// F = 4 / (2 pi) 2 s atan s = 0.2395 with s = x / sqrt(1 + x^2) at x = 1/2.
// Four points of the receiver give its mean within a percent.
TEST_F(FormFactorKinds, CollocationTakesTheIrradianceOfTheCenter) {
  Panels panels(StoreOf({"parallel"}), 1);
  const double s = 0.5 / std::sqrt(1.25);
  const double center = 4 / 3.14159265 * s * std::atan(s);
  EXPECT_NEAR(panels.ToLights("exact", "collocation"), center, 1e-5);
  EXPECT_NEAR(panels.ToLights("polygon", "collocation"), center, 1e-5);
  EXPECT_NEAR(panels.ToLights("exact"), kParallel, 0.01 * kParallel);
}

// All rays in a closed box meet its sides, except one in 4,096 that slips
// through where they touch. The pixels' shares sum to 1 within 1e-3.
TEST_F(FormFactorKinds, RowsOfAClosedBoxSumToOne) {
  Panels panels(StoreOf({"furnace", "--count", "0"}), 2);
  for (const std::string& kind : kTraced) {
    const auto rows = panels.Exchanges(kind, "galerkin");
    size_t inner = 0;
    for (size_t i = 0; i < rows.size(); ++i) {
      if (!panels.IsEnclosed(i)) {
        continue;  // an outer side
      }
      const double sum = std::accumulate(rows[i].begin(), rows[i].end(), 0.0);
      EXPECT_NEAR(sum / static_cast<double>(panels.All()[i].end.area), 1, 2e-3)
          << kind << " " << i;
      ++inner;
    }
    EXPECT_GE(inner, 6U) << kind;
  }
}

// The blocker, 0.4 m wide, hangs 1 cm above the receiver. Panels of 0.125 m
// beside the blocker's middle end 0.075 m from its rim: rays that pass below
// the rim go far beside the light, which hangs 2 m above.
TEST_F(FormFactorKinds, NothingIsSeenThroughAnOccluder) {
  Panels panels(StoreOf({"blocker", "--height", "0.01"}), 0.15);
  const auto is_below = [&](size_t i) {
    const Point3 at = panels.CenterOf(i);
    return std::abs(at.z) < 0.001 && std::abs(at.x) < 0.1 &&
           std::abs(at.y) < 0.1;
  };
  for (const std::string& kind : kTraced) {
    const auto rows = panels.Exchanges(kind, "galerkin");
    size_t looked_at = 0;
    for (size_t i = 0; i < rows.size(); ++i) {
      for (size_t j = 0; j < rows.size() && is_below(i); ++j) {
        looked_at += panels.Emits(j) ? 1U : 0U;
        EXPECT_TRUE(!panels.Emits(j) || rows[i][j] == 0) << kind;
      }
    }
    EXPECT_GT(looked_at, 0U) << kind;
  }
}

TEST_F(FormFactorKinds, AllMethodsTakeAllKinds) {
  StoreOf({"blocker"});
  for (const char* method : {"matrix", "progressive", "substructuring"}) {
    for (const std::string& kind : kKinds) {
      std::filesystem::remove(folder_ / "a.enf");
      const ProgramResult solved =
          Solve({"--method", method, "--form-factors", kind});
      EXPECT_EQ(solved.exit_code, 0) << method << " " << kind << solved.err;
    }
  }
}

TEST_F(FormFactorKinds, ConjugateGradientsAreRefusedWithoutSymmetry) {
  StoreOf({"parallel"});
  std::filesystem::remove(folder_ / "a.enf");
  const std::vector<std::vector<std::string>> unsymmetric = {
      {"--projection", "collocation"},
      {"--form-factors", "polygon"},
      {"--form-factors", "switch"},
      {"--form-factors", "hemicube"},
      {"--form-factors", "montecarlo"}};
  for (std::vector<std::string> words : unsymmetric) {
    words.insert(words.end(), {"--method", "matrix"});
    EXPECT_EQ(Solve(words).exit_code, 0) << words[1];
    std::filesystem::remove(folder_ / "a.enf");
    words.insert(words.end(), {"--linear-solver", "cg"});
    const ProgramResult refused = Solve(words);
    EXPECT_EQ(refused.exit_code, 2) << words[1];
    EXPECT_NE(refused.err.find("symmetric"), std::string::npos) << refused.err;
  }
  EXPECT_EQ(Solve({"--method",
                   "matrix",
                   "--form-factors",
                   "point",
                   "--linear-solver",
                   "cg"})
                .exit_code,
            0);
}

TEST_F(FormFactorKinds, WhatDoesNotGoTogetherIsRefused) {
  StoreOf({"parallel"});
  std::filesystem::remove(folder_ / "a.enf");
  const std::vector<std::vector<std::string>> refused = {
      {"--form-factors", "exact"},
      {"--form-factors", "point"},
      {"--projection", "collocation"},
      {"--method", "progressive", "--projection", "collocation"},
      {"--method", "matrix", "--form-factors", "other"}};
  for (const auto& words : refused) {
    EXPECT_EQ(Solve(words).exit_code, 2) << words[1];
  }
}

TEST_F(FormFactorKinds, AnotherKindIsAnotherSetting) {
  StoreOf({"parallel"});
  for (const std::vector<std::string>& other :
       {std::vector<std::string>{"--form-factors", "point"},
        {"--projection", "collocation"}}) {
    std::vector<std::string> words = other;
    words.insert(words.end(), {"--method", "matrix"});
    const ProgramResult again = Solve(words);
    EXPECT_EQ(again.exit_code, 2);
    EXPECT_NE(again.err.find("other settings"), std::string::npos) << again.err;
  }
}

TEST_F(FormFactorKinds, ExactIsTheDefault) {
  StoreOf({"blocker"});
  const json plain = json::parse(ReadFile(folder_ / "a.json"));
  std::filesystem::remove(folder_ / "a.enf");
  ASSERT_EQ(Solve({"--method",
                   "matrix",
                   "--form-factors",
                   "exact",
                   "--projection",
                   "galerkin",
                   "--linear-solver",
                   "cg"})
                .exit_code,
            0);
  const json said = json::parse(ReadFile(folder_ / "a.json"));
  EXPECT_EQ(plain.at("digest"), said.at("digest"));
}

}  // namespace
}  // namespace enfilade
