#include "scene/rounded_walls.h"

#include "base/planar_polygon.h"
#include "scene/rounding_survey.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "tests/scene/temp_scene.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kExactM = 1e-9;

using Model = std::vector<std::vector<Point3>>;
using Mapping = std::function<Point3(Point3)>;

// A row of rooms with walls between them.
Model Rooms(int count) {
  Model model;
  const auto box = [&](Point3 a, Point3 b) {
    const auto p = [&](int x, int y, int z) {
      return Point3{x == 0 ? a.x : b.x, y == 0 ? a.y : b.y, z == 0 ? a.z : b.z};
    };
    model.push_back({p(0, 0, 0), p(1, 0, 0), p(1, 1, 0), p(0, 1, 0)});
    model.push_back({p(0, 0, 1), p(0, 1, 1), p(1, 1, 1), p(1, 0, 1)});
    model.push_back({p(0, 0, 0), p(0, 0, 1), p(1, 0, 1), p(1, 0, 0)});
    model.push_back({p(0, 1, 0), p(1, 1, 0), p(1, 1, 1), p(0, 1, 1)});
    model.push_back({p(0, 0, 0), p(0, 1, 0), p(0, 1, 1), p(0, 0, 1)});
    model.push_back({p(1, 0, 0), p(1, 0, 1), p(1, 1, 1), p(1, 1, 0)});
  };
  for (int i = 0; i < count; ++i) {
    box({5.3 * i, 0, 0}, {5.3 * i + 4.17 + 0.137 * i, 5.21 + 0.311 * i, 2.83});
  }
  return model;
}

// About the third axis from x, y and z.
Mapping Turned(double degrees, size_t axis) {
  const double c = std::cos(degrees * std::numbers::pi / 180);
  const double s = std::sin(degrees * std::numbers::pi / 180);
  return [=](Point3 p) {
    std::array<double, 3> to{};
    const size_t u = (axis + 1) % 3;
    const size_t v = (axis + 2) % 3;
    to[axis] = p[axis];
    to[u] = c * p[u] - s * p[v];
    to[v] = s * p[u] + c * p[v];
    return Point3{to[0], to[1], to[2]};
  };
}

Point3 Rounded(Point3 p, double step) {
  const auto round = [step](double v) { return std::round(v / step) * step; };
  return {round(p.x), round(p.y), round(p.z)};
}

Model Mapped(const Model& model, const Mapping& map) {
  Model mapped = model;
  for (auto& polygon : mapped) {
    std::transform(polygon.begin(), polygon.end(), polygon.begin(), map);
  }
  return mapped;
}

Mapping RoundedTo(double step) {
  return [step](Point3 p) { return Rounded(p, step); };
}

// The budget outlives what was surveyed.
std::optional<RoundedWalls> Survey(const Model& model, double unit = 1) {
  static MemoryBudget budget(1 << 24);
  RoundingSurvey survey(unit, budget);
  for (const auto& polygon : model) {
    for (const Point3 p : polygon) {
      survey.See(Point3{p.x / unit, p.y / unit, p.z / unit});
    }
    survey.Add(polygon);
  }
  return survey.Finish();
}

double Height(const std::vector<Point3>& polygon) {
  const Vec3 normal = Normalize(AreaVector(polygon));
  const AxisRange range = RangeAlong(polygon, normal);
  return range.high - range.low;
}

// By how much a quadrilateral is no parallelogram, m.
double Gap(const std::vector<Point3>& p) {
  return Length((p[1] - p[0]) - (p[2] - p[3]));
}

class RoundedWallsTest
    : public ::testing::TestWithParam<std::tuple<double, size_t, double>> {};

TEST_P(RoundedWallsTest, WallsArePlaneAndSquareAgain) {
  const auto [degrees, axis, step] = GetParam();
  const Model exact = Mapped(Rooms(6), Turned(degrees, axis));
  const Model rounded = Mapped(exact, RoundedTo(step));
  const auto walls = Survey(rounded);
  ASSERT_TRUE(walls);
  EXPECT_NEAR(walls->StepM(), step, 1e-9);
  double most_move = 0;
  for (size_t i = 0; i < rounded.size(); ++i) {
    std::vector<Point3> restored;
    for (size_t k = 0; k < rounded[i].size(); ++k) {
      restored.push_back(walls->Restored(rounded[i][k]));
      most_move = std::max(most_move, Length(restored.back() - rounded[i][k]));
      // Half a step along each axis, and the error of the planes.
      EXPECT_LE(Length(restored.back() - exact[i][k]), 1.5 * step);
    }
    EXPECT_LE(Height(restored), kExactM);
    EXPECT_LE(Gap(restored), kExactM) << i;
  }
  EXPECT_GT(most_move, 0.2 * step) << "there was nothing to restore";
}

