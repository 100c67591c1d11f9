// The promises of the program on real buildings: the error that was asked for,
// measured, and the memory cap.

#include <string>
#include <vector>

#include "tests/partition/real_buildings.h"
#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

constexpr uint64_t kCapBytes = 256 << 20;
constexpr double kError = 0.1;

class SlowRealSolves : public testing::RealBuildings {};

TEST_P(SlowRealSolves, MeetErrorAndCap) {
  const TemporaryFolder folder;
  const std::string scene = (DataFolder() / GetParam()).string();
  const std::string store = folder / "building.enf";
  const std::string report = folder / "verify.json";
  const ProgramResult solve = RunProgram({"solve",
                                          scene,
                                          "-o",
                                          store,
                                          "--default-luminaires",
                                          "--error",
                                          "0.1",
                                          "--memory",
                                          "256M"});
  ASSERT_EQ(solve.exit_code, 0) << solve.err;
  EXPECT_LE(solve.peak_rss_bytes, kCapBytes);
  const ProgramResult verify = RunProgram({"verify",
                                           store,
                                           "--seconds",
                                           "60",
                                           "--memory",
                                           "256M",
                                           "--report",
                                           report});
  ASSERT_EQ(verify.exit_code, 0) << verify.err;
  EXPECT_LE(verify.peak_rss_bytes, kCapBytes);
  const json verified = json::parse(ReadFile(report));
  EXPECT_EQ(verified.at("requested_error"), kError);
  EXPECT_EQ(verified.at("meets_request"), true) << verified.at("error_high");
}

INSTANTIATE_TEST_SUITE_P(Files,
                         SlowRealSolves,
                         ::testing::Values("gbxml/london.xml",
                                           "gbxml/bristol.xml",
                                           "gbxml/boston-utf16.xml",
                                           "gbxml/columbia-broken-shells.xml"));

}  // namespace
}  // namespace enfilade
