#include "tools/probe_points.h"

#include "base/error.h"

#include <cmath>
#include <sstream>
#include <string>

#include "tests/tools/verify_fake_building.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// The deviation of the light of the room below, gathered with the rays that are
// the default, W/m2.
constexpr double kGatherNoise = 0.004;

// A room of reflectance 1/2 and exitance 1, whose radiosity is 2 everywhere;
// the stored irradiance is 7, to tell it from what gathering gives.
class ProbeTest : public ::testing::Test {
 protected:
  ProbeTest() {
    building_.AddRoom({4, 3, 2},
                      building_.AddMaterial({.5, .5, .5}, {1, 1, 1}));
    building_.SetRadiosity([](const Patch&, Point3) { return Rgb{2, 2, 2}; });
    building_.SetIrradiance([](const Patch&, Point3) { return Rgb{7, 8, 9}; });
  }

  std::string Run(const std::string& csv) {
    std::ostringstream out;
    RunInto(out, csv);
    return out.str();
  }

  void RunInto(std::ostream& out, const std::string& csv) {
    std::istringstream in(csv);
    MemoryBudget budget(64ULL << 20);
    summary_ =
        ProbePoints(building_.View(), in, "points.csv", out, options_, budget);
    EXPECT_EQ(budget.UsedBytes(), 0U);
  }

  // The message of the InputError that the text gives, before any output.
  std::string Refusal(const std::string& csv) {
    std::ostringstream out;
    try {
      RunInto(out, csv);
    } catch (const InputError& e) {
      EXPECT_EQ(out.str(), "");
      return e.what();
    }
    return "accepted";
  }

  // A plate above the floor, of an irradiance of 3.
  void AddPlate(double height_m = .002) {
    building_.Add({1, 1, height_m},
                  {1, 0, 0},
                  {0, 1, 0},
                  building_.AddMaterial({.5, .5, .5}, {}));
    building_.SetIrradiance([](const Patch& patch, Point3) {
      return patch.origin.z > 0 ? Rgb{3, 3, 3} : Rgb{7, 8, 9};
    });
  }

  // The last line's last three columns.
  Rgb LastValue(const std::string& csv) {
    const std::string out = Run(csv);
    std::istringstream last(out.substr(out.rfind('\n', out.size() - 2) + 1));
    std::string field;
    std::vector<double> values;
    while (std::getline(last, field, ',')) {
      values.push_back(std::stod(field));
    }
    const size_t n = values.size();
    return {values.at(n - 3), values.at(n - 2), values.at(n - 1)};
  }

  FakeBuilding building_;
  ProbeOptions options_;
  ProbeSummary summary_;
};

TEST_F(ProbeTest, APointOnAPatchHasItsStoredIrradiance) {
  EXPECT_EQ(Run("1,1,0,0,0,1\n"),
            "x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b\n"
            "1,1,0,0,0,1,7,8,9\n");
  EXPECT_EQ(summary_.on_patches, 1U);
}

