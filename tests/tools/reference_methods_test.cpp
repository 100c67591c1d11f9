// The reference methods through the program: closed forms, agreement with each
// other and with the wavelet solver, balance of power, refusals, resumes.

#include "base/planar_polygon.h"
#include "solver/solution/solution.h"
#include "solver/state/solve_state.h"
#include "store/sqlite_store.h"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include "tools/pipeline_state.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

const std::vector<std::string> kReferences = {
    "matrix", "progressive", "substructuring"};

// A constant element of a solution, red.
struct Leaf {
  double area = 0;  // m2
  double irradiance = 0;
  double radiosity = 0;
  double reflectance = 0;
  double exitance = 0;
  double height = 0;  // z of a corner, m
  Vec3 normal;
};

class ReferenceMethods : public ::testing::Test {
 protected:
  void WriteScene(std::vector<std::string> words) {
    words.insert(words.begin(), "scene");
    words.push_back(folder_ / "a.obj");
    const ProgramResult written = RunProgram(words);
    ASSERT_EQ(written.exit_code, 0) << written.err;
  }

  ProgramResult Solve(const std::string& name,
                      const std::vector<std::string>& more) {
    return SolveScene(folder_.Path(), name, more);
  }

  // Solves by a method of that name.
  void SolveBy(const std::string& method, const std::string& error) {
    const ProgramResult solved =
        Solve(method, {"--method", method, "--error", error});
    ASSERT_EQ(solved.exit_code, 0) << method << solved.err;
  }

  [[nodiscard]] json Report(const std::string& name) const {
    return json::parse(ReadFile(folder_ / (name + ".json")));
  }

  void ForEachLeaf(const std::string& name,
                   const std::function<void(const Leaf&)>& visit) const {
    const auto store = OpenStore(folder_ / (name + ".enf"), StoreAccess::kRead);
    MemoryBudget budget(1ULL << 30);
    const Solution solution(*store, budget);
    for (size_t i = 0; i < solution.CellCount(); ++i) {
      const CellPatches cell = LoadCellPatches(*store, CellId(i));
      solution.ForEachLeaf(CellId(i), [&](const LeafElement& element) {
        const Patch& patch = cell.patches[element.patch.Index()];
        const Material& m = solution.Scene().materials[patch.material.Index()];
        const Vec3 area = AreaVector(element.corners);
        Leaf leaf;
        leaf.area = Length(area);
        leaf.irradiance = element.irradiance[0][0];
        leaf.radiosity = element.radiosity[0][0];
        leaf.reflectance = patch.reflects ? m.reflectance[0] : 0;
        leaf.exitance = patch.emits ? m.exitance[0] : 0;
        leaf.height = element.corners[0].z;
        leaf.normal = Normalize(area);
        visit(leaf);
      });
    }
  }

  // Mean radiosity of the upper side of the unit square at z = 0.
  [[nodiscard]] double ReceiverMean(const std::string& name) const {
    double flux = 0;
    double area = 0;
    ForEachLeaf(name, [&](const Leaf& leaf) {
      if (std::abs(leaf.height) < 1e-6 && leaf.normal.z > 0.5) {
        flux += leaf.area * leaf.radiosity;
        area += leaf.area;
      }
    });
    EXPECT_NEAR(area, 1, 1e-6);
    return flux / area;
  }

  TemporaryFolder folder_;
};

// The mean of constant elements has no error of discretisation: what is left
// is quadrature, half a percent between panels that share an edge (two Gauss
// points on 1/2 (1 - d / sqrt(1 + d^2)) are wrong by 0.2 % across it and by as
// much along it), far less otherwise.
TEST_F(ReferenceMethods, ParallelSquaresMatchTheClosedForm) {
  WriteScene({"parallel"});
  for (const std::string& method : kReferences) {
    SolveBy(method, "0.1");
    EXPECT_NEAR(ReceiverMean(method) / 0.0999125, 1, 0.001) << method;
  }
}

TEST_F(ReferenceMethods, PerpendicularSquaresMatchTheClosedForm) {
  WriteScene({"perpendicular"});
  for (const std::string& method : kReferences) {
    SolveBy(method, "0.15");
    EXPECT_NEAR(ReceiverMean(method) / 0.100022, 1, 0.005) << method;
  }
}

