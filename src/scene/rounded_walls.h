// Puts vertices back into the planes of walls. Exporters write coordinates with
// a few decimals: of walls that stand obliquely, rounding leaves the vertices
// beside the planes. Neighbours are then no longer coplanar, rectangles are no
// parallelograms, and walls that should close off a cell miss its plane.

#pragma once

#include "base/memory.h"
#include "base/plane.h"
#include "scene/box_tree.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// The planes of a model's walls. Immutable.
class RoundedWalls {
 public:
  // `step_m`: to which coordinates were rounded. The walls: at least three
  // vertices each, nonzero area. Charges what it holds.
  RoundedWalls(std::span<const std::vector<Point3>> walls,
               double step_m,
               MemoryBudget& budget);

  // The point on all planes of walls that `p` is beside by no more than
  // rounding; of more than three, on those of the largest walls, and of
  // parallel ones on the nearest. It depends on the point alone, so that
  // polygons go on sharing the vertices that they share.
  [[nodiscard]] Point3 Restored(Point3 p) const;

  [[nodiscard]] double StepM() const { return step_m_; }

  // Whether rounding leaves a wall with this unit normal plane.
  static bool IsAlongAxis(Vec3 normal);

 private:
  MemoryCharge charge_;
  double step_m_;
  std::vector<Plane> planes_;       // those of the largest walls first
  std::vector<uint32_t> plane_of_;  // by wall: index into planes_
  std::optional<BoxTree> boxes_;    // around the walls
};

}  // namespace enfilade
