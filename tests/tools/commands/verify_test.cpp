// `enfilade verify` as its users call it.

#include <filesystem>
#include <regex>
#include <string>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

// "bris\xe9" is Latin-1, and no UTF-8.
const std::string kLatin1 = "bris\xe9";

TEST(VerifyCommand, NamesInAnyEncodingAreReported) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "a.obj", 0);
  for (const char* file : {"a.obj", "a.mtl"}) {
    const std::string text = ReadFile(folder / file);
    WriteFile(
        folder / file,
        std::regex_replace(text, std::regex("mtl wall"), "mtl " + kLatin1));
  }
  ASSERT_EQ(SolveScene(folder.Path(), "a", {"--error", "0.5"}).exit_code, 0);
  const ProgramResult result = RunProgram({"verify",
                                           folder / "a.enf",
                                           "--seconds",
                                           "1",
                                           "--report",
                                           folder / "verify.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out.rfind("error ", 0), 0U) << result.out;
  const auto report = nlohmann::json::parse(ReadFile(folder / "verify.json"));
  bool is_named = false;
  for (const auto& point : report.at("largest_differences")) {
    const auto material = point.at("material").get<std::string>();
    is_named = is_named || material == "bris\xef\xbf\xbd";  // U+FFFD
  }
  EXPECT_TRUE(is_named) << report.at("largest_differences").dump();
}

TEST(SolveCommand, APathThatIsNoUtf8IsRefused) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / (kLatin1 + ".obj"), 0);
  const ProgramResult result = RunProgram(
      {"solve", folder / (kLatin1 + ".obj"), "-o", folder / "a.enf"});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_TRUE(Contains(result.err, "is not UTF-8")) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "a.enf"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.enf.part"));
}

}  // namespace
}  // namespace enfilade
