// Rooms that reflect next to nothing: the error is relative to the reflected
// light, which makes small differences of the irradiance count.

#include <cstdint>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

constexpr double kAsked = 0.1;

// Four chairs, solved with these options added.
class ChairsIn {
 public:
  explicit ChairsIn(const std::vector<std::string>& options) {
    const std::string scene = folder_ / "chairs.obj";
    EXPECT_EQ(RunProgram({"scene", "chairs", "--count", "4", scene}).exit_code,
              0);
    std::vector<std::string> arguments = {"solve",
                                          scene,
                                          "-o",
                                          folder_ / "chairs.enf",
                                          "--error",
                                          std::to_string(kAsked),
                                          "--report",
                                          folder_ / "solve.json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ProgramResult solve = RunProgram(arguments);
    EXPECT_EQ(solve.exit_code, 0) << solve.err;
  }

  [[nodiscard]] uint64_t Links() const {
    return json::parse(ReadFile(folder_ / "solve.json")).at("links");
  }

  [[nodiscard]] double VerifiedError() const {
    const ProgramResult verify = RunProgram({"verify",
                                             folder_ / "chairs.enf",
                                             "--seconds",
                                             "10",
                                             "--report",
                                             folder_ / "verify.json"});
    EXPECT_EQ(verify.exit_code, 0) << verify.err;
    return json::parse(ReadFile(folder_ / "verify.json")).at("error");
  }

 private:
  TemporaryFolder folder_;
};

// Where walls reflect a thousandth, light that bounces twice is a thousandth of
// what bounces once: less has to be found than in a bright room, and by no more
// links.
TEST(DarkRooms, TakeNoMoreLinksThanBrightOnes) {
  const TemporaryFolder folder;
  const std::string dark = folder / "dark.json";
  WriteFile(dark, R"({"materials": {"*": {"reflectance": 0.001}}})");
  const ChairsIn bright_room({});
  const ChairsIn dark_room({"--overrides", dark});
  EXPECT_LE(dark_room.Links(), bright_room.Links());
  EXPECT_LE(dark_room.VerifiedError(), kAsked);
}

}  // namespace
}  // namespace enfilade
