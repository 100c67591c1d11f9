// `enfilade solve` and `verify` as their users call them.

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

// The lamp hangs above the floor and looks up.
TEST(SolveCommand, ALampThatLooksAwayIsNoted) {
  const TemporaryFolder folder;
  WriteFile(folder / "a.mtl",
            "newmtl floor\nKd 0.5 0.5 0.5\n"
            "newmtl lamp\nKd 0 0 0\nKe 10 10 10\n");
  WriteFile(folder / "a.obj",
            "mtllib a.mtl\n"
            "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\n"
            "v 1 1 2\nv 2 1 2\nv 2 2 2\nv 1 2 2\n"
            "usemtl floor\nf 1 2 3 4\nusemtl lamp\nf 5 6 7 8\n");
  const ProgramResult result = SolveScene(folder.Path(), "a", {});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(Contains(result.out, "no light falls on")) << result.out;
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
