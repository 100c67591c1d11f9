// Builds the tree of splitting planes from the walls of the scene.

#pragma once

#include "base/memory.h"
#include "partition/bsp_tree.h"
#include "partition/convex_region.h"
#include "partition/walls.h"

#include <cstdint>
#include <deque>
#include <vector>

namespace enfilade {

// A leaf's region, as far as it is needed to join leaves into cells.
struct LeafShape {
  std::vector<Point3> corners;  // until the borders are known
  Box3 bounds;
  Point3 center;  // inside
  double volume_m3 = 0;
  double width_m = 0;  // ConvexRegion::LeastWidth
};

// In deques: a vector would take thrice as much while it grows.
using LeafShapes = std::deque<LeafShape>;

struct BuiltTree {
  BspTree tree;
  LeafShapes leaves;             // indexed by LeafId
  std::deque<Polygon> sections;  // indexed by NodeId: plane within its region
  MemoryCharge charge;           // of these
};

LeafShape ShapeOf(const ConvexRegion& region);

// What a built tree takes in memory.
uint64_t BytesOf(const BuiltTree& built);

// Splits `box`, which holds all walls, until no leaf holds a wall.
BuiltTree BuildTree(const Box3& box,
                    Walls walls,
                    ScratchShelf& shelf,
                    MemoryBudget& budget);

}  // namespace enfilade
