// Materials and convex planar faces, which every reader delivers and every
// later stage reads, as a stream.

#pragma once

#include "base/ids.h"
#include "base/photometry.h"
#include "base/planar_polygon.h"
#include "base/vec.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace enfilade {

// How light leaves a face. A face reflects alike on all its `sides` and emits
// from the front (right-hand rule) only.
struct Material {
  std::string name;
  Rgb reflectance{};   // in [0, 1) per channel
  Rgb exitance{};      // W/m2, or lm/m2 when the scene is photometric
  int sides = 2;       // 2: both sides reflect; 1: the back is black
  bool clear = false;  // ignored by light; never reaches a face
};

inline bool Emits(const Material& m) {
  return MaxChannel(m.exitance) > 0;
}

// A solid that faces close off, and on which side of a face the solid is.
struct ClosedSolid {
  Box3 bounds;
  bool front_is_inside = false;
};

// A convex planar polygon of one material, counter-clockwise seen from its
// front. At least three vertices, no zero area, no duplicate or NaN vertices.
// The faces of a scene may share edges, T-junctions included.
struct Face {
  MaterialId material;
  ObjectId object;  // its name is not kept
  std::vector<Point3> vertices;
  // gbXML only: the Spaces in front of and behind the face, nullopt for the
  // outside.
  std::optional<SpaceId> front_space;
  std::optional<SpaceId> back_space;
  // The solid whose surface the face is part of, if that is certain.
  std::optional<ClosedSolid> solid;
  // Of the plane surface that the face is a piece of, m2: of a wall with
  // windows, all that is left around them. 0 if the face is not a piece.
  double surface_m2 = 0;
};

// The area of the plane surface that the face is, or is a piece of, m2.
inline double SurfaceArea(const Face& face) {
  return std::max(face.surface_m2, PolygonArea(face.vertices));
}

using FaceVisitor = std::function<void(const Face&)>;

// An opening that the input names (gbXML doors, windows and Air surfaces):
// a convex polygon between two Spaces or a Space and the outside.
struct Opening {
  std::vector<Point3> vertices;
  std::optional<SpaceId> front_space;
  std::optional<SpaceId> back_space;
};

// A Space that the input names.
struct Space {
  std::string name;
  Box3 bounds;
  bool closed = true;  // its faces and openings bound a volume without gaps
};

}  // namespace enfilade
