#include "scene/vertex_loop.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(VertexLoop, PointsAreInTheOrderOfTheLoop) {
  const std::vector<Point3> vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  const std::vector<Point3> points = {vertices[2], vertices[0], vertices[2]};
  EXPECT_EQ(PointsOf(vertices, {2, 0, 2}), points);
}

}  // namespace
}  // namespace enfilade
