// What is open of a shell without some of its polygons, beside the same of a
// shell that is made anew.

#include "scene/shell_trial.h"

#include "base/random.h"
#include "scene/space_shell.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kTrialTolerance = 0.01;

using Polygon = std::vector<Point3>;

Polygon Wall(Point3 from, Point3 to, double height) {
  const Vec3 up = {0, 0, height};
  return {from, to, to + up, from + up};
}

// The floor and the ceiling of a square room.
std::vector<Polygon> Slabs() {
  return {{{0, 0, 0}, {6, 0, 0}, {6, 6, 0}, {0, 6, 0}},
          {{0, 0, 3}, {6, 0, 3}, {6, 6, 3}, {0, 6, 3}}};
}

// Its sides in strips, with walls in it that touch each other and the sides.
std::vector<Polygon> Walls() {
  std::vector<Polygon> walls;
  for (int i = 0; i < 6; ++i) {
    const double a = i;
    const double b = i + 1;
    walls.push_back(Wall({a, 0, 0}, {b, 0, 0}, 3));
    walls.push_back(Wall({a, 6, 0}, {b, 6, 0}, 3));
    walls.push_back(Wall({0, a, 0}, {0, b, 0}, 3));
    walls.push_back(Wall({6, a, 0}, {6, b, 0}, 3));
    walls.push_back(Wall({a, a, 0}, {b, a, 0}, 2 + 0.3 * a));
    walls.push_back(Wall({a, a, 0}, {a, b, 0}, 3));
  }
  return walls;
}

double Whole(const std::vector<Polygon>& stays,
             const std::vector<Polygon>& walls,
             const std::vector<bool>& out) {
  SpaceShell shell;
  for (const Polygon& p : stays) {
    shell.Add(p);
  }
  for (size_t i = 0; i < walls.size(); ++i) {
    if (!out[i]) {
      shell.Add(walls[i]);
    }
  }
  return shell.OpenLength(kTrialTolerance);
}

void ExpectSameAsWhole(const std::vector<Polygon>& walls) {
  SpaceShell bare;
  for (const Polygon& p : Slabs()) {
    bare.Add(p);
  }
  ShellTrial trial(kTrialTolerance);
  trial.AddEdges(bare.Edges());
  for (const Polygon& p : walls) {
    trial.AddPolygon(p);
  }
  trial.Begin();
  std::vector<bool> out(walls.size());
  Random random(7);
  for (size_t left = walls.size(); left > 0; --left) {
    EXPECT_EQ(trial.OpenLength(), Whole(Slabs(), walls, out));
    for (uint32_t i = 0; i < walls.size(); ++i) {
      if (out[i]) {
        continue;
      }
      out[i] = true;
      const double without = Whole(Slabs(), walls, out);
      EXPECT_EQ(trial.OpenLengthWithout(i), without) << i;
      EXPECT_NEAR(trial.OpenLength() + trial.ChangeWithout(i), without, 1e-9);
      out[i] = false;
    }
    const auto count = static_cast<uint32_t>(walls.size());
    uint32_t next = random.NextBelow(count);
    while (out[next]) {
      next = (next + 1) % count;
    }
    trial.LeaveOut(next);
    out[next] = true;
  }
  EXPECT_EQ(trial.OpenLength(), bare.OpenLength(kTrialTolerance));
}

TEST(ShellTrial, WhatIsOpenHasTheBitsOfAWholeSum) {
  ExpectSameAsWhole(Walls());
}

TEST(ShellTrial, ManyWallsInOnePlaceAreLookedAtOneByOne) {
  ExpectSameAsWhole(std::vector<Polygon>(25, Walls()[4]));
}

}  // namespace
}  // namespace enfilade
