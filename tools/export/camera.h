// Cameras for pictures of a solution: given by the user, chosen for a room, or
// a plan of a storey from above.

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <optional>

namespace enfilade {

enum class CameraView {
  kPerspective,
  kPlan,  // parallel, from above, cut open at a height within a storey
};

enum class UpAxis { kAutomatic, kY, kZ };

// What the user asks for; whatever is left out is chosen.
struct CameraOptions {
  CameraView view = CameraView::kPerspective;
  // Where the camera stands and looks, in metres. Without an eye: a corner of
  // the best-lit large room at eye height, along its longest diagonal; without
  // a target: the middle of the scene.
  std::optional<Point3> eye;
  std::optional<Point3> target;
  double vertical_fov_degrees = 60;
  // Automatic: the axis along which most of the area of axis-parallel patches
  // faces (floors and ceilings), Z in doubt.
  UpAxis up = UpAxis::kAutomatic;
  // The plan's cut, a coordinate along the up axis. Without: 1.8 m above the
  // largest floor that receives light.
  std::optional<double> plan_cut_m;

  // Throws UsageError with what is wrong.
  void Validate() const;
};

// A camera ready to make rays: the ray of picture coordinates (x, y) in
// [-1, 1]^2, x to the right and y up, starts at
//   origin + x * origin_x + y * origin_y
// and runs along direction + x * direction_x + y * direction_y.
struct Camera {
  Point3 origin;
  Vec3 origin_x, origin_y;  // zero in a perspective
  Vec3 direction;
  Vec3 direction_x, direction_y;  // zero in a plan
};

// A perspective of this width over height. Requires eye != target and a
// direction that is not parallel to `up` (unit length).
Camera PerspectiveCamera(Point3 eye,
                         Point3 target,
                         Vec3 up,
                         double vertical_fov_degrees,
                         double aspect);

// A plan of the box's area from the height `cut_m`, with a small margin. The
// picture's right is +X; its top is +Y (or -Z with Y up).
Camera PlanCamera(const Box3& bounds, UpAxis up, double cut_m, double aspect);

}  // namespace enfilade
