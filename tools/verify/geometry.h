// The geometry of sampling light: directions and points on emitters.

#pragma once

#include "base/directions.h"
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

// Axes about a unit vector (Duff et al., "Building an Orthonormal Basis,
// Revisited", 2017).
NormalAxes MakeFrame(Vec3 n);

// A direction with a density proportional to the cosine with the normal, from
// two numbers in [0, 1).
Vec3 CosineDirection(Vec3 normal, double u, double v);

// A point uniform over the emitter's area, from two numbers in [0, 1).
Receiver PointOnEmitter(const Emitter& emitter, double s, double t);

}  // namespace enfilade
