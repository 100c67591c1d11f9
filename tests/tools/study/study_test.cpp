// The verb `study`: its lines, its tables, and that a killed one goes on.

#include "tools/study/study.h"

#include "base/error.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/store/file_size_limit.h"
#include "tests/tools/run_program.h"
#include "tools/study/fit.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Point = std::pair<double, double>;

TEST(FitPower, FindsThePowerOfAPower) {
  std::vector<Point> points;
  for (const double x : {1.0, 2.0, 5.0, 9.0}) {
    points.emplace_back(x, 3 * x * std::sqrt(x));
  }
  EXPECT_NEAR(FitPower(points).value(), 1.5, 1e-12);
}

TEST(FitPower, NeedsTwoPlacesAndPositiveValues) {
  EXPECT_FALSE(FitPower(std::array<Point, 1>{{{1, 1}}}));
  EXPECT_FALSE(FitPower(std::array<Point, 2>{{{2, 1}, {2, 3}}}));
  EXPECT_FALSE(FitPower(std::array<Point, 2>{{{0, 1}, {2, 3}}}));
}

// Runs whose error is 1 / sqrt(cost).
TEST(ErrorWithin, LiesBetweenRunsOnTheirPower) {
  const std::vector<Point> runs = {{16, 0.25}, {1, 1}, {4, 0.5}};
  EXPECT_NEAR(ErrorWithin(4, runs).value(), 0.5, 1e-12);
  EXPECT_NEAR(ErrorWithin(9, runs).value(), 1.0 / 3, 1e-12);
}

TEST(ErrorWithin, EndsWithTheRuns) {
  const std::vector<Point> runs = {{1, 1}, {4, 0.5}};
  EXPECT_FALSE(ErrorWithin(0.9, runs)) << "all cost more";
  EXPECT_EQ(ErrorWithin(100, runs).value(), 0.5) << "more is not known";
  EXPECT_FALSE(ErrorWithin(1, {}));
}

TEST(ErrorWithin, AWorseRunThatCostsMoreIsNotTaken) {
  const std::vector<Point> runs = {{1, 0.5}, {2, 0.7}, {4, 0.25}};
  EXPECT_NEAR(ErrorWithin(2, runs).value(), std::sqrt(0.125), 1e-12);
  EXPECT_EQ(ErrorWithin(2, {{1, 0.5}, {2, 0.7}}).value(), 0.5);
}

TEST(ErrorWithin, RunsWithoutAnErrorDoNotCount) {
  EXPECT_FALSE(ErrorWithin(9, {{1, NAN}, {2, 0}}));
  EXPECT_EQ(ErrorWithin(9, {{1, NAN}, {2, 0.5}}).value(), 0.5);
}

TEST(StudyLines, OnlyASolveThatEndedIsFinished) {
  const auto line = [](int exit_code, bool out_of_time) {
    return Json{
        {"exit_code", exit_code}, {"out_of_time", out_of_time}, {"links", 12}};
  };
  EXPECT_TRUE(IsFinished(line(0, false)));
  EXPECT_TRUE(IsFinished(line(1, false)));  // the error was not reached
  EXPECT_FALSE(IsFinished(line(0, true)));
  EXPECT_FALSE(IsFinished(line(4, false)));  // a partial solve has links, too
  EXPECT_FALSE(IsFinished(line(137, false)));
}

TEST(StudyPlan, CountsBytesAsThePaperDid) {
  EXPECT_EQ(PaperBytes("haar", 0, 0, 1), 40);
  EXPECT_EQ(PaperBytes("m2", 0, 0, 1), 400);
  EXPECT_EQ(PaperBytes("m3", 0, 0, 1), 1960);
  EXPECT_EQ(PaperBytes("triage-haar", 0, 0, 1), 40);
  EXPECT_EQ(PaperBytes("switch-f3", 0, 0, 1), 1960);
  EXPECT_EQ(PaperBytes("matrix", 0, 2, 3), 2 * 24 + 3 * 28);
  EXPECT_EQ(PaperBytes("substructuring", 2, 3, 9), 2 * 24 + 3 * 52);
}

TEST(StudyPlan, HasTheSevenExperimentsAndFiveOfOneChoice) {
  EXPECT_EQ(Experiments().size(), 7U + 5U);
  EXPECT_EQ(FindExperiment("complex").name, "chairs");
  EXPECT_THROW((void)FindExperiment("circle"), UsageError);
}

ProgramResult RunSmallStudy(const TemporaryFolder& folder) {
  return RunProgram({"study",
                     "parallel",
                     "--values",
                     "1",
                     "--methods",
                     "progressive",
                     "--verify",
                     "2",
                     "--out",
                     folder / "study"});
}

