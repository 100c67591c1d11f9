// Patches and elements as the kernels see them: single precision, relative to
// the scene's origin, so that coordinates are small.
//
//   paper  here       unit
//   x, y   points     m
//   n      normal     unit vector, to the side that receives and sends light
//   A      area       m2

#pragma once

#include "base/ids.h"
#include "base/photometry.h"
#include "base/vec.h"
#include "partition/patch.h"
#include "partition/patch_points.h"
#include "scene/face.h"
#include "solver/elements/basis.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

inline constexpr float kInversePi = static_cast<float>(1 / kPi);

struct Vec3f {
  float x = 0, y = 0, z = 0;

  float operator[](size_t i) const { return i == 0 ? x : i == 1 ? y : z; }
};

inline Vec3f operator+(Vec3f a, Vec3f b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

inline Vec3f operator-(Vec3f a, Vec3f b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline Vec3f operator*(Vec3f a, float s) {
  return {a.x * s, a.y * s, a.z * s};
}

inline float Dot(Vec3f a, Vec3f b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

inline Vec3f Cross(Vec3f a, Vec3f b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline float Length(Vec3f a) {
  return std::sqrt(Dot(a, a));
}

inline Vec3f ToFloat(Vec3 v) {
  return {static_cast<float>(v.x),
          static_cast<float>(v.y),
          static_cast<float>(v.z)};
}

// A closed axis-aligned box, initially empty.
struct Box {
  Vec3f low{kFar, kFar, kFar};
  Vec3f high{-kFar, -kFar, -kFar};

  static Box Everything() {
    return {{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};
  }

  // Whether the box holds everything within kFar.
  [[nodiscard]] bool IsEverything() const {
    return low.x <= -kFar && low.y <= -kFar && low.z <= -kFar &&
           high.x >= kFar && high.y >= kFar && high.z >= kFar;
  }

  void Add(Vec3f p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {
        std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }

  void Add(const Box& box) {
    Add(box.low);
    Add(box.high);
  }

  [[nodiscard]] bool Overlaps(const Box& box) const {
    return low.x <= box.high.x && box.low.x <= high.x && low.y <= box.high.y &&
           box.low.y <= high.y && low.z <= box.high.z && box.low.z <= high.z;
  }

  [[nodiscard]] Vec3f Extent() const { return high - low; }

  static constexpr float kFar = 1e30F;
};

// A patch ready for the kernels.
struct PatchGeometry {
  Vec3f origin, u, v, normal;
  float area = 0;      // m2
  float diameter = 0;  // m, the longest distance of two corners
  float radius = 0;    // m, the longest distance of a corner from the center
  PatchShape shape{};
  bool emits = false;
  bool reflects = false;
  uint8_t layer = 0;  // Patch::layer
  MaterialId material;
  float max_reflectance = 0;  // over the channels; 0 if it does not reflect
};

// `scene_origin` is subtracted before rounding to float.
PatchGeometry MakePatchGeometry(const Patch& patch,
                                const Material& material,
                                Point3 scene_origin);

// The geometry of each of the patches. `materials` is indexed by MaterialId.
std::vector<PatchGeometry> MakePatchGeometries(
    std::span<const Patch> patches,
    std::span<const Material> materials,
    Point3 scene_origin);

// The part of a patch that an element covers: patch coordinates a + scale * s,
// b + scale * t for (s, t) in the unit shape.
struct ElementFrame {
  float a = 0;
  float b = 0;
  float scale = 1;
};

inline ElementFrame ChildOf(ElementFrame parent,
                            PatchShape shape,
                            size_t child) {
  const ChildFrame frame = FrameOfChild(shape, child);
  return {parent.a + parent.scale * static_cast<float>(frame.a),
          parent.b + parent.scale * static_cast<float>(frame.b),
          parent.scale * static_cast<float>(frame.scale)};
}

// The child in which a point of the unit shape lies; `p` becomes the point's
// coordinates in that child.
size_t ChildAt(PatchShape shape, UnitPoint* p);

inline Vec3f PointOn(const PatchGeometry& patch,
                     ElementFrame frame,
                     float s,
                     float t) {
  return patch.origin + patch.u * (frame.a + frame.scale * s) +
         patch.v * (frame.b + frame.scale * t);
}

// Points within this distance of a patch's plane, m, count as lying in it.
inline float PlaneTolerance(const PatchGeometry& patch) {
  return 1e-5F * (1 + patch.diameter);
}

inline float AreaOf(const PatchGeometry& patch, ElementFrame frame) {
  return patch.area * frame.scale * frame.scale;
}

inline float DiameterOf(const PatchGeometry& patch, ElementFrame frame) {
  return patch.diameter * std::abs(frame.scale);
}

inline float RadiusOf(const PatchGeometry& patch, ElementFrame frame) {
  return patch.radius * std::abs(frame.scale);
}

using Corners = CornerList<Vec3f>;

// The corners of an element, counter-clockwise seen from its front.
Corners CornersOf(const PatchGeometry& patch, ElementFrame frame);

// Corner k of the unit shape, counter-clockwise seen from the front.
UnitPoint UnitCorner(PatchShape shape, size_t k);

inline UnitPoint UnitCentroid(PatchShape shape) {
  return {CentroidCoordinate(shape), CentroidCoordinate(shape)};
}

// Right-handed orthonormal axes of a patch, x along its u and z its normal.
struct PatchAxes {
  Vec3f x, y, z;
};

PatchAxes AxesOf(const PatchGeometry& patch);

}  // namespace enfilade