// E = 1, rho = 1/2: B = 2. The matrix has rows that sum to 1, so that only its
// residual is left. Shooting stops with 0.05 times the error still to come and
// sends all that it has, so that the mean is too dark by no more than that.
TEST_F(ReferenceMethods, FurnaceComesOutFlat) {
  WriteScene({"furnace", "--count", "0"});
  for (const std::string& method : kReferences) {
    SolveBy(method, "0.1");
    double off = 0;
    double area = 0;
    double largest = 0;
    ForEachLeaf(method, [&](const Leaf& leaf) {
      if (leaf.exitance > 0) {
        off += leaf.area * (leaf.radiosity / 2 - 1);
        area += leaf.area;
        largest = std::max(largest, std::abs(leaf.radiosity / 2 - 1));
      }
    });
    ASSERT_GT(area, 0) << method;
    if (method == "matrix") {
      EXPECT_LE(largest, 1e-4);
    } else {
      EXPECT_LE(std::abs(off / area), 0.05 * 0.1) << method;
      EXPECT_LE(largest, 0.05) << method;
    }
  }
}

// In a closed room all that is emitted is absorbed.
TEST_F(ReferenceMethods, AbsorbedPowerIsEmittedPower) {
  WriteRoomScene(folder_ / "a.obj", 2);
  for (const std::string& method : kReferences) {
    const ProgramResult solved =
        Solve(method, {"--method", method, "--elements", "600"});
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
    double emitted = 0;
    double absorbed = 0;
    ForEachLeaf(method, [&](const Leaf& leaf) {
      emitted += leaf.area * leaf.exitance;
      absorbed += leaf.area * (1 - leaf.reflectance) * leaf.irradiance;
    });
    EXPECT_GT(emitted, 0);
    // The tolerance is for the unshot light at --error 0.05; for the matrix,
    // panels that count as enclosed may have gaps that 256 rays do not find.
    EXPECT_NEAR(absorbed / emitted, 1, 0.005) << method;
  }
}

// |A - B| <= |A - true| + |B - true|, by the methods' own estimates.
TEST_F(ReferenceMethods, AllAgreeWithinTheirErrors) {
  struct Scene {
    std::vector<std::string> words;
    std::string error;
  };

  const std::vector<std::string> methods = {
      "wavelet", "matrix", "progressive", "substructuring"};
  for (const Scene& scene : {Scene{{"blocker"}, "0.2"}, {{"box"}, "0.25"}}) {
    SCOPED_TRACE(scene.words[0]);
    WriteScene(scene.words);
    for (const std::string& method : methods) {
      SolveBy(method, scene.error);
    }
    for (size_t i = 0; i < methods.size(); ++i) {
      for (size_t j = 0; j < i; ++j) {
        const ProgramResult compared =
            RunProgram({"compare",
                        folder_ / (methods[i] + ".enf"),
                        folder_ / (methods[j] + ".enf"),
                        "--report",
                        folder_ / "compare.json"});
        ASSERT_EQ(compared.exit_code, 0) << compared.err;
        const double bound =
            Report(methods[i]).at("estimated_error").get<double>() +
            Report(methods[j]).at("estimated_error").get<double>();
        EXPECT_LE(Report("compare").at("rms_error").get<double>(), bound)
            << methods[i] << " and " << methods[j];
      }
    }
    for (const std::string& method : methods) {
      std::filesystem::remove(folder_ / (method + ".enf"));
    }
  }
}

// The same bound holds for long walls of high reflectance.
TEST_F(ReferenceMethods, ReferencesAgreeInTheTube) {
  WriteScene({"tube", "--reflectance", "0.9"});
  for (const std::string& method : kReferences) {
    const ProgramResult solved =
        Solve(method, {"--method", method, "--elements", "600"});
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
  }
  for (const std::string method : {"progressive", "substructuring"}) {
    const ProgramResult compared = RunProgram({"compare",
                                               folder_ / (method + ".enf"),
                                               folder_ / "matrix.enf",
                                               "--report",
                                               folder_ / "compare.json"});
    ASSERT_EQ(compared.exit_code, 0) << compared.err;
    const double bound = Report(method).at("estimated_error").get<double>() +
                         Report("matrix").at("estimated_error").get<double>();
    EXPECT_LT(bound, 1);
    EXPECT_LE(Report("compare").at("rms_error").get<double>(), bound) << method;
  }
}

