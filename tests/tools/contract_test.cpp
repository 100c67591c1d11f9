// The two promises of the program held together: the memory cap and the error,
// on the 36 chairs of the 1997 study.

#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

constexpr uint64_t kChairsCapBytes = 64 << 20;

// Runs a verb under the cap; expects it to succeed within the cap.
void RunUnderCap(std::vector<std::string> words) {
  words.insert(words.end(), {"--memory", "64M"});
  const ProgramResult result = RunProgram(words);
  ASSERT_EQ(result.exit_code, 0) << words[0] << ": " << result.err;
  EXPECT_LE(result.peak_rss_bytes, kChairsCapBytes) << words[0];
}

TEST(SlowContract, ThirtySixChairsMeetErrorAndCap) {
  const TemporaryFolder folder;
  const std::string scene = folder / "chairs.obj";
  const std::string store = folder / "chairs.enf";
  ASSERT_EQ(RunProgram({"scene", "chairs", "--count", "36", scene}).exit_code,
            0);
  RunUnderCap({"solve", scene, "-o", store, "--error", "0.05"});
  RunUnderCap({"verify", store, "--report", folder / "verify.json"});
  const json verified = json::parse(ReadFile(folder / "verify.json"));
  EXPECT_LE(verified.at("error_high").get<double>(), 0.05);
  EXPECT_EQ(verified.at("requested_error"), 0.05);
  EXPECT_EQ(verified.at("meets_request"), true);
  RunUnderCap({"info", store, "--audit", "100000"});
  RunUnderCap({"export", store, folder / "chairs.ply"});
  RunUnderCap({"export", store, folder / "chairs.png", "--size", "320,180"});
}

// How far trees grow is known only once they have grown. The solve keeps any
// cap, and a resume with the named cap comes to an end.
TEST(SlowContract, AFloorRefusedForMemoryGoesOnWithTheCapNamed) {
  const TemporaryFolder folder;
  const std::string scene = folder / "floor.obj";
  const std::string store = folder / "floor.enf";
  ASSERT_EQ(
      RunProgram({"scene", "floorplan", "--rooms", "12", scene}).exit_code, 0);
  std::vector<std::string> words = {
      "solve", scene, "-o", store, "--error", "0.1", "--memory"};
  constexpr int kTries = 4;
  int cap = 30;
  int tries = 0;
  for (bool is_done = false; !is_done; ++tries) {
    ASSERT_LT(tries, kTries);
    words.push_back(std::to_string(cap) + "M");
    const ProgramResult result = RunProgram(words);
    EXPECT_LE(result.peak_rss_bytes, static_cast<uint64_t>(cap) << 20);
    is_done = result.exit_code == 0;
    if (!is_done) {
      ASSERT_EQ(result.exit_code, 4) << result.err;
      const int named = NamedCapMiB(result.err);
      ASSERT_GT(named, cap) << result.err;
      EXPECT_NE(result.err.find("enfilade resume"), std::string::npos)
          << result.err;
      cap = named;
      words = {"resume", store, "--memory"};
    }
  }
  EXPECT_GT(tries, 1) << "the first cap was meant to be too little";
}

}  // namespace
}  // namespace enfilade
