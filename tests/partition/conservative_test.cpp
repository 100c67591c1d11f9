// Visibility relies on this: a segment that crosses from one cell into another
// without meeting a face does so through a portal between the two.

#include "base/random.h"
#include "partition/partition.h"

#include <cmath>

#include "tests/partition/boundary_check.h"
#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::Built;
using testing::CheckBoundaries;
using testing::SceneBuilder;

double Between(Random& random, double low, double high) {
  return low + (high - low) * random.Next();
}

// A hall with boxes of chair size to room size at random places; some of them
// lie on a coarse grid so that faces coincide.
SceneBuilder SoupOfBoxes(uint64_t seed) {
  Random random(seed);
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {12, 9, 3}});
  for (int i = 0; i < 25; ++i) {
    Point3 low{
        Between(random, 0, 10), Between(random, 0, 7), Between(random, 0, 2)};
    Vec3 size{Between(random, 0.1, 5),
              Between(random, 0.1, 5),
              Between(random, 0.1, 3)};
    if (random.NextBelow(2) == 0) {
      low = {std::round(low.x), std::round(low.y), 0};
      size = {std::ceil(size.x), 0.2, 3};
    }
    scene.AddBox({low, low + size});
  }
  return scene;
}

// Polygons in any direction.
SceneBuilder SoupOfTriangles(uint64_t seed) {
  Random random(seed);
  SceneBuilder scene;
  for (int i = 0; i < 60; ++i) {
    std::vector<Point3> triangle;
    triangle.reserve(3);
    for (int corner = 0; corner < 3; ++corner) {
      triangle.push_back({Between(random, 0, 6),
                          Between(random, 0, 6),
                          Between(random, 0, 3)});
    }
    if (PolygonArea(triangle) > 1e-3) {
      scene.Add(triangle);
    }
  }
  return scene;
}

TEST(Portals, HoldEveryOpenPointBetweenCellsInSoupsOfBoxes) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    const Built built(SoupOfBoxes(seed));
    EXPECT_GT(built.partition.cells.size(), 1U);
    EXPECT_GT(CheckBoundaries(*built.store, 3000, seed), 100U);
  }
}

TEST(SlowPortals, HoldEveryOpenPointBetweenCellsInSoupsOfTriangles) {
  size_t checked = 0;  // most soups are one cell
  for (uint64_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    const Built built(SoupOfTriangles(seed));
    checked += CheckBoundaries(*built.store, 3000, seed);
  }
  EXPECT_GT(checked, 100U);
}

TEST(Portals, HoldEveryOpenPointBetweenCellsThatWereCutForSize) {
  PartitionOptions options;
  options.max_cell_patches = 40;
  const Built built(SoupOfBoxes(7), options);
  EXPECT_GT(CheckBoundaries(*built.store, 5000, 7), 100U);
}

}  // namespace
}  // namespace enfilade
