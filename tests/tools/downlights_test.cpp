// A ceiling full of downlights, in whose tubes light is hundreds of times the
// mean: the number of links follows that of the downlights, and no light is
// lost.

#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

constexpr uint32_t kCount = 30;

// What the surfaces absorb, over what the lamps emit: scenes/downlights.md.
double AbsorbedShare(const std::string& csv_path) {
  const std::map<std::string, double> reflectance = {{"floor", 0.3},
                                                     {"ceiling", 0.8},
                                                     {"wall", 0.6},
                                                     {"table", 0.4},
                                                     {"tube", 0.8},
                                                     {"lamp", 0}};
  std::ifstream in(csv_path);
  std::string line;
  std::map<std::string, size_t> column;
  const auto fields_of = [&] {
    std::vector<std::string> fields;
    std::istringstream row(line);
    for (std::string field; std::getline(row, field, ',');) {
      fields.push_back(field);
    }
    return fields;
  };
  std::getline(in, line);
  for (const std::string& name : fields_of()) {
    column.emplace(name, column.size());
  }
  double absorbed = 0;
  double emitted = 0;
  while (std::getline(in, line)) {
    const std::vector<std::string> row = fields_of();
    const double area = std::stod(row.at(column.at("area_m2")));
    absorbed += (1 - reflectance.at(row.at(column.at("material")))) * area *
                std::stod(row.at(column.at("irradiance_r")));
    emitted += row.at(column.at("emits")) == "1" ? area * 3000 : 0;
  }
  return absorbed / emitted;
}

// With 64 parts for the ceiling whatever the number of lamps, a solve with
// thirty lamps takes 6.2 million links for an error of 0.68 and is not done.
TEST(Downlights, AreSolvedWithoutMillionsOfLinks) {
  const TemporaryFolder folder;
  const std::string scene = folder / "downlights.obj";
  const std::string store = folder / "downlights.enf";
  const std::string report = folder / "solve.json";
  const std::string csv = folder / "patches.csv";
  ASSERT_EQ(
      RunProgram(
          {"scene", "downlights", "--count", fmt::format("{}", kCount), scene})
          .exit_code,
      0);
  const ProgramResult solve = RunProgram(
      {"solve", scene, "-o", store, "--error", "0.2", "--report", report});
  ASSERT_EQ(solve.exit_code, 0) << solve.err;
  EXPECT_LT(json::parse(ReadFile(report)).at("links").get<uint64_t>(),
            kCount * 40'000);
  ASSERT_EQ(RunProgram({"export", store, csv}).exit_code, 0);
  // Means are up to 1.4 % off where 0.1 is asked (README, known limits); the
  // tolerance is twice that.
  EXPECT_NEAR(AbsorbedShare(csv), 1, 0.03);
}

}  // namespace
}  // namespace enfilade