TEST_F(ProbeTest, ALineIsAsLongAsAPointMayBeAndNoLonger) {
  const std::string point = "1,1,0,0,0,1";
  EXPECT_NE(Run(point + std::string(60'000, ' ') + "\n" + point).find("7,8,9"),
            std::string::npos);
  EXPECT_EQ(summary_.points, 2U);
  EXPECT_NE(Refusal(point + "\n" + std::string(200'000, '1'))
                .find("points.csv:2: a line of more than 64 KiB"),
            std::string::npos);
}

TEST_F(ProbeTest, OneMillimetreAndFiveDegreesDecideWhatIsOnAPatch) {
  for (const char* on : {"1,1,.0009,0,0,1",
                         "1,1,-.0009,0,0,3",
                         "1,1,0,0,.087,1" /* 4.97 degrees */}) {
    EXPECT_EQ(LastValue(on), (Rgb{7, 8, 9})) << on;
  }
  for (const char* off : {"1,1,.0012,0,0,1", "1,1,.0001,0,.088,1"}) {
    EXPECT_NE(LastValue(off), (Rgb{7, 8, 9})) << off;
  }
}

// A rug in the plane of the floor, in front of which import has put it.
TEST_F(ProbeTest, OfSurfacesInOnePlaceTheRaisedOneIsProbed) {
  building_.Add(
      {1, 1, 0}, {1, 0, 0}, {0, 1, 0}, building_.AddMaterial({.5, .5, .5}, {}));
  building_.Raise(kMostLayers);
  building_.SetIrradiance([](const Patch& patch, Point3) {
    return patch.layer > 0 ? Rgb{3, 3, 3} : Rgb{7, 8, 9};
  });
  EXPECT_EQ(LastValue("1.5,1.5,0,0,0,1"), (Rgb{3, 3, 3}));
  EXPECT_EQ(LastValue("1.5,1.5,.0009,0,0,1"), (Rgb{3, 3, 3}));
  EXPECT_EQ(LastValue("2.5,1.5,0,0,0,1"), (Rgb{7, 8, 9}));
}

// What really lies so high above a point is in the way, and not its surface.
TEST_F(ProbeTest, ASurfaceALittleAboveIsNotThatOfThePoint) {
  AddPlate();
  EXPECT_EQ(LastValue("1.5,1.5,0,0,0,1"), (Rgb{7, 8, 9}));
  EXPECT_EQ(LastValue("1.5,1.5,.002,0,0,1"), (Rgb{3, 3, 3}));
}

TEST_F(ProbeTest, OfSurfacesThatAreCloseThatOfThePointIsProbed) {
  AddPlate(.0005);
  EXPECT_EQ(LastValue("1.5,1.5,0,0,0,1"), (Rgb{7, 8, 9}));
  EXPECT_EQ(LastValue("1.5,1.5,.0005,0,0,1"), (Rgb{3, 3, 3}));
  // On neither: on the outer one.
  EXPECT_EQ(LastValue("1.5,1.5,.0003,0,0,1"), (Rgb{3, 3, 3}));
}

// Where import has moved walls to close cracks, a point on a wall of the file
// is off the wall that was solved, perhaps behind it. One that lies on a
// surface is not given another that is as near.
TEST_F(ProbeTest, WhatImportHasMovedIsFoundWhereTheFileHasIt) {
  building_.SetGreatestMove(.003);
  AddPlate();
  for (const char* on : {"3,1,.0039,0,0,1", "3,1,-.0039,0,0,1"}) {
    EXPECT_EQ(LastValue(on), (Rgb{7, 8, 9})) << on;
  }
  for (const char* off : {"3,1,.0042,0,0,1", "3,1,-.0042,0,0,1"}) {
    EXPECT_NE(LastValue(off), (Rgb{7, 8, 9})) << off;
  }
  EXPECT_EQ(LastValue("1.5,1.5,0,0,0,1"), (Rgb{7, 8, 9}));
  EXPECT_EQ(LastValue("1.5,1.5,-.0015,0,0,1"), (Rgb{7, 8, 9}));
  building_.SetGreatestMove(0);
  EXPECT_NE(LastValue("3,1,.0039,0,0,1"), (Rgb{7, 8, 9}));
}

TEST_F(ProbeTest, AFreePointGathersTheRoom) {
  for (const char* free : {"1,1,1,0,0,1", "2,2,.5,1,-2,.3", "1,1,.01,0,0,1"}) {
    const Rgb value = LastValue(free);
    EXPECT_NEAR(value[0], 2, 5 * kGatherNoise) << free;
    EXPECT_NEAR(value[2], 2, 5 * kGatherNoise) << free;
  }
  EXPECT_EQ(summary_.gathered, 1U);
}

// The deviation that kGatherNoise states, by many points, whose mean is right.
// That of n draws is itself known to 1 / sqrt(2 n) of itself.
TEST_F(ProbeTest, FreePointsScatterAboutTheLightOfTheRoom) {
  constexpr int kPoints = 64;
  std::string csv;
  for (int i = 0; i < kPoints; ++i) {
    csv += std::to_string(.2 + 3.6 * i / kPoints) + "," +
           std::to_string(.2 + 2.6 * (i * 19 % kPoints) / kPoints) + "," +
           std::to_string(.2 + 1.6 * (i * 41 % kPoints) / kPoints) + ",0,0,1\n";
  }
  std::istringstream out(Run(csv));
  std::string line;
  std::getline(out, line);  // the header
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < kPoints; ++i) {
    ASSERT_TRUE(std::getline(out, line));
    const double value = std::stod(line.substr(line.rfind(',') + 1));
    sum += value / kPoints;
    squares += value * value / kPoints;
  }
  EXPECT_EQ(summary_.gathered, size_t{kPoints});
  const double deviation = std::sqrt(squares - sum * sum);
  EXPECT_NEAR(sum, 2, 5 * deviation / std::sqrt(kPoints));
  EXPECT_NEAR(
      deviation, kGatherNoise, 5 * kGatherNoise / std::sqrt(2 * kPoints));
}

TEST_F(ProbeTest, HeaderAndFurtherColumnsAreKept) {
  EXPECT_EQ(Run("x,y,z,nx,ny,nz,desk\n1,1,0,0,0,1,A 7\n"),
            "x,y,z,nx,ny,nz,desk,irradiance_r,irradiance_g,irradiance_b\n"
            "1,1,0,0,0,1,A 7,7,8,9\n");
  EXPECT_EQ(Run("1,1,0,0,0,1,5\n").substr(0, 24), "x,y,z,nx,ny,nz,column_7,");
}

TEST_F(ProbeTest, CommentsEmptyLinesAndWindowsEndsAreUnderstood) {
  EXPECT_EQ(Run("\xef\xbb\xbf# c\r\n\r\n 1, 1,0 ,+0,0,1\r\n\n#x\n"),
            "x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b\n"
            "1, 1,0 ,+0,0,1,7,8,9\n");
}

TEST_F(ProbeTest, NoPointsGiveOnlyAHeader) {
  EXPECT_EQ(Run(""), "x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b\n");
}

TEST_F(ProbeTest, BadLinesAreNamed) {
  EXPECT_NE(Refusal("1,1,0,0,0,1\n1,2,3\n").find("points.csv:2: "),
            std::string::npos);
  EXPECT_NE(Refusal("1e19,1,1,0,0,1").find("points.csv:1: the point (1e+19"),
            std::string::npos);
  EXPECT_NE(Refusal("x,y,z,nx,ny,nz\n\n1,1,0,0,nan,1")
                .find("points.csv:3: ny is 'nan'"),
            std::string::npos);
  EXPECT_NE(Refusal("1,1,0,0,0,0").find("has no direction"), std::string::npos);
  EXPECT_NE(Refusal("1,1,1e999,0,0,1").find("points.csv:1: z"),
            std::string::npos);
  EXPECT_NE(Refusal("1,1,2m,0,0,1").find("'2m'"), std::string::npos);
}

// The results are the last columns, under the names that the first line gives.
TEST_F(ProbeTest, EveryLineHasAsManyColumns) {
  const std::string header = "x,y,z,nx,ny,nz,desk\n";
  EXPECT_NE(Refusal(header + "1,1,0,0,0,1,A\n1,1,0,0,0,1\n")
                .find("points.csv:3: this line has 6 columns"),
            std::string::npos);
  EXPECT_NE(Refusal("1,1,0,0,0,1\n1,1,0,0,0,1,A\n").find("points.csv:2: "),
            std::string::npos);
  for (const char* name : {"\"A, B\"", "\"A \"\"B, C\"\"\"", "a 24\" panel"}) {
    EXPECT_NE(Run(header + "1,1,0,0,0,1," + name + "\n")
                  .find(std::string(name) + ",7,8,9\n"),
              std::string::npos)
        << name;
  }
}

// Columns are read by their place: columns under these headers would be read as
// others, or not at all.
TEST_F(ProbeTest, HeadersThatDoNotFitAreRefused) {
  for (const char* header :
       {"nx,ny,nz,x,y,z", "1;1;1;0;0;1", "1 1 1 0 0 1", "a,b,c"}) {
    const std::string error = Refusal(std::string(header) + "\n");
    EXPECT_NE(error.find("points.csv:1"), std::string::npos) << error;
  }
}

// Batches are large because every batch may read the whole building again.
TEST_F(ProbeTest, ABatchOfRaysTakesHalfOfTheBudgetAtLeast) {
  constexpr uint64_t kHeldBytes = 8ULL << 20;
  constexpr size_t kPathBytes = 768;
  options_.gather_rays = 1024;
  std::string csv;
  for (int i = 0; i < 20; ++i) {
    csv += "1," + std::to_string(1 + i / 20.0) + ",1,0,0,1\n";
  }
  size_t traces = 0;
  BuildingView view = building_.View();
  view.trace = [&](std::span<const TraceRay> rays, std::span<TraceHit> hits) {
    ++traces;
    building_.View().trace(rays, hits);
  };
  std::istringstream in(csv);
  std::ostringstream out;
  MemoryBudget budget(kHeldBytes);
  ProbePoints(view, in, "points.csv", out, options_, budget);
  constexpr size_t kBatchPaths = kHeldBytes / 2 / kPathBytes;
  const size_t batches = (20 * 1024 + kBatchPaths - 1) / kBatchPaths;
  EXPECT_LE(traces, 4 + batches);  // four find what points lie on
  EXPECT_EQ(out.str(), Run(csv));
}

TEST_F(ProbeTest, ManyPointsKeepTheirOrder) {
  std::string csv;
  for (int i = 0; i < 2500; ++i) {
    csv +=
        std::to_string(i % 3 + .5) + ",1,0,0,0,1," + std::to_string(i) + "\n";
  }
  std::istringstream out(Run(csv));
  std::string line;
  std::getline(out, line);
  for (int i = 0; i < 2500; ++i) {
    ASSERT_TRUE(std::getline(out, line));
    ASSERT_NE(line.find(",1," + std::to_string(i) + ",7,8,9"),
              std::string::npos)
        << line;
  }
  EXPECT_EQ(summary_.points, 2500U);
}

}  // namespace
}  // namespace enfilade
