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

constexpr uint64_t kCapBytes = 64 << 20;

// Runs a verb under the cap; expects it to succeed within the cap.
void RunUnderCap(std::vector<std::string> words) {
  words.insert(words.end(), {"--memory", "64M"});
  const ProgramResult result = RunProgram(words);
  ASSERT_EQ(result.exit_code, 0) << words[0] << ": " << result.err;
  EXPECT_LE(result.peak_rss_bytes, kCapBytes) << words[0];
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
  RunUnderCap({"info", store, "--audit", "100000"});
  RunUnderCap({"export", store, folder / "chairs.ply"});
  RunUnderCap({"export", store, folder / "chairs.png", "--size", "320,180"});
}

}  // namespace
}  // namespace enfilade