INSTANTIATE_TEST_SUITE_P(
    Turns,
    RoundedWallsTest,
    ::testing::Combine(::testing::Values(7.0, 30.0, 44.0, 63.5, 141.3),
                       ::testing::Values(size_t{1}, size_t{2}),
                       ::testing::Values(1e-4, 1e-3)));

// Nothing is along an axis, as on a ship or in a roof.
TEST(RoundedWalls, RestoreAModelThatIsTurnedEveryWay) {
  constexpr double kStep = 1e-3;
  const Model exact = Mapped(Mapped(Rooms(6), Turned(30, 2)), Turned(20, 0));
  const Model rounded = Mapped(exact, RoundedTo(kStep));
  const auto walls = Survey(rounded);
  ASSERT_TRUE(walls);
  for (size_t i = 0; i < rounded.size(); ++i) {
    std::vector<Point3> restored;
    for (size_t k = 0; k < rounded[i].size(); ++k) {
      restored.push_back(walls->Restored(rounded[i][k]));
      EXPECT_LE(Length(restored.back() - exact[i][k]), 2 * kStep);
    }
    EXPECT_LE(Height(restored), kExactM);
    EXPECT_LE(Gap(restored), kExactM) << i;
  }
}

TEST(RoundedWalls, LeaveWallsAlongTheAxesAlone) {
  EXPECT_FALSE(Survey(Rooms(3)));
}

TEST(RoundedWalls, LeaveFineCoordinatesAlone) {
  const Model turned = Mapped(Rooms(3), Turned(30, 2));
  EXPECT_FALSE(Survey(turned));
  EXPECT_FALSE(Survey(Mapped(turned, RoundedTo(1e-6))));
  EXPECT_FALSE(Survey(Mapped(turned, RoundedTo(0.1)))) << "too coarse";
}

TEST(RoundedWalls, GoByTheUnitOfTheFile) {
  const Model turned = Mapped(Rooms(3), Turned(30, 2));
  const auto walls = Survey(Mapped(turned, RoundedTo(1e-3)), 1e-3);
  ASSERT_TRUE(walls);
  EXPECT_NEAR(walls->StepM(), 1e-3, 1e-12);
}

// What stands before a wall, as a picture, is not rounding, and stays parallel
// to the wall.
TEST(RoundedWalls, LeaveWhatStandsBeforeAWall) {
  constexpr double kStep = 1e-3;
  for (const double steps : {1.5, 2.0, 3.0}) {
    for (const double degrees : {20.0, 30.0, 44.0}) {
      Model model = Rooms(2);
      const double y = steps * kStep;
      model.push_back({{1, y, 1}, {1, y, 2}, {2, y, 2}, {2, y, 1}});
      const Mapping turn = Turned(degrees, 2);
      const Vec3 inwards = turn({0, 1, 0}) - Point3{};
      const Model rounded = Mapped(Mapped(model, turn), RoundedTo(kStep));
      const auto walls = Survey(rounded);
      ASSERT_TRUE(walls);
      std::vector<Point3> picture;
      for (const Point3 p : rounded.back()) {
        picture.push_back(walls->Restored(p));
        EXPECT_NEAR(
            Dot(picture.back() - Point3{}, inwards), y, 0.71 * kStep + 1e-9);
      }
      EXPECT_LE(Height(picture), kExactM);
      EXPECT_NEAR(
          std::abs(Dot(Normalize(AreaVector(picture)), inwards)), 1, 1e-7);
    }
  }
}

