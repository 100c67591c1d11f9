#include "solver/elements/geometry.h"

#include "base/check.h"

#include <algorithm>
#include <array>

namespace enfilade {

namespace {

// The longest distance of a corner from the centroid: up to two thirds of the
// diameter where the triangle is thin.
double RadiusOfTriangle(const Patch& patch) {
  const Vec3 center = (patch.u + patch.v) / 3;
  return std::max(
      {Length(center), Length(patch.u - center), Length(patch.v - center)});
}

}  // namespace

PatchGeometry MakePatchGeometry(const Patch& patch,
                                const Material& material,
                                Point3 scene_origin) {
  PatchGeometry g;
  g.origin = ToFloat(patch.origin - scene_origin);
  g.u = ToFloat(patch.u);
  g.v = ToFloat(patch.v);
  g.normal = ToFloat(PatchNormal(patch));
  g.area = static_cast<float>(PatchArea(patch));
  g.shape = patch.shape;
  g.emits = patch.emits;
  g.layer = patch.layer;
  g.reflects = patch.reflects && !patch.is_enclosed;
  g.material = patch.material;
  g.max_reflectance =
      g.reflects ? static_cast<float>(MaxChannel(material.reflectance)) : 0;
  const Vec3 diagonal = patch.shape == PatchShape::kTriangle
                            ? patch.u - patch.v
                            : patch.u + patch.v;
  g.diameter = static_cast<float>(std::max({Length(diagonal),
                                            Length(patch.u - patch.v),
                                            Length(patch.u),
                                            Length(patch.v)}));
  g.radius = patch.shape == PatchShape::kTriangle
                 ? static_cast<float>(RadiusOfTriangle(patch))
                 : 0.5F * g.diameter;
  return g;
}

std::vector<PatchGeometry> MakePatchGeometries(
    std::span<const Patch> patches,
    std::span<const Material> materials,
    Point3 scene_origin) {
  std::vector<PatchGeometry> geometry;
  geometry.reserve(patches.size());
  for (const Patch& patch : patches) {
    ENFILADE_CHECK(patch.material.Index() < materials.size(),
                   "a patch of material {} of {}",
                   patch.material.Index(),
                   materials.size());
    geometry.push_back(MakePatchGeometry(
        patch, materials[patch.material.Index()], scene_origin));
  }
  return geometry;
}

Corners CornersOf(const PatchGeometry& patch, ElementFrame frame) {
  Corners c;
  c.points[0] = PointOn(patch, frame, 0, 0);
  c.points[1] = PointOn(patch, frame, 1, 0);
  if (patch.shape == PatchShape::kTriangle) {
    c.points[2] = PointOn(patch, frame, 0, 1);
    c.count = 3;
  } else {
    c.points[2] = PointOn(patch, frame, 1, 1);
    c.points[3] = PointOn(patch, frame, 0, 1);
    c.count = 4;
  }
  return c;
}

UnitPoint UnitCorner(PatchShape shape, size_t k) {
  constexpr std::array<UnitPoint, 4> kSquare = {
      {{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  constexpr std::array<UnitPoint, 3> kTriangle = {{{0, 0}, {1, 0}, {0, 1}}};
  return shape == PatchShape::kTriangle ? kTriangle.at(k) : kSquare.at(k);
}

PatchAxes AxesOf(const PatchGeometry& patch) {
  const Vec3f x = patch.u * (1 / Length(patch.u));
  return {x, Cross(patch.normal, x), patch.normal};
}

size_t ChildAt(PatchShape shape, UnitPoint* p) {
  size_t child = 0;
  if (shape == PatchShape::kTriangle && p->a < 0.5 && p->b < 0.5 &&
      p->a + p->b > 0.5) {
    child = 3;
  } else {
    child = (p->a >= 0.5 ? 1U : 0U) + (p->b >= 0.5 ? 2U : 0U);
    if (shape == PatchShape::kTriangle && child == 3) {
      child = 1;  // reached only by rounding at the hypotenuse
    }
  }
  const ChildFrame frame = FrameOfChild(shape, child);
  p->a = (p->a - frame.a) / frame.scale;
  p->b = (p->b - frame.b) / frame.scale;
  return child;
}

}  // namespace enfilade
