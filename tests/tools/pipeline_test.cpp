// The staged pipeline through the program: reports, stops, kills, resumes.

#include <chrono>
#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/run_program.h"
#include "tests/tools/store_blocks.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <signal.h>

namespace enfilade {
namespace {

using nlohmann::json;

constexpr uint64_t kMiB = 1 << 20;

// A solved room with boxes, in a folder of its own.
class SolvedRoom : public ::testing::Test {
 protected:
  ProgramResult Solve(const std::string& name,
                      const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = SolveWords(name);
    words.insert(words.end(), more.begin(), more.end());
    return RunProgram(words);
  }

  std::vector<std::string> SolveWords(const std::string& name) {
    return {"solve",
            folder_ / "room.obj",
            "-o",
            folder_ / (name + ".enf"),
            "--error",
            "0.2",
            "--report",
            folder_ / (name + ".json")};
  }

  std::vector<std::string> ResumeWords(const std::string& name) {
    return {"resume",
            folder_ / (name + ".enf"),
            "--report",
            folder_ / (name + ".json")};
  }

  [[nodiscard]] std::map<BlockKey, uint64_t> Blocks(
      const std::string& name) const {
    return BlocksOf(folder_ / (name + ".enf"));
  }

  [[nodiscard]] json Report(const std::string& name) const {
    return json::parse(ReadFile(folder_ / (name + ".json")));
  }

  void SetUp() override { WriteRoomScene(folder_ / "room.obj", 6); }