TEST(Study, WritesALinePerRunAndATable) {
  const TemporaryFolder folder;
  const ProgramResult run = RunSmallStudy(folder);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto lines = LoadStudy(folder / "study/parallel.jsonl");
  ASSERT_EQ(lines.size(), 2U);  // two numbers of elements
  for (const Json& line : lines) {
    for (const char* key : {"wall_seconds",
                            "elements",
                            "links",
                            "rays",
                            "paper_bytes",
                            "peak_rss_bytes",
                            "residual",
                            "estimated_error",
                            "reference",
                            "rms_error",
                            "mean_deviation",
                            "verified_error",
                            "verified_low",
                            "verified_high",
                            "verified_deviation"}) {
      EXPECT_TRUE(line.contains(key)) << key;
    }
    // The two errors share no code. The precision of the verified error depends
    // on how much time the machine had for it.
    const auto rms = line.at("rms_error").get<double>();
    EXPECT_GT(rms, 0.75 * line.at("verified_low").get<double>());
    EXPECT_LT(rms, 1.25 * line.at("verified_high").get<double>());
    EXPECT_GT(rms, 0);
    EXPECT_LT(rms, 0.2);
  }
  // The finer run of a method is the better one.
  EXPECT_LT(lines[1].at("rms_error"), lines[0].at("rms_error"));
  const std::string tables = ReadFile(folder / "study/parallel.md");
  EXPECT_NE(tables.find("error by elements"), std::string::npos);
  EXPECT_NE(tables.find("error within"), std::string::npos);
  EXPECT_TRUE(
      std::filesystem::exists(folder / "study/parallel_progressive_equal.dat"));
}

TEST(Study, GoesOnWhereItWasKilled) {
  const TemporaryFolder folder;
  ASSERT_EQ(RunSmallStudy(folder).exit_code, 0);
  const std::string file = folder / "study/parallel.jsonl";
  const std::string whole = ReadFile(file);
  const size_t kept = whole.find('\n') + 1;
  WriteFile(file, whole.substr(0, kept + 20));
  const ProgramResult again = RunSmallStudy(folder);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const std::string after = ReadFile(file);
  // The one whole line stays, byte for byte, and the other run is made.
  EXPECT_EQ(after.substr(0, kept), whole.substr(0, kept));
  EXPECT_EQ(LoadStudy(file).size(), 2U);
  EXPECT_EQ(again.out.find("parallel 1 progressive 500\n"), std::string::npos);
  EXPECT_NE(again.out.find("parallel 1 progressive 2000\n"), std::string::npos);
}

TEST(Study, LosesNoLineThatItDoesNotKnow) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "study");
  const std::string file = folder / "study/parallel.jsonl";
  const std::string foreign = "{\"key\":\"of another version\"}\n";
  WriteFile(file, foreign + "{\"key\":\"torn");
  ASSERT_EQ(RunSmallStudy(folder).exit_code, 0);
  EXPECT_EQ(ReadFile(file).substr(0, foreign.size()), foreign);
  EXPECT_EQ(ReadFile(file).find("torn"), std::string::npos);
  EXPECT_EQ(LoadStudy(file).size(), 2U);
}

ProgramResult RunOnFullDisk(const std::string& experiment,
                            const std::string& value,
                            rlim_t most_bytes,
                            const TemporaryFolder& folder) {
  const FileSizeLimit limit(most_bytes);
  return RunProgram({"study",
                     experiment,
                     "--values",
                     value,
                     "--verify",
                     "0",
                     "--out",
                     folder / "study"});
}

TEST(Study, AFullDiskUnderTheSceneIsNamedOnce) {
  const TemporaryFolder folder;
  const ProgramResult run = RunOnFullDisk("chairs", "4", 1000, folder);
  EXPECT_EQ(run.exit_code, 6);
  constexpr std::string_view kPrefix = "enfilade: error: ";
  EXPECT_EQ(run.err.find(kPrefix), 0U) << run.err;
  EXPECT_EQ(run.err.rfind(kPrefix), 0U) << run.err;
  EXPECT_TRUE(Contains(run.err, "scene.obj")) << run.err;
  EXPECT_TRUE(Contains(run.err, "File too large")) << run.err;
}

TEST(Study, AFullDiskUnderAStoreIsNoResult) {
  const TemporaryFolder folder;
  const ProgramResult run = RunOnFullDisk("parallel", "1", 8000, folder);
  EXPECT_EQ(run.exit_code, 6) << run.err;
  EXPECT_TRUE(LoadStudy(folder / "study/parallel.jsonl").empty());
}

TEST(Study, ComparesOneChoiceOfTheHierarchicalMethod) {
  const TemporaryFolder folder;
  const ProgramResult run = RunProgram({"study",
                                        "singular",
                                        "--methods",
                                        "cc-m3",
                                        "--verify",
                                        "0",
                                        "--out",
                                        folder / "study"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto lines = LoadStudy(folder / "study/singular.jsonl");
  ASSERT_EQ(lines.size(), 3U);  // three epsilons
  for (const Json& line : lines) {
    EXPECT_EQ(line.at("exit_code"), 0);
    EXPECT_FALSE(line.contains("verified_error"));
    EXPECT_LT(line.at("rms_error").get<double>(), 0.05);
  }
  EXPECT_LT(lines[2].at("rms_error"), lines[0].at("rms_error"));
}

TEST(Study, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(RunProgram({"study", "circle"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"study"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"study", "box", "--methods", "ray-haar"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"study", "--list"}).exit_code, 0);
}

}  // namespace
}  // namespace enfilade
