// The simplest rooms with a lamp: their solves end, with the error that was
// asked for, whatever the lamp's height and the random numbers.

#include "base/vec.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

constexpr const char* kMaterials =
    "newmtl wall\nKd 0.7 0.7 0.7\n"
    "newmtl floor\nKd 0.3 0.3 0.3\n"
    "newmtl white\nKd 0.95 0.95 0.95\n"
    "newmtl black\nKd 0 0 0\n"
    "newmtl lamp\nKd 0 0 0\nKe 30 30 30\n"
    "newmtl bulb\nKd 0 0 0\nKe 200 200 200\n";

// A rectangle that looks down or up.
std::string LevelText(
    double x0, double y0, double x1, double y1, double z, bool down) {
  const std::string a = fmt::format("v {} {} {}\n", x0, y0, z);
  const std::string b = fmt::format("v {} {} {}\n", x1, y0, z);
  const std::string c = fmt::format("v {} {} {}\n", x1, y1, z);
  const std::string d = fmt::format("v {} {} {}\n", x0, y1, z);
  return (down ? a + d + c + b : a + b + c + d) + "f -4 -3 -2 -1\n";
}

// The six sides of a box, which look inwards.
std::string BoxText(Point3 low, Point3 high, const std::string& bottom) {
  std::string text;
  for (int corner = 0; corner < 8; ++corner) {
    text += fmt::format("v {} {} {}\n",
                        (corner & 1) != 0 ? high.x : low.x,
                        (corner & 2) != 0 ? high.y : low.y,
                        (corner & 4) != 0 ? high.z : low.z);
  }
  return text + "f -4 -2 -1 -3\nf -8 -7 -3 -4\nf -6 -5 -1 -2\n" +
         "f -8 -4 -2 -6\nf -7 -5 -1 -3\n" + bottom + "f -8 -6 -5 -7\n";
}

class SlowLampRooms : public ::testing::Test {
 protected:
  SlowLampRooms() { WriteFile(folder_ / "a.mtl", kMaterials); }

  // A room of 6 x 5 x 3 m with a lamp of 0.6 m, and `more`.
  void WriteRoom(double below_ceiling, const std::string& more) {
    WriteFile(
        folder_ / "a.obj",
        "mtllib a.mtl\nusemtl wall\n" +
            BoxText({0, 0, 0}, {6, 5, 3}, "usemtl floor\n") + "usemtl lamp\n" +
            LevelText(2.7, 2.2, 3.3, 2.8, 3 - below_ceiling, true) + more);
  }

  // The report of a solve that must reach its error.
  json Solve(const std::vector<std::string>& more) {
    std::filesystem::remove(folder_ / "a.enf");
    const ProgramResult solved = SolveScene(folder_.Path(), "a", more);
    EXPECT_EQ(solved.exit_code, 0) << solved.err;
    return json::parse(ReadFile(folder_ / "a.json"));
  }

  TemporaryFolder folder_;
};

TEST_F(SlowLampRooms, ReachTheirErrorAtAnyHeightOfTheLamp) {
  for (const double below : {0.01, 0.05, 0.3}) {
    WriteRoom(below, "");
    for (const char* error : {"0.1", "0.05"}) {
      for (const char* seed : {"1", "2"}) {
        const json report = Solve({"--error", error, "--seed", seed});
        // Estimates that did not see the black lamp took ten times as many, or
        // gave up.
        EXPECT_LT(report.at("links"), 60'000) << below << error << seed;
      }
    }
  }
}

// Lamps in the plane of a ceiling hide a part of it. On a site of half a
// kilometre rays began in front of both, and the part seemed to be lit.
TEST_F(SlowLampRooms, HideTheCeilingThatTheyLieInOnALargeSite) {
  WriteRoom(0,
            "usemtl lamp\n" + LevelText(0.5, 0.5, 5.5, 2, 3, true) +
                "usemtl black\n" +
                LevelText(-300, -300, 300, 300, -0.1, false));
  // Counting the black site, the first guess of the light was far too low, and
  // the first round far too fine.
  EXPECT_LT(Solve({"--error", "0.1"}).at("links"), 20'000);
  const ProgramResult verified = RunProgram({"verify",
                                             folder_ / "a.enf",
                                             "--seconds",
                                             "10",
                                             "--report",
                                             folder_ / "v.json"});
  ASSERT_EQ(verified.exit_code, 0) << verified.err;
  const json report = json::parse(ReadFile(folder_ / "v.json"));
  EXPECT_LE(report.at("error").get<double>(), 0.1);
}

// A bright box on the floor: its own floor is put before that of the room, and
// the strips of its walls between the two are none of the scene.
TEST_F(SlowLampRooms, ABoxThatStandsOnTheFloorIsLikeOneAboveIt) {
  const auto box = [](double z) {
    return "usemtl white\n" +
           BoxText({1, 1, z}, {1.5, 1.5, z + 0.5}, "usemtl white\n") +
           "usemtl bulb\n" + LevelText(1.2, 1.2, 1.3, 1.3, z + 0.45, true);
  };
  WriteRoom(0.05, box(0.2));
  const uint64_t above = Solve({"--error", "0.1"}).at("links");
  WriteRoom(0.05, box(0));
  const uint64_t standing = Solve({"--error", "0.1"}).at("links");
  EXPECT_LT(standing, 2 * above);
}

}  // namespace
}  // namespace enfilade
