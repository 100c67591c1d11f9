// Bulbs of many facets are solved to the requested error with a few links per
// element.

#include <cstdint>
#include <ostream>
#include <string>

#include "tests/tools/run_program.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

struct BulbCase {
  std::string basis;
  double error = 0;
  // Half of the links that a solve patch by patch takes:
  // docs/decisions/source-groups.md.
  uint64_t most_links = 0;

  // Names the test by its basis.
  friend void PrintTo(const BulbCase& c, std::ostream* out) { *out << c.basis; }
};

class Bulbs : public ::testing::TestWithParam<BulbCase> {};

TEST_P(Bulbs, AreSolvedAsAsked) {
  const TemporaryFolder folder;
  const std::string scene = folder / "bulbs.obj";
  const std::string store = folder / "bulbs.enf";
  const std::string report = folder / "solve.json";
  const std::string verified = folder / "verify.json";
  ASSERT_EQ(RunProgram({"scene", "bulbs", scene}).exit_code, 0);
  const ProgramResult solve = RunProgram({"solve",
                                          scene,
                                          "-o",
                                          store,
                                          "--error",
                                          fmt::format("{}", GetParam().error),
                                          "--basis",
                                          GetParam().basis,
                                          "--report",
                                          report});
  ASSERT_EQ(solve.exit_code, 0) << solve.err;
  EXPECT_LT(json::parse(ReadFile(report)).at("links").get<uint64_t>(),
            GetParam().most_links);
  const ProgramResult verify =
      RunProgram({"verify", store, "--seconds", "20", "--report", verified});
  ASSERT_EQ(verify.exit_code, 0) << verify.err;
  const json errors = json::parse(ReadFile(verified));
  EXPECT_LE(errors.at("error").get<double>(), GetParam().error);
}

INSTANTIATE_TEST_SUITE_P(Bases,
                         Bulbs,
                         ::testing::Values(BulbCase{"haar", 0.1, 113'000},
                                           BulbCase{"m2", 0.05, 40'000}));

}  // namespace
}  // namespace enfilade