  TemporaryFolder folder_;
};

void ExpectEveryKey(const json& report) {
  for (const char* key : {"polygons",
                          "cells",
                          "portals",
                          "visible_pairs",
                          "patches",
                          "elements",
                          "links",
                          "links_per_second",
                          "rays",
                          "rays_per_second",
                          "sweeps",
                          "residual",
                          "requested_error",
                          "estimated_error",
                          "wall_seconds",
                          "peak_rss_bytes",
                          "memory_cap_bytes",
                          "store_bytes",
                          "link_bytes_per_link",
                          "bytes_read",
                          "bytes_written",
                          "bytes_read_solve",
                          "bytes_belady",
                          "bytes_compulsory",
                          "threads"}) {
    ASSERT_TRUE(report.contains(key)) << key;
    EXPECT_TRUE(report.at(key).is_number()) << key;
  }
  for (const char* key : {"import",
                          "partition",
                          "visibility",
                          "refine",
                          "gather",
                          "push_pull",
                          "store"}) {
    EXPECT_TRUE(report.at("stage_seconds").at(key).is_number()) << key;
  }
  for (const char* key : {"basis", "version", "digest"}) {
    ASSERT_TRUE(report.contains(key)) << key;
    EXPECT_TRUE(report.at(key).is_string()) << key;
  }
}

TEST_F(SolvedRoom, ReportHasEveryKeyWithItsTruth) {
  const auto result = Solve("a", {"--threads", "1", "--memory", "0.125G"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json report = Report("a");
  ExpectEveryKey(report);
  EXPECT_EQ(report["polygons"], 6 + 1 + 6 * 6);
  EXPECT_GE(report["cells"], 1);
  EXPECT_GE(report["patches"], report["polygons"]);
  EXPECT_GE(report["elements"], report["patches"]);
  EXPECT_EQ(report["requested_error"], 0.2);
  EXPECT_LE(report["estimated_error"], 0.2);
  EXPECT_EQ(report["memory_cap_bytes"], 128 * kMiB);
  EXPECT_LE(report["peak_rss_bytes"], result.peak_rss_bytes);
  EXPECT_GT(report["peak_rss_bytes"], 8 * kMiB);
  EXPECT_EQ(report["threads"], 1);
  EXPECT_EQ(report["basis"], "m2");
  EXPECT_EQ(report["store_bytes"],
            std::filesystem::file_size(folder_ / "a.enf"));
}

// The process that starts the program may be large, and a child begins with its
// parent's peak.
TEST_F(SolvedRoom, PeakIsThatOfTheProgramAlone) {
  std::vector<char> large(256 * kMiB, 1);
  ASSERT_EQ(Solve("a", {"--memory", "128M"}).exit_code, 0);
  EXPECT_LE(Report("a")["peak_rss_bytes"], 128 * kMiB);
  EXPECT_EQ(std::count(large.begin(), large.end(), 1), large.size());
}

TEST_F(SolvedRoom, PeakStaysUnderTheCap) {
  const auto result = Solve("a", {"--memory", "64M"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_LE(result.peak_rss_bytes, 64 * kMiB);
  EXPECT_LE(Report("a")["peak_rss_bytes"], 64 * kMiB);
}

TEST_F(SolvedRoom, InfoTellsWhatSolveTold) {
  ASSERT_EQ(Solve("a").exit_code, 0);
  const auto result = RunProgram(
      {"info", folder_ / "a.enf", "--report", folder_ / "info.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json solved = Report("a");
  const json info = Report("info");
  ExpectEveryKey(info);
  for (const char* key : {"digest", "links", "elements", "estimated_error"}) {
    EXPECT_EQ(info[key], solved[key]) << key;
  }
  EXPECT_TRUE(Contains(result.out, "solved")) << result.out;
}

TEST_F(SolvedRoom, SameBitsForAnyThreadsAndCap) {
  ASSERT_EQ(Solve("one", {"--threads", "1"}).exit_code, 0);
  ASSERT_EQ(Solve("two", {"--threads", "2"}).exit_code, 0);
  ASSERT_EQ(Solve("small", {"--memory", "64M"}).exit_code, 0);
  ASSERT_EQ(Solve("none", {"--memory", "none"}).exit_code, 0);
  const json digest = Report("one")["digest"];
  const auto blocks = Blocks("one");
  EXPECT_GT(blocks.size(), 5U);
  for (const char* other : {"two", "small", "none"}) {
    EXPECT_EQ(Report(other)["digest"], digest) << other;
    EXPECT_EQ(Blocks(other), blocks) << other;
  }
}

TEST_F(SolvedRoom, ExistingSolutionIsRefusedWithAdvice) {
  ASSERT_EQ(Solve("a").exit_code, 0);
  const std::string before = ReadFile(folder_ / "a.enf");
  const auto result = Solve("a");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(Contains(result.err, "enfilade resume")) << result.err;
  EXPECT_EQ(ReadFile(folder_ / "a.enf"), before);
}

TEST_F(SolvedRoom, ResumeOfASolvedStoreChangesNothing) {
  ASSERT_EQ(Solve("a").exit_code, 0);
  const auto result = RunProgram(
      {"resume", folder_ / "a.enf", "--report", folder_ / "again.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Report("again")["digest"], Report("a")["digest"]);
}

TEST_F(SolvedRoom, ResumeWithASmallerErrorRefines) {
  ASSERT_EQ(Solve("a").exit_code, 0);
  const auto result = RunProgram({"resume",
                                  folder_ / "a.enf",
                                  "--error",
                                  "0.1",
                                  "--report",
                                  folder_ / "finer.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Report("finer")["requested_error"], 0.1);
  EXPECT_LE(Report("finer")["estimated_error"], 0.1);
  EXPECT_GE(Report("finer")["links"], Report("a")["links"]);
}

TEST_F(SolvedRoom, ChangedSceneIsNoticedAtResume) {
  ASSERT_EQ(Solve("a").exit_code, 0);
  WriteRoomScene(folder_ / "room.obj", 5);
  const auto result = RunProgram({"resume", folder_ / "a.enf"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_TRUE(Contains(result.err, "room.obj")) << result.err;
  EXPECT_TRUE(Contains(result.err, "changed")) << result.err;
}

// A scene that came without its material file, and was solved so.
TEST_F(SolvedRoom, ChangesAreNoticedInASceneThatLackedAFile) {
  std::filesystem::remove(folder_ / "room.mtl");
  std::ofstream(folder_ / "o.json")
      << R"({"materials": {"*": {"reflectance": 0.5}}})";
  ASSERT_EQ(
      Solve("a", {"--overrides", folder_ / "o.json", "--default-luminaires"})
          .exit_code,
      0);
  EXPECT_EQ(RunProgram({"resume", folder_ / "a.enf"}).exit_code, 0);
  std::ofstream(folder_ / "o.json")
      << R"({"materials": {"*": {"reflectance": 0.6}}})";
  const auto result = RunProgram({"resume", folder_ / "a.enf"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_TRUE(Contains(result.err, "changed")) << result.err;
  std::filesystem::remove(folder_ / "o.json");
  EXPECT_EQ(RunProgram({"resume", folder_ / "a.enf"}).exit_code, 0);
}

TEST_F(SolvedRoom, MissingSceneIsNoHindranceToResume) {
  ASSERT_EQ(Solve("a").exit_code, 0);
  for (const char* file : {"room.mtl", "room.obj"}) {
    std::filesystem::remove(folder_ / file);
    const auto result = RunProgram({"resume", folder_ / "a.enf"});
    EXPECT_EQ(result.exit_code, 0) << file << result.err;
  }
}

TEST_F(SolvedRoom, ReportThatCannotBeWrittenIsADiskError) {
  const auto result = RunProgram({"solve",
                                  folder_ / "room.obj",
                                  "-o",
                                  folder_ / "a.enf",
                                  "--error",
                                  "0.5",
                                  "--report",
                                  folder_ / "no/such/a.json"});
  EXPECT_EQ(result.exit_code, 6) << result.err;
}

// Stops the solve with `signal` after growing delays, resuming each time, until
// a run ends by itself; returns that run and counts the stops.
ProgramResult StopAndResume(const std::vector<std::string>& solve,
                            const std::vector<std::string>& resume,
                            int signal,
                            int& stops) {
  std::chrono::milliseconds delay(20);
  while (true) {
    const bool begun = std::filesystem::exists(resume[1]);
    RunningProgram program(begun ? resume : solve);
    std::this_thread::sleep_for(delay);
    program.Signal(signal);
    ProgramResult result = program.Wait();
    if (result.exit_code != 130 && result.exit_code != 128 + signal) {
      return result;
    }
    ++stops;
    delay = delay * 3 / 2;
  }
}

TEST_F(SolvedRoom, KilledSolveResumesToTheSameBits) {
  ASSERT_EQ(Solve("whole").exit_code, 0);
  int kills = 0;
  const auto result =
      StopAndResume(SolveWords("a"), ResumeWords("a"), SIGKILL, kills);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GT(kills, 0);
  EXPECT_EQ(Report("a")["digest"], Report("whole")["digest"]);
  EXPECT_EQ(Blocks("a"), Blocks("whole"));
}

TEST_F(SolvedRoom, InterruptedSolveExits130AndResumesToTheSameBits) {
  ASSERT_EQ(Solve("whole").exit_code, 0);
  int stops = 0;
  const auto result =
      StopAndResume(SolveWords("a"), ResumeWords("a"), SIGINT, stops);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GT(stops, 0);
  EXPECT_EQ(Report("a")["digest"], Report("whole")["digest"]);
  EXPECT_EQ(Blocks("a"), Blocks("whole"));
}

// A sender may signal a process and also its group: the signals are one
// request, and no reason to lose what was done since the last commit.
TEST_F(SolvedRoom, SignalsThatComeTogetherAreOneRequest) {
  RunningProgram program({"solve",
                          folder_ / "room.obj",
                          "-o",
                          folder_ / "a.enf",
                          "--error",
                          "0.001"});
  const auto limit = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!std::filesystem::exists(folder_ / "a.enf") &&
         std::chrono::steady_clock::now() < limit) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  program.Signal(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(5));  // handled
  program.Signal(SIGTERM);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 130) << result.err;
  EXPECT_TRUE(Contains(result.err, "enfilade resume")) << result.err;
}

}  // namespace
}  // namespace enfilade
