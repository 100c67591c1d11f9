// The geometry of sampling light: directions, points on emitters, the kernel.
// verify has its own, so that a mistake in that of the solver shows.

#pragma once

#include "base/ids.h"
#include "base/vec.h"

#include <optional>

namespace enfilade {

struct Emitter;

// A point and the normal of the hemisphere that it receives light from.
struct Receiver {
  Point3 position;
  Vec3 normal;  // unit length
  // Cell of the patch that the point lies on, if there is one and it is known.
  std::optional<CellId> cell{};
};

// Two unit vectors that complete a unit vector to a right-handed frame (Duff
// et al., "Building an Orthonormal Basis, Revisited", 2017).
void MakeFrame(Vec3 n, Vec3* s, Vec3* t);

// A direction with a density proportional to the cosine with the normal, from
// two numbers in [0, 1).
Vec3 CosineDirection(Vec3 normal, double u, double v);

// cos_x cos_y / (pi r^2); 0 if either faces away.
double GeometryTerm(Point3 x, Vec3 normal_x, Point3 y, Vec3 normal_y);

// A point uniform over the emitter's area, from two numbers in [0, 1).
Receiver PointOnEmitter(const Emitter& emitter, double s, double t);

}  // namespace enfilade