// Restored walls are joined and cut as if they had never been rounded.
TEST(RoundedWalls, ImportRestoresThem) {
  const Model exact = Mapped(Rooms(4), Turned(30, 2));
  const auto write = [](const Model& model, int decimals) {
    std::string text = "mtllib m.mtl\nusemtl lamp\n";
    for (const auto& polygon : model) {
      for (const Point3 p : polygon) {
        text += fmt::format("v {:.{}f} {:.{}f} {:.{}f}\n",
                            p.x,
                            decimals,
                            p.y,
                            decimals,
                            p.z,
                            decimals);
      }
      text += "f -4 -3 -2 -1\n";
    }
    return text;
  };
  const TempScene scene;
  scene.Write("m.mtl", "newmtl lamp\nKd .5 .5 .5\nKe 1 1 1\n");
  const Imported fine = ImportFile(scene.Write("fine.obj", write(exact, 9)));
  const Imported coarse =
      ImportFile(scene.Write("coarse.obj", write(exact, 3)));
  EXPECT_EQ(fine.info.coordinate_step_m, 0);
  EXPECT_NEAR(coarse.info.coordinate_step_m, 1e-3, 1e-12);
  EXPECT_GT(coarse.info.greatest_move_m, 0);
  EXPECT_LE(coarse.info.greatest_move_m, 3e-3);
  ASSERT_EQ(coarse.faces.size(), fine.faces.size());
  for (size_t i = 0; i < fine.faces.size(); ++i) {
    EXPECT_EQ(coarse.faces[i].vertices.size(), fine.faces[i].vertices.size());
    EXPECT_LE(Gap(coarse.faces[i].vertices), kExactM);
  }
  const auto& notes = coarse.info.notes;
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const auto& note) {
    return note.find("rounded to 1 mm") != std::string::npos;
  }));
}

// A piece is placed in full precision; only the file's own walls are moved.
TEST(RoundedWalls, LeaveInstancesAlone) {
  const Mapping turn = Turned(30, 2);
  std::string text = "mtllib m.mtl\nusemtl lamp\n";
  for (const auto& polygon : Mapped(Rooms(4), turn)) {
    for (const Point3 p : polygon) {
      text += fmt::format("v {:.3f} {:.3f} {:.3f}\n", p.x, p.y, p.z);
    }
    text += "f -4 -3 -2 -1\n";
  }
  const TempScene scene;
  scene.Write("m.mtl", "newmtl lamp\nKd .5 .5 .5\nKe 1 1 1\n");
  scene.Write("piece.obj",
              "v 0 0 0\nv 0.0004 1 0\nv 0.0004 1 1\nv 0 0 1\nf 1 2 3 4\n");
  const Imported alone = ImportFile(scene.Write("alone.obj", text));
  const Imported with = ImportFile(
      scene.Write("with.obj", text + "o p\n#instance piece.obj 0 0 0 30\n"));
  ASSERT_EQ(with.faces.size(), alone.faces.size() + 1);
  const std::vector<Point3>& piece = with.faces.back().vertices;
  const std::vector<Point3> as_written = {
      {0, 0, 0}, turn({0.0004, 1, 0}), turn({0.0004, 1, 1}), {0, 0, 1}};
  for (const Point3 p : as_written) {
    EXPECT_TRUE(std::any_of(piece.begin(), piece.end(), [&](Point3 q) {
      return Length(q - p) < kExactM;
    }));
  }
}

// Once it shows that coordinates are fine, the first look at a file ends; what
// comes later is still read, and its faults are told.
TEST(RoundedWalls, AFileOfFineCoordinatesIsReadToItsEnd) {
  constexpr int kQuads = 4000;  // more coordinates than the first look takes
  std::string text = "mtllib m.mtl\nusemtl lamp\n";
  for (int i = 0; i < kQuads; ++i) {
    for (const Point3 p : {Point3{0, 0, 0},
                           Point3{0.01, 0, 0},
                           Point3{0.01, 0.01, 0},
                           Point3{0, 0.01, 0}}) {
      text += fmt::format("v {:.7f} {:.7f} {:.7f}\n",
                          p.x + 0.0234567 * (i % 100),
                          p.y + 0.0345678 * (i / 100),
                          p.z + 0.1234567);
    }
    text += "f -4 -3 -2 -1\n";
  }
  const TempScene scene;
  scene.Write("m.mtl", "newmtl lamp\nKd .5 .5 .5\nKe 1 1 1\n");
  EXPECT_EQ(ImportFile(scene.Write("fine.obj", text)).faces.size(),
            static_cast<size_t>(kQuads));
  EXPECT_NE(ImportError(scene.Write("faulty.obj", text + "f 1 2 x\n"))
                .find(fmt::format("faulty.obj:{}:", 2 + 5 * kQuads + 1)),
            std::string::npos);
}

TEST(RoundedWalls, AFileWithoutPolygonsIsRefusedOnce) {
  const TempScene scene;
  EXPECT_NE(ImportError(scene.Write("empty.obj", "")).find("no polygon"),
            std::string::npos);
}

}  // namespace
}  // namespace enfilade
