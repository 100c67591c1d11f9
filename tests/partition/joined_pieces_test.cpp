// Polygons that touch form one piece.

#include "partition/joined_pieces.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kGapM = 0.01;
constexpr Vec3 kUpwards{0, 0, 1};

// A level rectangle about a point, turned by an angle.
Polygon Plate(double x, double y, double width, double depth, double turn = 0) {
  const Vec3 u{std::cos(turn) * width / 2, std::sin(turn) * width / 2, 0};
  const Vec3 v{-std::sin(turn) * depth / 2, std::cos(turn) * depth / 2, 0};
  const Point3 middle{x, y, 0.7};
  return {middle - u - v, middle + u - v, middle + u + v, middle - u + v};
}

double LargePieces(const std::vector<Polygon>& polygons, double least_m2) {
  return AreaOfLargePieces(polygons, kUpwards, kGapM, least_m2);
}

TEST(JoinedPieces, NothingHasNone) {
  EXPECT_EQ(LargePieces({}, 1), 0);
}

TEST(JoinedPieces, TilesAreOneFloor) {
  std::vector<Polygon> tiles;
  for (int i = 0; i < 10; ++i) {
    for (int k = 0; k < 10; ++k) {
      tiles.push_back(Plate(0.5 * i, 0.5 * k, 0.5, 0.5));
    }
  }
  EXPECT_NEAR(LargePieces(tiles, 24.9), 25, 1e-9);
  EXPECT_EQ(LargePieces(tiles, 25.1), 0);
  // Tiles with joints narrower than the gap form one piece as well.
  for (Polygon& tile : tiles) {
    const Point3 middle = tile[0] + (tile[2] - tile[0]) * 0.5;
    for (Point3& p : tile) {
      p = middle + (p - middle) * (1 - 0.9 * kGapM / 0.5);
    }
  }
  EXPECT_GT(LargePieces(tiles, 20), 20);
}

TEST(JoinedPieces, DesksAreNone) {
  std::vector<Polygon> desks;
  for (int i = 0; i < 10; ++i) {
    desks.push_back(Plate(1.65 * i, 0, 1.6, 0.8));
  }
  EXPECT_EQ(LargePieces(desks, 2), 0);
  // Two desks that touch form one piece.
  desks.push_back(Plate(0, 0.8, 1.6, 0.8));
  EXPECT_NEAR(LargePieces(desks, 2), 2 * 1.6 * 0.8, 1e-9);
}

// The bounding boxes of turned seats overlap where the seats do not.
TEST(JoinedPieces, TurnedSeatsDoNotTouch) {
  std::vector<Polygon> seats;
  for (int i = 0; i < 20; ++i) {
    seats.push_back(Plate(0.62 * i, 0.62 * i, 1, 0.7, -0.785));
  }
  EXPECT_EQ(LargePieces(seats, 1), 0);
  EXPECT_NEAR(LargePieces(seats, 0.5), 20 * 0.7, 1e-9);
}

TEST(JoinedPieces, AChainJoinsItsEnds) {
  std::vector<Polygon> chain;
  for (int i = 0; i < 20; ++i) {
    chain.push_back(Plate(19 - i, i % 2 == 0 ? 0.0 : 0.4, 1.2, 0.5));
  }
  EXPECT_NEAR(LargePieces(chain, 11), 20 * 1.2 * 0.5, 1e-9);
}

}  // namespace
}  // namespace enfilade