// The residual bounds the error, as the system's eigenvalues are at least 1 -
// rho.
TEST_F(ReferenceMethods, LinearSolversAgreeToTheirResiduals) {
  WriteScene({"box", "--reflectance", "0.9"});
  for (const char* solver : {"gs", "sor", "cg"}) {
    const ProgramResult solved = Solve(
        solver,
        {"--method", "matrix", "--elements", "200", "--linear-solver", solver});
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
    EXPECT_LE(Report(solver).at("residual").get<double>(), 2e-6);
  }
  for (const char* solver : {"gs", "sor"}) {
    const ProgramResult compared =
        RunProgram({"compare",
                    folder_ / (std::string(solver) + ".enf"),
                    folder_ / "cg.enf",
                    "--report",
                    folder_ / "compare.json"});
    ASSERT_EQ(compared.exit_code, 0) << compared.err;
    EXPECT_LE(Report("compare").at("rms_error").get<double>(),
              2 * 2e-6 / (1 - 0.9));
  }
}

TEST_F(ReferenceMethods, AmbientTermAddsTheLightStillToCome) {
  WriteScene({"box"});
  const std::vector<std::string> words = {
      "--method", "progressive", "--elements", "200", "--error", "0.5"};
  std::vector<std::string> ambient = words;
  ambient.emplace_back("--ambient");
  ASSERT_EQ(Solve("plain", words).exit_code, 0);
  ASSERT_EQ(Solve("ambient", ambient).exit_code, 0);
  std::vector<double> plain;
  ForEachLeaf("plain",
              [&](const Leaf& leaf) { plain.push_back(leaf.irradiance); });
  std::vector<double> added;
  ForEachLeaf("ambient", [&](const Leaf& leaf) {
    added.push_back(leaf.irradiance - plain[added.size()]);
  });
  ASSERT_EQ(added.size(), plain.size());
  EXPECT_GT(added[0], 0);
  for (const double more : added) {
    EXPECT_NEAR(more / added[0], 1, 1e-3);
  }
}

TEST_F(ReferenceMethods, ResumedSolveEndsWhereAnUndisturbedOneEnds) {
  WriteScene({"blocker"});
  ASSERT_EQ(Solve("a", {"--method", "matrix", "--error", "0.3"}).exit_code, 0);
  ASSERT_EQ(RunProgram({"resume",
                        folder_ / "a.enf",
                        "--error",
                        "0.08",
                        "--report",
                        folder_ / "a.json"})
                .exit_code,
            0);
  ASSERT_EQ(Solve("b", {"--method", "matrix", "--error", "0.08"}).exit_code, 0);
  EXPECT_EQ(Report("a").at("digest"), Report("b").at("digest"));
  EXPECT_EQ(Report("a").at("estimated_error"),
            Report("b").at("estimated_error"));
  EXPECT_EQ(Report("a").at("method"), "matrix");
}

// The state is made what a solve leaves that had panels for no finer edge and
// whose last round was not accurate enough, or ended before it was complete.
TEST_F(ReferenceMethods, AResumeConvergesNoSolveThatEndedForWantOfPanels) {
  // Finenesses, of which the last has more panels than there may be: two
  // squares of 4^7.
  constexpr size_t kMorePanels = 8;
  WriteScene({"parallel"});
  SolveBy("matrix", "0.3");
  for (const bool is_complete : {true, false}) {
    {
      const auto store = OpenStore(folder_ / "matrix.enf", StoreAccess::kWrite);
      SolveState state;
      ASSERT_TRUE(LoadSolveState(*store, &state));
      EXPECT_TRUE(state.converged || !is_complete);
      state.converged = false;
      RoundRecord last = state.rounds.back();
      last.complete = is_complete;
      last.estimated_error = is_complete ? 0.02 : 0.001;
      state.rounds.resize(kMorePanels, last);
      state.rounds.back() = last;
      SaveSolveState(state, *store);
      store->Commit();
    }
    for (const char* error : {"0.01", "0.005"}) {
      const ProgramResult resumed = RunProgram({"resume",
                                                folder_ / "matrix.enf",
                                                "--error",
                                                error,
                                                "--report",
                                                folder_ / "matrix.json"});
      EXPECT_EQ(resumed.exit_code, 1) << resumed.err;
      EXPECT_FALSE(Report("matrix").at("converged").get<bool>());
      EXPECT_TRUE(Report("matrix").at("exhausted").get<bool>());
    }
  }
}

