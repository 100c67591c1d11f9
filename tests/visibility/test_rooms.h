// Small rooms and furniture for the tests of visibility.

#pragma once

#include "base/random.h"
#include "base/vec.h"
#include "partition/patch.h"

#include <cstdint>
#include <vector>

namespace enfilade::test {

inline Patch Rectangle(Point3 origin, Vec3 u, Vec3 v) {
  Patch p;
  p.origin = origin;
  p.u = u;
  p.v = v;
  return p;
}

inline Patch Triangle(Point3 origin, Vec3 u, Vec3 v) {
  Patch p = Rectangle(origin, u, v);
  p.shape = PatchShape::kTriangle;
  return p;
}

// The six walls of a box, normals inward (a room) or outward (furniture).
inline std::vector<Patch> BoxPatches(const Box3& box, bool inward) {
  const Vec3 e = box.Extent();
  const Vec3 x{e.x, 0, 0};
  const Vec3 y{0, e.y, 0};
  const Vec3 z{0, 0, e.z};
  const Point3 l = box.low;
  std::vector<Patch> walls = {Rectangle(l, x, y),
                              Rectangle(l + z, y, x),
                              Rectangle(l, y, z),
                              Rectangle(l + x, z, y),
                              Rectangle(l, z, x),
                              Rectangle(l + y, x, z)};
  if (!inward) {
    for (Patch& p : walls) {
      std::swap(p.u, p.v);
    }
  }
  return walls;
}

inline void Append(std::vector<Patch>& to, const std::vector<Patch>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

// A random point in a cube with a corner in the origin.
inline Point3 RandomPoint(Random& random, double size) {
  return {random.Next() * size, random.Next() * size, random.Next() * size};
}

// Both sides of a patch, the second one marked as twin.
inline void AppendTwoSided(std::vector<Patch>& to, Patch p) {
  to.push_back(p);
  std::swap(p.u, p.v);
  p.is_twin = true;
  to.push_back(p);
}

}  // namespace enfilade::test
