// A stop is heeded within the stages before the solve, too.

#include <chrono>
#include <cmath>
#include <csignal>
#include <string>
#include <thread>

#include "tests/tools/run_program.h"
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

// Runs the program for `delay` and asks it to stop: the program must end soon,
// and the store must be one to go on with.
void ExpectStopAfter(milliseconds delay, const TemporaryFolder& folder) {
  constexpr auto kSoon = milliseconds(3000);  // of a machine that is busy
  RunningProgram program(
      {"solve", folder / "star.obj", "-o", folder / "a.enf"});
  std::this_thread::sleep_for(delay);
  const auto asked = steady_clock::now();
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_LT(steady_clock::now() - asked, kSoon);
  EXPECT_EQ(result.exit_code, 130) << result.err;
  const ProgramResult info = RunProgram({"info", folder / "a.enf"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_TRUE(Contains(info.out, "enfilade resume")) << info.out;
}

TEST(Stop, IsHeededWhileAFaceIsCut) {
  const TemporaryFolder folder;
  WriteStar(folder / "star.obj", 35'000, 0.2);
  ExpectStopAfter(milliseconds(1000), folder);
}

TEST(Stop, IsHeededWhileCellsAreFound) {
  const TemporaryFolder folder;
  WriteStar(folder / "star.obj", 20'000, 0);
  ExpectStopAfter(milliseconds(5000), folder);
}

}  // namespace
}  // namespace enfilade
