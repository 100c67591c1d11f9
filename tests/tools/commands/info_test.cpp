// `enfilade info SCENE`: the cost of a solve before it begins.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/tools/run_program.h"
#include "tests/tools/store_blocks.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

class InfoOfScene : public ::testing::Test {
 protected:
  InfoOfScene() { WriteRoomScene(dir_ / "room.obj", 3); }

  nlohmann::json Estimate(const std::string& error, const std::string& basis) {
    const auto result = RunProgram({"info",
                                    dir_ / "room.obj",
                                    "--error",
                                    error,
                                    "--basis",
                                    basis,
                                    "--memory",
                                    "64M",
                                    "--report",
                                    dir_ / "r.json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("least     --memory "), std::string::npos)
        << result.out;
    return nlohmann::json::parse(ReadFile(dir_ / "r.json"));
  }

  TemporaryFolder dir_;
};

TEST_F(InfoOfScene, HasTheKeysOfAStoreAndTheEstimate) {
  const auto report = Estimate("0.1", "m2");
  EXPECT_GT(report.at("cells").get<int>(), 0);
  EXPECT_GT(report.at("patches").get<int>(), 0);
  EXPECT_EQ(report.at("links"), 0) << "nothing was solved";
  const auto& estimate = report.at("estimate");
  for (const char* key :
       {"links", "elements", "store_bytes", "solve_seconds", "factor"}) {
    EXPECT_GT(estimate.at(key).get<double>(), 0) << key;
  }
}

TEST_F(InfoOfScene, SmallerErrorsCostMore) {
  const auto coarse = Estimate("0.2", "m2").at("estimate");
  const auto fine = Estimate("0.05", "m2").at("estimate");
  for (const char* key : {"links", "store_bytes", "solve_seconds"}) {
    EXPECT_GT(fine.at(key).get<double>(), coarse.at(key).get<double>()) << key;
  }
}

// A byte that is wrong anywhere in the blocks is found, also where no verb
// would read it.
TEST_F(InfoOfScene, CheckFindsAWrongByte) {
  const std::string store = dir_ / "a.enf";
  ASSERT_EQ(
      RunProgram({"solve", dir_ / "room.obj", "-o", store, "--error", "0.3"})
          .exit_code,
      0);
  const ProgramResult whole = RunProgram({"info", store, "--check"});
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_NE(whole.out.find("all whole"), std::string::npos) << whole.out;
  const std::string content = ReadFile(store);
  const auto blocks = BlocksOf(store);
  ASSERT_GT(blocks.size(), 5U);
  size_t found = 0;
  constexpr size_t kTries = 40;
  for (size_t i = 0; i < kTries; ++i) {
    std::string wrong = content;
    wrong[(2 * i + 1) * wrong.size() / (2 * kTries)] ^= 1;
    WriteFile(store, wrong);
    const int code = RunProgram({"info", store, "--check"}).exit_code;
    EXPECT_TRUE(code == 0 || code == 5 || code == 3) << code;
    if (code == 0) {  // most of so small a store is free space of pages
      EXPECT_EQ(BlocksOf(store), blocks) << "byte " << i;
    }
    found += code != 0 ? 1 : 0;
  }
  EXPECT_GT(found, 0U);
  EXPECT_EQ(RunProgram({"info", dir_ / "room.obj", "--check"}).exit_code, 2);
}

// For a store, `info` says what a resume would take if the store is not solved
// or if another error is asked for.
TEST_F(InfoOfScene, StoresSayWhatAResumeWouldTake) {
  const auto info = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {
        "info", dir_ / "s.enf", "--report", dir_ / "i.json"};
    words.insert(words.end(), more.begin(), more.end());
    const auto result = RunProgram(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(ReadFile(dir_ / "i.json"));
  };
  ASSERT_EQ(
      RunProgram(
          {"solve", dir_ / "room.obj", "-o", dir_ / "s.enf", "--error", "0.3"})
          .exit_code,
      0);
  EXPECT_FALSE(info({}).contains("estimate")) << "nothing is left to do";
  const auto finer = info({"--error", "0.1"});
  EXPECT_GT(finer.at("estimate").at("links").get<double>(),
            finer.at("links").get<double>());
  EXPECT_EQ(finer.at("requested_error"), 0.3) << "nothing was requested";
  // The links and elements that are there are counted only as those to come.
  const auto estimate = finer.at("estimate");
  const auto is = finer.at("store_bytes").get<double>();
  const double of_links = finer.at("links").get<double>() *
                          finer.at("link_bytes_per_link").get<double>();
  EXPECT_LT(estimate.at("store_bytes").get<double>(),
            is - of_links + 28 * estimate.at("links").get<double>() + 1);
  // The rays that look at the error took most of the time, not the links.
  const auto& stages = finer.at("stage_seconds");
  const double solved_in = finer.at("wall_seconds").get<double>() -
                           stages.at("import").get<double>() -
                           stages.at("partition").get<double>() -
                           stages.at("visibility").get<double>();
  EXPECT_GE(finer.at("estimate").at("solve_seconds").get<double>(),
            solved_in * finer.at("threads").get<double>() /
                std::max(1U, std::thread::hardware_concurrency()));
  EXPECT_EQ(RunProgram({"info", dir_ / "s.enf", "--basis", "haar"}).exit_code,
            2);
}

TEST_F(InfoOfScene, TheLeastCapIsEnough) {
  const auto least = Estimate("0.3", "haar")
                         .at("estimate")
                         .at("least_cap_bytes")
                         .get<uint64_t>();
  const auto result = RunProgram({"solve",
                                  dir_ / "room.obj",
                                  "-o",
                                  dir_ / "s.enf",
                                  "--error",
                                  "0.3",
                                  "--basis",
                                  "haar",
                                  "--memory",
                                  std::to_string(least >> 20) + "M"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

// A gbXML file is held whole while it is read, and a file of short tags takes
// many times its bytes.
TEST_F(InfoOfScene, TheLeastCapHoldsForWhatReadingTakes) {
  const auto surface = [](const char* type, const char* points) {
    std::string text = std::string("<Surface id='") + type + "' surfaceType='" +
                       type +
                       "'><AdjacentSpaceId spaceIdRef='a'/>"
                       "<PlanarGeometry><PolyLoop>";
    for (const char* p = points; *p != 0; p += 3) {
      text += "<CartesianPoint>";
      for (size_t i = 0; i < 3; ++i) {
        text += std::string("<Coordinate>") + p[i] + "</Coordinate>";
      }
      text += "</CartesianPoint>";
    }
    return text + "</PolyLoop></PlanarGeometry></Surface>";
  };
  {
    std::ofstream file(dir_ / "tags.xml");
    file << "<gbXML lengthUnit='Meters'><Campus id='c'><Building id='b'>"
            "<Space id='a'/></Building>"
         << surface("SlabOnGrade", "000400440040")
         << surface("Roof", "003043443403")
         << surface("ExteriorWall", "000003403400") << "</Campus>";
    for (int i = 0; i < 400'000; ++i) {
      file << "<x y='1'>2</x>";
    }
    file << "</gbXML>";
  }
  const auto info = RunProgram({"info",
                                dir_ / "tags.xml",
                                "--default-luminaires",
                                "--error",
                                "0.5",
                                "--report",
                                dir_ / "i.json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const auto least = nlohmann::json::parse(ReadFile(dir_ / "i.json"))
                         .at("estimate")
                         .at("least_cap_bytes")
                         .get<uint64_t>();
  const auto solve = RunProgram({"solve",
                                 dir_ / "tags.xml",
                                 "--default-luminaires",
                                 "-o",
                                 dir_ / "t.enf",
                                 "--error",
                                 "0.5",
                                 "--memory",
                                 std::to_string(least >> 20) + "M",
                                 "--report",
                                 dir_ / "s.json"});
  ASSERT_EQ(solve.exit_code, 0) << solve.err;
  EXPECT_LE(nlohmann::json::parse(ReadFile(dir_ / "s.json"))
                .at("peak_rss_bytes")
                .get<uint64_t>(),
            least);
}

TEST_F(InfoOfScene, TheVisibleSetsAreAuditedWithoutASolve) {
  const auto result = RunProgram({"info",
                                  dir_ / "room.obj",
                                  "--audit",
                                  "10000",
                                  "--report",
                                  dir_ / "r.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find(" missed, "), std::string::npos) << result.out;
  const auto report = nlohmann::json::parse(ReadFile(dir_ / "r.json"));
  EXPECT_GT(report.at("audit_rays"), 0);
  EXPECT_EQ(report.at("audit_missed"), 0);
}

TEST_F(InfoOfScene, FaultsHaveTheirExitCodes) {
  EXPECT_EQ(RunProgram({"info", dir_ / "none.obj"}).exit_code, 3);
  EXPECT_EQ(RunProgram({"info", dir_ / "room.obj", "--error", "2"}).exit_code,
            2);
}

}  // namespace
}  // namespace enfilade
