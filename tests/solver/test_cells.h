// Small cells for the tests of the solver: patches as the kernels see them.

#pragma once

#include "base/directions.h"
#include "base/random.h"
#include "solver/elements/geometry.h"

#include <vector>

namespace enfilade::test {

// The single-precision rounding of sums of a few hundred values about 1.
inline constexpr double kFloatRounding = 1e-5;

inline constexpr Box3 kRoom{{0, 0, 0}, {4, 5, 3}};

// A parallelogram or triangle in a random orientation, with an origin in a cube
// of edge `room` and edges of at most `size`.
inline Patch RandomPatch(Random& random, double room, double size) {
  Patch p;
  p.origin = {room * random.Next(), room * random.Next(), room * random.Next()};
  p.u = RandomDirection(random) * (size * (0.2 + 0.8 * random.Next()));
  const Vec3 aside = Normalize(Cross(p.u, RandomDirection(random)));
  p.v = aside * (size * (0.2 + 0.8 * random.Next())) +
        p.u * (0.5 * random.Next());
  p.shape = random.NextBelow(2) == 0 ? PatchShape::kParallelogram
                                     : PatchShape::kTriangle;
  return p;
}

inline std::vector<Patch> RandomPatches(uint64_t seed,
                                        size_t count,
                                        double room,
                                        double size) {
  Random random(seed);
  std::vector<Patch> patches(count);
  for (Patch& p : patches) {
    p = RandomPatch(random, room, size);
  }
  return patches;
}

// All of one material, reflecting `reflectance` in every channel.
inline std::vector<PatchGeometry> GeometryOf(const std::vector<Patch>& patches,
                                             double reflectance = 0.5) {
  Material material;
  material.reflectance = {reflectance, reflectance, reflectance};
  std::vector<PatchGeometry> geometry;
  geometry.reserve(patches.size());
  for (const Patch& p : patches) {
    geometry.push_back(MakePatchGeometry(p, material, Point3{}));
  }
  return geometry;
}

// A random point of an element.
inline Vec3f RandomPointOn(const PatchGeometry& patch,
                           ElementFrame frame,
                           Random& random) {
  const auto s = static_cast<float>(random.Next());
  const auto t = static_cast<float>(random.Next());
  const auto [a, b] = FoldedOnto(patch.shape, s, t);
  return PointOn(patch, frame, a, b);
}

}  // namespace enfilade::test
