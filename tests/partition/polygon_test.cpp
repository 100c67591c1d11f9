#include "partition/polygon.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(EdgePlane, HasThePolygonInFront) {
  const Polygon triangle = {{0, 0, 1}, {4, 0, 1}, {0, 3, 1}};
  const Vec3 up{0, 0, 1};
  for (size_t i = 0; i < triangle.size(); ++i) {
    const Point3 from = triangle[i];
    const Point3 to = triangle[(i + 1) % triangle.size()];
    const Plane plane = EdgePlane(from, to, up);
    EXPECT_NEAR(Length(plane.normal), 1, 1e-15);
    EXPECT_NEAR(plane.Distance(from), 0, 1e-15);
    EXPECT_NEAR(plane.Distance(to), 0, 1e-15);
    EXPECT_GT(plane.Distance(VertexMean(triangle)), 0);
  }
}

}  // namespace
}  // namespace enfilade
