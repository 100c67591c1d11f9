// A stop is heeded by the verbs that may take long, and within the stages
// before the solve.

#include "store/sqlite_store.h"

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/run_program.h"
#include "tools/pipeline_state.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Writes a room with one star of `corners` corners, of which some are up to
// `rise_m` above the others.
void WriteStar(const std::filesystem::path& path, int corners, double rise_m) {
  WriteRoomScene(path, 0);
  std::string text = ReadFile(path);
  std::string face = "f";
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::acos(-1.0) * i / corners;
    const double radius = i % 2 == 0 ? 1 : 1.3;
    text += fmt::format("v {} {} {}\n",
                        2 + radius * std::cos(angle),
                        2 + radius * std::sin(angle),
                        1 + rise_m * std::sin(7.0 * i));
    face += fmt::format(" {}", -i - 1);
  }
  WriteFile(path, text + face + "\n");
}

// Asks the program to stop after `delay`: it must end soon.
void ExpectStopAfter(milliseconds delay, RunningProgram& program) {
  constexpr auto kSoon = milliseconds(3000);  // of a machine that is busy
  std::this_thread::sleep_for(delay);
  const auto asked = steady_clock::now();
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_LT(steady_clock::now() - asked, kSoon);
  EXPECT_EQ(result.exit_code, 130) << result.out << result.err;
}

// Returns when the store of a solve has this stage, or else after a minute.
void AwaitStage(Stage stage, const std::filesystem::path& store) {
  const auto limit = steady_clock::now() + std::chrono::minutes(1);
  const auto has_stage = [&] {
    return std::filesystem::exists(store) &&
           LoadStage(*OpenStore(store, StoreAccess::kRead)) >= stage;
  };
  while (!has_stage() && steady_clock::now() < limit) {
    std::this_thread::sleep_for(milliseconds(20));
  }
}

// Stops a solve in the midst of the stage after `done`. The store must be one
// to go on with.
void ExpectSolveStopsAfter(Stage done, const TemporaryFolder& folder) {
  const std::string store = folder / "a.enf";
  RunningProgram program({"solve", folder / "star.obj", "-o", store});
  AwaitStage(done, store);
  ExpectStopAfter(milliseconds(1000), program);
  EXPECT_EQ(LoadStage(*OpenStore(store, StoreAccess::kRead)), done);
  const ProgramResult info = RunProgram({"info", store});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_TRUE(Contains(info.out, "enfilade resume")) << info.out;
}

TEST(Stop, IsHeededWhileAFaceIsCut) {
  const TemporaryFolder folder;
  WriteStar(folder / "star.obj", 35'000, 0.2);
  ExpectSolveStopsAfter(Stage::kCreated, folder);
}

TEST(Stop, IsHeededWhileCellsAreFound) {
  const TemporaryFolder folder;
  WriteStar(folder / "star.obj", 20'000, 0);
  ExpectSolveStopsAfter(Stage::kImported, folder);
}

// The words of a job that takes minutes; "IN" stands for a solved store, "OUT"
// for a file to be written, and "POINTS" for one of many points.
class StopOfVerb : public ::testing::TestWithParam<const char*> {};

TEST_P(StopOfVerb, IsHeeded) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "room.obj", 1);
  const ProgramResult solved = RunProgram(
      {"solve", folder / "room.obj", "-o", folder / "a.enf", "--error", "0.3"});
  ASSERT_EQ(solved.exit_code, 0) << solved.err;
  std::string points;
  for (int i = 0; i < 100'000; ++i) {
    points += "1,1,1,0,0,1\n";
  }
  WriteFile(folder / "points.csv", points);
  std::vector<std::string> words;
  std::istringstream given(GetParam());
  for (std::string word; given >> word;) {
    const bool is_output = word.starts_with("OUT");
    words.push_back(word == "IN"       ? folder / "a.enf"
                    : word == "POINTS" ? folder / "points.csv"
                    : is_output        ? folder / word
                                       : word);
  }
  RunningProgram program(words);
  ExpectStopAfter(milliseconds(700), program);
  for (const auto& file : std::filesystem::directory_iterator(
           std::filesystem::path(folder / "a.enf").parent_path())) {
    EXPECT_FALSE(file.path().filename().string().starts_with("OUT"))
        << file.path();
  }
}

INSTANTIATE_TEST_SUITE_P(
    Verbs,
    StopOfVerb,
    ::testing::Values("resume IN --error 0.00001",
                      "info IN --audit 10000000000",
                      "verify IN --tightness 0.0001 --seconds 1000",
                      "probe IN POINTS -o OUT.csv --rays 1000000",
                      "export IN OUT.png --samples 16 --size 4000,4000",
                      "scene floorplan --rooms 1000000 OUT.obj"),
    [](const auto& verb) {
      const std::string words = verb.param;
      return words.substr(0, words.find(' '));
    });

}  // namespace
}  // namespace enfilade
