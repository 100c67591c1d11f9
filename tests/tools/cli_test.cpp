// The command line as users and scripts see it: verbs, exit codes, messages.

#include <fstream>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

namespace enfilade {
namespace {

using ::testing::TestWithParam;
using ::testing::Values;

// One line, "enfilade: error: ...".
void ExpectOneErrorLine(const ProgramResult& result) {
  EXPECT_EQ(result.err.rfind("enfilade: error: ", 0), 0U) << result.err;
  EXPECT_EQ(result.err.find('\n') + 1, result.err.size()) << result.err;
}

class CliVerb : public TestWithParam<const char*> {};

TEST_P(CliVerb, HelpHasAnExampleAndExitsZero) {
  const auto result = RunProgram({GetParam(), "--help"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(Contains(result.out, "Example")) << result.out;
  EXPECT_TRUE(Contains(result.out, std::string("enfilade ") + GetParam()))
      << result.out;
}

TEST_P(CliVerb, UnknownOptionIsAUsageError) {
  const auto result = RunProgram({GetParam(), "--no-such-option"});
  EXPECT_EQ(result.exit_code, 2);
  ExpectOneErrorLine(result);
}

INSTANTIATE_TEST_SUITE_P(EveryVerb,
                         CliVerb,
                         Values("solve",
                                "resume",
                                "info",
                                "verify",
                                "probe",
                                "compare",
                                "export",
                                "scene",
                                "study",
                                "flatland"));

TEST(Cli, HelpNamesEveryVerb) {
  const auto result = RunProgram({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* verb : {"solve",
                           "resume",
                           "info",
                           "verify",
                           "probe",
                           "compare",
                           "export",
                           "scene",
                           "study",
                           "flatland"}) {
    EXPECT_TRUE(Contains(result.out, std::string("\n  ") + verb)) << verb;
  }
}

TEST(Cli, VersionIsPrinted) {
  const auto result = RunProgram({"--version"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out.rfind("enfilade ", 0), 0U) << result.out;
}

TEST(Cli, NonsenseIsAUsageError) {
  const std::vector<std::vector<std::string>> lines = {
      {},
      {"frobnicate"},
      {"solve"},
      {"solve", "a.obj"},
      {"solve", "a.obj", "-o", "b.enf", "--error", "much"},
      {"solve", "a.obj", "-o", "b.enf", "--basis", "m9"},
      {"solve", "a.obj", "-o", "b.enf", "--memory", "64Q"},
      {"solve", "a.obj", "-o", "b.enf", "--memory", "0"},
      {"solve", "a.obj", "-o", "b.enf", "--threads", "0"},
      {"solve", "a.obj", "b.obj", "-o", "b.enf"},
      {"export", "a.enf", "b.png", "--eye", "1,2"},
      {"export", "a.enf", "b.csv", "--eye", "1,2,3"},
      {"export", "a.enf", "b.ply", "--size", "3,3"},
      {"export", "a.enf", "b.png", "--cut", "1"},
      {"export", "a.enf", "b.png", "--view", "plan", "--fov", "60"},
      {"info", "a.enf", "--audit", "0"},
      {"info", "a.enf", "--audit", "1.5"}};
  for (const auto& line : lines) {
    const auto result = RunProgram(line);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    ExpectOneErrorLine(result);
  }
}

TEST(Cli, WhatIsNotThereIsNamedBesideWhatIs) {
  const auto verb = RunProgram({"frobnicate"});
  EXPECT_TRUE(Contains(verb.err, "'frobnicate'; there are: solve,"))
      << verb.err;
  const auto scene = RunProgram({"scene", "palace", "a.obj"});
  EXPECT_EQ(scene.exit_code, 2);
  EXPECT_TRUE(Contains(scene.err, "no scene 'palace'; there are: chairs,"))
      << scene.err;
  ExpectOneErrorLine(scene);
}

TEST(Cli, OptionsOfScenesAreRefusedForStores) {
  const TemporaryFolder folder;
  const auto result = RunProgram({"info", folder / "a.enf", "--basis", "haar"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(Contains(result.err, "--basis is for a scene")) << result.err;
  ExpectOneErrorLine(result);
}

TEST(Cli, SceneInThePlaceOfAStoreIsBadInput) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "room.obj", 0);
  for (const char* verb : {"resume", "verify"}) {
    const auto result = RunProgram({verb, folder / "room.obj"});
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_TRUE(Contains(result.err, "is a scene, not a store")) << result.err;
  }
}

TEST(Cli, FlatlandDrawsOnlySvg) {
  const TemporaryFolder folder;
  const auto result = RunProgram({"flatland", folder / "matrix.png"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "matrix.png"));
}

TEST(Cli, ErrorOutOfRangeIsAUsageError) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "room.obj", 0);
  for (const char* error : {"0", "-0.1", "nan"}) {
    const auto result = RunProgram({"solve",
                                    folder / "room.obj",
                                    "-o",
                                    folder / "room.enf",
                                    "--error",
                                    error});
    EXPECT_EQ(result.exit_code, 2) << error << ": " << result.err;
    ExpectOneErrorLine(result);
  }
}

TEST(Cli, MissingFilesAreBadInputAndNamed) {
  const TemporaryFolder folder;
  const std::string none = folder / "none";
  const std::vector<std::vector<std::string>> lines = {
      {"solve", none, "-o", folder / "a.enf"},
      {"resume", none},
      {"info", none},
      {"verify", none},
      {"probe", none, none},
      {"compare", none, none},
      {"export", none, folder / "a.ply"}};
  for (const auto& line : lines) {
    const auto result = RunProgram(line);
    EXPECT_EQ(result.exit_code, 3) << line[0] << ": " << result.err;
    EXPECT_TRUE(Contains(result.err, none)) << result.err;
    ExpectOneErrorLine(result);
  }
}

TEST(Cli, BadSceneIsNamedWithFileAndLine) {
  const TemporaryFolder folder;
  WriteFile(folder / "bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  const auto result =
      RunProgram({"solve", folder / "bad.obj", "-o", folder / "bad.enf"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_TRUE(Contains(result.err, "bad.obj:4")) << result.err;
  ExpectOneErrorLine(result);
}

TEST(Cli, RefusedSceneLeavesNoStoreInTheWay) {
  const TemporaryFolder folder;
  WriteFile(folder / "bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  RunProgram({"solve", folder / "bad.obj", "-o", folder / "bad.enf"});
  for (const auto& entry : std::filesystem::directory_iterator(folder.Path())) {
    EXPECT_EQ(entry.path().filename(), "bad.obj");
  }
}

// What runs out of memory in its import keeps nothing, and promises nothing.
TEST(Cli, ASceneThatCannotBeImportedLeavesNoStore) {
  const TemporaryFolder folder;
  std::string materials;
  for (int i = 0; i < 40'000; ++i) {
    materials += "newmtl m" + std::to_string(i) + "\nKd .5 .5 .5\n";
  }
  WriteFile(folder / "a.mtl", materials);
  WriteFile(folder / "a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m1\nf 1 2 3\n");
  const auto result = RunProgram(
      {"solve", folder / "a.obj", "-o", folder / "a.enf", "--memory", "32M"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_TRUE(Contains(result.err, "no room for the materials")) << result.err;
  EXPECT_FALSE(Contains(result.err, "resume")) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "a.enf"));
}

TEST(Cli, FileThatIsNoStoreIsNamed) {
  const TemporaryFolder folder;
  const std::string text = "This is no store, but a file of some length.\n";
  WriteFile(folder / "text.enf", text);
  for (const char* verb : {"info", "resume", "verify"}) {
    const auto result = RunProgram({verb, folder / "text.enf"});
    EXPECT_TRUE(result.exit_code == 3 || result.exit_code == 5)
        << verb << " " << result.exit_code;
    EXPECT_TRUE(Contains(result.err, "text.enf")) << result.err;
    ExpectOneErrorLine(result);
  }
  EXPECT_EQ(ReadFile(folder / "text.enf"), text);
}

TEST(Cli, ExistingFileIsNeverWrittenOver) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "room.obj", 0);
  WriteFile(folder / "precious.enf", "precious");
  const auto result =
      RunProgram({"solve", folder / "room.obj", "-o", folder / "precious.enf"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(Contains(result.err, "precious.enf")) << result.err;
  EXPECT_EQ(ReadFile(folder / "precious.enf"), "precious");
}

TEST(Cli, NothingIsWrittenOverWhatIsRead) {
  const TemporaryFolder folder;
  const std::string scene = folder / "b.obj";
  ASSERT_EQ(RunProgram({"scene", "parallel", scene}).exit_code, 0);
  const std::string text = ReadFile(scene);
  const std::vector<std::vector<std::string>> lines = {
      {"info", scene, "--report", scene},
      {"solve", scene, "-o", folder / "s.enf", "--report", scene},
      {"probe", scene, scene, "-o", scene},
      {"export", scene, scene},
      // The export writes its numbers to b.bin.
      {"export", folder / "b.bin", folder / "b.gltf"}};
  WriteFile(folder / "b.bin", "a store");
  for (const auto& words : lines) {
    const auto result = RunProgram(words);
    EXPECT_EQ(result.exit_code, 2) << words[0];
    EXPECT_TRUE(Contains(result.err, "written over")) << result.err;
    EXPECT_EQ(ReadFile(scene), text) << words[0];
  }
}

TEST(Cli, TheReportIsNotWrittenOverTheScene) {
  const TemporaryFolder folder;
  const std::string scene = folder / "b.obj";
  const std::vector<std::string> make = {
      "scene", "parallel", scene, "--report"};
  for (const char* name : {"b.obj", "b.mtl"}) {
    auto words = make;
    words.push_back(folder / name);
    const auto refused = RunProgram(words);
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_TRUE(Contains(refused.err, "written over")) << refused.err;
    EXPECT_EQ(ReadFile(scene), "") << "nothing was written";
  }
  ASSERT_EQ(RunProgram({"scene", "parallel", scene}).exit_code, 0);
  const std::string overrides = folder / "o.json";
  const std::string store = folder / "s.enf";
  WriteFile(overrides, "{}");
  ASSERT_EQ(RunProgram({"solve", scene, "-o", store, "--overrides", overrides})
                .exit_code,
            0);
  const std::vector<std::vector<std::string>> lines = {
      {"info", scene, "--overrides", overrides, "--report", overrides},
      {"resume", store, "--report", scene},
      {"resume", store, "--report", overrides},
      {"resume", store, "--report", folder / "b.mtl"}};
  const std::string text = ReadFile(scene);
  const std::string materials = ReadFile(folder / "b.mtl");
  for (const auto& words : lines) {
    EXPECT_EQ(RunProgram(words).exit_code, 2) << words[0];
  }
  EXPECT_EQ(ReadFile(scene), text);
  EXPECT_EQ(ReadFile(overrides), "{}");
  EXPECT_EQ(ReadFile(folder / "b.mtl"), materials);
  const std::string report = folder / "r.json";
  for (int run = 0; run < 2; ++run) {  // a report may replace a report
    EXPECT_EQ(RunProgram({"resume", store, "--report", report}).exit_code, 0);
  }
}

// A .gltf has a .bin beside it, which nobody named.
TEST(Cli, AGltfReplacesNoUnrelatedFile) {
  const TemporaryFolder folder;
  const std::string scene = folder / "b.obj";
  const std::string store = folder / "s.enf";
  ASSERT_EQ(RunProgram({"scene", "parallel", scene}).exit_code, 0);
  ASSERT_EQ(RunProgram({"solve", scene, "-o", store}).exit_code, 0);
  WriteFile(folder / "b.bin", "precious");
  const auto refused = RunProgram({"export", store, folder / "b.gltf"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(Contains(refused.err, "b.bin' exists")) << refused.err;
  EXPECT_EQ(ReadFile(folder / "b.bin"), "precious");
  for (int run = 0; run < 2; ++run) {  // it may replace its own
    EXPECT_EQ(RunProgram({"export", store, folder / "c.gltf"}).exit_code, 0);
  }
}

TEST(Cli, AGeneratedSceneReplacesNoUnrelatedFile) {
  const TemporaryFolder folder;
  WriteFile(folder / "b.mtl", "precious");
  const auto refused = RunProgram({"scene", "box", folder / "b.obj"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(Contains(refused.err, "b.mtl' exists")) << refused.err;
  EXPECT_EQ(ReadFile(folder / "b.mtl"), "precious");
  EXPECT_FALSE(std::filesystem::exists(folder / "b.obj"));
  for (const char* scene : {"box", "parallel"}) {  // it may replace its own
    EXPECT_EQ(RunProgram({"scene", scene, folder / "c.obj"}).exit_code, 0);
  }
}

TEST(Cli, StudyAndFlatlandReportToo) {
  const TemporaryFolder folder;
  const std::string report = folder / "r.json";
  ASSERT_EQ(
      RunProgram({"flatland", folder / "m.svg", "--report", report}).exit_code,
      0);
  EXPECT_TRUE(Contains(ReadFile(report), "large_entries"));
  const auto refused =
      RunProgram({"flatland", folder / "m.svg", "--report", folder / "m.svg"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(RunProgram({"study", "box", "--report", folder / "none/r.json"})
                .exit_code,
            6);
  for (const char* name : {"box.md", "box.jsonl"}) {
    EXPECT_EQ(RunProgram({"study",
                          "box",
                          "--out",
                          folder / "out",
                          "--report",
                          folder / (std::string("out/") + name)})
                  .exit_code,
              2)
        << name;
  }
}

TEST(Cli, TheReportIsNotWrittenOverWhatIsMade) {
  const TemporaryFolder folder;
  const std::string scene = folder / "b.obj";
  const std::string store = folder / "s.enf";
  ASSERT_EQ(RunProgram({"scene", "parallel", scene}).exit_code, 0);
  const auto refused =
      RunProgram({"solve", scene, "-o", store, "--report", store});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(Contains(refused.err, "written over")) << refused.err;
  ASSERT_EQ(RunProgram({"solve", scene, "-o", store}).exit_code, 0);
  const std::string points = folder / "p.csv";
  WriteFile(points, "0,0,0.5,0,0,1\n");
  const std::vector<std::vector<std::string>> lines = {
      {"export", store, folder / "out.csv", "--report", folder / "out.csv"},
      {"probe", store, points, "-o", points},
      {"probe", store, points, "-o", folder / "q", "--report", folder / "q"}};
  for (const auto& words : lines) {
    const auto result = RunProgram(words);
    EXPECT_EQ(result.exit_code, 2) << words[0];
    EXPECT_TRUE(Contains(result.err, "written over")) << result.err;
  }
}

TEST(Cli, NumbersThatWrapOrDoNotFitAreUsageErrors) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--memory", "-1"},
        {"--memory", "18446744073709551616"},
        {"--seed", "-1"},
        {"--seed", "99999999999999999999999"}}) {
    const auto result =
        RunProgram({"solve", "a.obj", "-o", "a.enf", words[0], words[1]});
    EXPECT_EQ(result.exit_code, 2) << words[0] << ' ' << words[1];
    EXPECT_TRUE(Contains(result.err, words[1])) << result.err;
  }
}

TEST(Cli, WhatIsNoSizeIsAUsageError) {
  for (const char* size :
       {"1.5.2G", "nan", "infG", "1,5G", "G", "1 5G", "0.5", "-0.5G", "1e9"}) {
    const auto result =
        RunProgram({"solve", "a.obj", "-o", "a.enf", "--memory", size});
    EXPECT_EQ(result.exit_code, 2) << size;
    EXPECT_TRUE(Contains(result.err, size)) << result.err;
  }
}

// No other verb would take a file of that name for a store.
TEST(Cli, AStoreHasNoNameOfAScene) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "room.obj", 0);
  const auto result =
      RunProgram({"solve", folder / "room.obj", "-o", folder / "lit.obj"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(Contains(result.err, "lit.enf")) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "lit.obj"));
}

TEST(Cli, ACapWithoutItsUnitIsAUsageError) {
  const auto result =
      RunProgram({"solve", "a.obj", "-o", "a.enf", "--memory", "64"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(Contains(result.err, "'64' is 64 bytes, in which nothing runs"))
      << result.err;
}

// Input is read more than once, so that a pipe would be waited for without end.
TEST(Cli, PipesAndDevicesAreNoScenes) {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe.obj";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const auto result = RunProgram({"solve", pipe, "-o", folder / "a.enf"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_TRUE(Contains(result.err, "pipe.obj")) << result.err;
}

TEST(Cli, TooSmallACapNamesTheLeast) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "room.obj", 0);
  const auto result = RunProgram({"solve",
                                  folder / "room.obj",
                                  "-o",
                                  folder / "room.enf",
                                  "--memory",
                                  "8M"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_TRUE(Contains(result.err, "least cap")) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "room.enf"));
}

TEST(Cli, StoreInAMissingFolderIsADiskError) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "room.obj", 0);
  const auto result = RunProgram(
      {"solve", folder / "room.obj", "-o", folder / "no/such/room.enf"});
  EXPECT_EQ(result.exit_code, 6) << result.err;
  ExpectOneErrorLine(result);
}

// The error is reported before the work is done, not after it.
TEST(Cli, ReportInAMissingFolderIsRefusedAtOnce) {
  const TemporaryFolder folder;
  WriteRoomScene(folder / "room.obj", 0);
  const auto result = RunProgram({"solve",
                                  folder / "room.obj",
                                  "-o",
                                  folder / "room.enf",
                                  "--report",
                                  folder / "no/such/room.json"});
  EXPECT_EQ(result.exit_code, 6);
  EXPECT_TRUE(Contains(result.err, "room.json")) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "room.enf"));
}

// The studies call the first of the multiwavelets M1: it is Haar.
TEST(Cli, TheBasisM1IsHaar) {
  const TemporaryFolder folder;
  const std::string report = folder / "two.json";
  ASSERT_EQ(RunProgram({"scene", "parallel", folder / "two.obj"}).exit_code, 0);
  const ProgramResult solve = RunProgram({"solve",
                                          folder / "two.obj",
                                          "-o",
                                          folder / "two.enf",
                                          "--error",
                                          "0.5",
                                          "--basis",
                                          "m1",
                                          "--report",
                                          report});
  ASSERT_EQ(solve.exit_code, 0) << solve.err;
  EXPECT_EQ(nlohmann::json::parse(ReadFile(report)).at("basis"), "haar");
}

// The tests' standard output is a file: nothing else that is printed may lie
// over the report.
TEST(Cli, ReportToStandardOutputIsPrinted) {
  const TemporaryFolder folder;
  const auto result = RunProgram(
      {"scene", "parallel", folder / "two.obj", "--report", "/dev/stdout"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const size_t begin = result.out.find('{');
  ASSERT_NE(begin, std::string::npos) << result.out;
  const std::string report =
      result.out.substr(begin, result.out.rfind('}') + 1 - begin);
  EXPECT_EQ(nlohmann::json::parse(report).at("polygons"), 2) << result.out;
  EXPECT_TRUE(Contains(result.out, "wrote ")) << result.out;
  EXPECT_TRUE(std::filesystem::is_symlink("/dev/stdout"));
}

}  // namespace
}  // namespace enfilade
