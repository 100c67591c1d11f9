// Patches: the one-sided parallelograms and triangles that the solver works on.
// Each patch belongs to exactly one cell, the one its normal points into, and
// is the root of an element tree.

#pragma once

#include "base/block_storage.h"
#include "base/bytes.h"
#include "base/ids.h"
#include "base/vec.h"
#include "scene/face.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace enfilade {

enum class PatchShape : uint8_t { kParallelogram = 0, kTriangle = 1 };

constexpr size_t CornerCount(PatchShape shape) {
  return shape == PatchShape::kTriangle ? 3 : 4;
}

// A surface that lay in another one is put this far in front of it, m, and at
// most kMostLayers times as far in a stack of surfaces. All surfaces of a stack
// beyond that share the last layer (overlap.h).
inline constexpr double kApartM = 4e-4;
inline constexpr uint8_t kMostLayers = 6;

// The points origin + a u + b v with a, b in [0,1] (parallelogram) or
// a, b >= 0, a + b <= 1 (triangle). The normal is u x v.
struct Patch {
  Point3 origin;
  Vec3 u, v;
  PatchShape shape{};
  MaterialId material;
  FaceId face;
  // Emits the material's exitance: true on the front of an emitting face only.
  bool emits = false;
  // Reflects light. False for a black back, which only blocks rays.
  bool reflects = true;
  // This patch is the other side of a patch of the same cell with a smaller id.
  // The two are one blocker to rays.
  bool is_twin = false;
  // The patch lies on the back of its face.
  bool is_back = false;
  // The patch lies on the inside of a closed solid without a lamp, or behind a
  // patch that lies on it. It reflects, but no light ever reaches it.
  bool is_enclosed = false;
  // The patch was moved `layer` times kApartM along its normal from where it
  // lies in the scene. It may thus stick out of its cell's region, even through
  // a portal.
  uint8_t layer = 0;
};

inline double PatchArea(const Patch& p) {
  return Length(Cross(p.u, p.v)) *
         (p.shape == PatchShape::kTriangle ? 0.5 : 1.0);
}

// Whether the patch, with these materials, reflects any light and thus counts
// in a mean of the error over the surfaces (docs/error-measure.md).
inline bool Reflects(const Patch& p, const std::vector<Material>& materials) {
  return p.reflects &&
         MaxChannel(materials.at(p.material.Index()).reflectance) > 0;
}

inline Vec3 PatchNormal(const Patch& p) {
  return Normalize(Cross(p.u, p.v));
}

// One cell's share of the building.
struct CellPatches {
  Box3 bounds;  // of the cell's region (not only of its patches)
  std::vector<Patch> patches;
};

Bytes EncodeCellPatches(const CellPatches& cell);
CellPatches DecodeCellPatches(std::span<const std::byte> bytes);

CellPatches LoadCellPatches(const BlockStorage& store, CellId cell);

}  // namespace enfilade