// As a resume to that error leaves it that was killed before its first commit.
TEST_F(ReferenceMethods, ASolutionOfAnotherErrorIsNotCalledSolved) {
  WriteScene({"parallel"});
  SolveBy("matrix", "0.3");
  {
    const auto store = OpenStore(folder_ / "matrix.enf", StoreAccess::kWrite);
    SolveSettings settings = LoadSettings(*store);
    settings.error = 0.1;
    SaveSettings(*store, settings);
    store->Commit();
  }
  const std::vector<std::string> more = {
      folder_ / "matrix.enf", "--report", folder_ / "matrix.json"};
  const ProgramResult info = RunProgram({"info", more[0], more[1], more[2]});
  EXPECT_TRUE(Contains(info.out, "state     unfinished")) << info.out;
  EXPECT_FALSE(Report("matrix").at("converged").get<bool>());
  EXPECT_EQ(RunProgram({"resume", more[0], more[1], more[2]}).exit_code, 0);
  EXPECT_TRUE(Report("matrix").at("converged").get<bool>());
  EXPECT_LE(Report("matrix").at("estimated_error"), 0.1);
}

TEST_F(ReferenceMethods, ANumberOfElementsIsNoRequestForAnError) {
  WriteScene({"parallel"});
  const ProgramResult solved =
      Solve("a", {"--method", "matrix", "--elements", "20"});
  ASSERT_EQ(solved.exit_code, 0) << solved.err;
  EXPECT_FALSE(Contains(solved.out, "requested")) << solved.out;
  EXPECT_TRUE(Report("a").at("requested_error").is_null());
  EXPECT_TRUE(Report("a").at("estimated_error").is_number());
  EXPECT_EQ(Report("a").at("converged"), true);
  const ProgramResult verified = RunProgram({"verify",
                                             folder_ / "a.enf",
                                             "--seconds",
                                             "0.5",
                                             "--report",
                                             folder_ / "v.json"});
  ASSERT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_FALSE(Contains(verified.out, "requested")) << verified.out;
  EXPECT_TRUE(Report("v").at("requested_error").is_null());
  EXPECT_TRUE(Report("v").at("meets_request").is_null());
  const ProgramResult refused =
      RunProgram({"resume", folder_ / "a.enf", "--error", "0.01"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(Contains(refused.err, "--elements")) << refused.err;
}

TEST_F(ReferenceMethods, ThreadsDoNotChangeTheBits) {
  WriteScene({"blocker"});
  for (const std::string& method : kReferences) {
    ASSERT_EQ(Solve(method + "1",
                    {"--method", method, "--elements", "400", "--threads", "1"})
                  .exit_code,
              0);
    ASSERT_EQ(Solve(method + "4",
                    {"--method", method, "--elements", "400", "--threads", "4"})
                  .exit_code,
              0);
    EXPECT_EQ(Report(method + "1").at("digest"),
              Report(method + "4").at("digest"))
        << method;
  }
}

TEST_F(ReferenceMethods, AnotherMethodIsAnotherSetting) {
  WriteScene({"blocker"});
  ASSERT_EQ(Solve("a", {"--method", "matrix", "--elements", "100"}).exit_code,
            0);
  const ProgramResult again =
      Solve("a", {"--method", "progressive", "--elements", "100"});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("other settings"), std::string::npos) << again.err;
}

TEST_F(ReferenceMethods, WhatDoesNotFitIsRefusedByName) {
  WriteScene({"box"});
  const ProgramResult basis =
      Solve("a", {"--method", "matrix", "--basis", "m2"});
  EXPECT_EQ(basis.exit_code, 2);
  const ProgramResult elements = Solve("a", {"--elements", "100"});
  EXPECT_EQ(elements.exit_code, 2);
  const ProgramResult memory = Solve(
      "a", {"--method", "matrix", "--elements", "19000", "--memory", "64M"});
  EXPECT_EQ(memory.exit_code, 4);
  EXPECT_NE(memory.err.find("--memory"), std::string::npos) << memory.err;
}

}  // namespace
}  // namespace enfilade
