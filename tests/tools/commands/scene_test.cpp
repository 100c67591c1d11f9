// `enfilade scene` as a command line.

#include "base/error.h"

#include <filesystem>
#include <string>

#include "tests/tools/run_program.h"
#include "tools/commands/command.h"
#include <CLI/CLI.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade::testing {
namespace {

void RunScene(const std::string& arguments) {
  CLI::App app;
  AddSceneCommand(app);
  app.parse(arguments);
}

TEST(SceneCommand, EveryHelpShowsAnExample) {
  CLI::App app;
  AddSceneCommand(app);
  const CLI::App* scenes = app.get_subcommand("scene");
  const auto commands =
      scenes->get_subcommands([](const CLI::App*) { return true; });
  ASSERT_FALSE(commands.empty());
  for (const CLI::App* command : commands) {
    EXPECT_NE(command->help().find("enfilade scene " + command->get_name()),
              std::string::npos);
  }
  EXPECT_THROW(RunScene("scene chairs --help"), CLI::CallForHelp);
}

TEST(SceneCommand, WritesObjMtlAndReport) {
  const TemporaryFolder dir;
  const std::string out = dir / "c.obj";
  RunScene("scene chairs --count 4 --scaling none --report " +
           (dir / "r.json") + " " + out);
  EXPECT_TRUE(std::filesystem::exists(out));
  EXPECT_NE(ReadFile(out).find("mtllib c.mtl"), std::string::npos);
  EXPECT_NE(ReadFile(dir / "c.mtl").find("Ke 20 20 20"), std::string::npos);
  const auto report = nlohmann::json::parse(ReadFile(dir / "r.json"));
  EXPECT_EQ(report.at("polygons"), 5 + 27 * 4);
}

TEST(SceneCommand, OptionsReachTheirScenes) {
  const TemporaryFolder dir;
  const std::string out = dir / "s.obj";
  RunScene("scene parallel --separation 0.25 " + out);
  EXPECT_NE(ReadFile(out).find("v 0 0 0.25"), std::string::npos);
  RunScene("scene perpendicular --separation 0.25 " + out);
  EXPECT_NE(ReadFile(out).find("v -0.25 0 0"), std::string::npos);
  RunScene("scene blocker --separation 1.5 " + out);
  EXPECT_NE(ReadFile(out).find("v -0.2 -0.2 1.5"), std::string::npos);
  EXPECT_NE(ReadFile(dir / "s.mtl").find("sides 1"), std::string::npos);
  RunScene("scene bulbs --slices 2 --report " + (dir / "r.json") + " " + out);
  EXPECT_EQ(nlohmann::json::parse(ReadFile(dir / "r.json")).at("polygons"),
            36 + 8 * 2);
  RunScene("scene box --reflectance 0.8 " + out);
  EXPECT_NE(ReadFile(dir / "s.mtl").find("Ke 12.5"), std::string::npos);
  RunScene("scene tube --reflectance 0.8 " + out);
  EXPECT_NE(ReadFile(dir / "s.mtl").find("Kd 0.8"), std::string::npos);
  RunScene("scene furnace --reflectance 0.8 --emission 3 --count 0 " + out);
  EXPECT_NE(ReadFile(dir / "s.mtl").find("Kd 0.8 0.8 0.8\nKe 3 3 3"),
            std::string::npos);
  RunScene("scene lights --lights 2 " + out);
  EXPECT_NE(ReadFile(out).find("o light2\n"), std::string::npos);
  RunScene("scene floorplan --rooms 4 --storeys 2 --furniture 0 --seed 3 " +
           out);
  EXPECT_NE(ReadFile(out).find("o storey2_wing1_"), std::string::npos);
}

TEST(SceneCommand, AFloorplanOfManyRoomsHasStoreys) {
  const TemporaryFolder dir;
  const std::string out = dir / "s.obj";
  RunScene("scene floorplan --rooms 1000 --furniture 0 " + out);
  EXPECT_EQ(ReadFile(out).find("o storey2_"), std::string::npos);
  RunScene("scene floorplan --rooms 1001 --furniture 0 " + out);
  EXPECT_NE(ReadFile(out).find("o storey2_"), std::string::npos);
  EXPECT_EQ(ReadFile(out).find("o storey3_"), std::string::npos);
}

TEST(SceneCommand, BadCommandLinesAreRefusedAndLeaveNoFile) {
  const TemporaryFolder dir;
  const std::string out = dir / "s.obj";
  EXPECT_THROW(RunScene("scene"), CLI::ParseError);
  EXPECT_THROW(RunScene("scene nosuch " + out), CLI::ParseError);
  EXPECT_THROW(RunScene("scene chairs"), CLI::ParseError);
  EXPECT_THROW(RunScene("scene chairs --count -3 " + out), CLI::ParseError);
  EXPECT_THROW(RunScene("scene chairs --scaling up " + out), CLI::ParseError);
  EXPECT_THROW(RunScene("scene floorplan --storeys 0 " + out), UsageError);
  EXPECT_THROW(RunScene("scene tube --reflectance 2 " + out), UsageError);
  EXPECT_THROW(RunScene("scene tube " + (dir / "s.ply")), UsageError);
  EXPECT_TRUE(std::filesystem::is_empty(dir.Path()));
}

}  // namespace
}  // namespace enfilade::testing
