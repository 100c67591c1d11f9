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

// The shape of a leaf's region, as far as joining leaves into cells needs it.
struct LeafShape {
  std::vector<Point3> corners;  // dropped once the borders are known
  Box3 bounds;
  Point3 center;  // a point inside the leaf
  double volume_m3 = 0;
  double width_m = 0;  // ConvexRegion::LeastWidth
};

// A deque, because a growing vector would take thrice as much memory.
using LeafShapes = std::deque<LeafShape>;

struct BuiltTree {
  BspTree tree;
  LeafShapes leaves;  // indexed by LeafId
  // Indexed by NodeId: the node's plane, clipped to the node's region.
  std::deque<Polygon> sections;
  MemoryCharge charge;  // of all the above
};

LeafShape ShapeOf(const ConvexRegion& region);

// The memory that a built tree takes.
uint64_t BytesOf(const BuiltTree& built);

// Splits `box`, which contains all walls, until no leaf contains a wall.
BuiltTree BuildTree(const Box3& box,
                    Walls walls,
                    ScratchShelf& shelf,
                    MemoryBudget& budget);

}  // namespace enfilade
