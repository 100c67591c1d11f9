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
  // Where the camera stands and looks, in metres. Without an eye, test pictures
  // choose a corner at eye height in one of the cells that receive most light;
  // without a target as well, the camera looks at the opposite corner. With an
  // eye but no target, it looks at the middle of the scene.
  std::optional<Point3> eye;
  std::optional<Point3> target;
  double vertical_fov_degrees = 60;
  // Automatic is the axis that import took for up: Z in gbXML, else the one, Y
  // or Z, to which more area of the scene is level (scene/level_areas.h).
  UpAxis up = UpAxis::kAutomatic;
  // The height of the plan's cut, a coordinate along the up axis. If unset, the
  // cut is 1.8 m above the floor level that receives most light.
  std::optional<double> plan_cut_m;

  // Throws UsageError with what is wrong.
  void Validate() const;
};

// Whether two points are too close for a camera to look from one at the other.
inline bool IsOnePoint(Point3 eye, Point3 target) {
  constexpr double kLeastDistanceMetres = 1e-6;
  return !(Length(target - eye) > kLeastDistanceMetres);
}

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

// A perspective camera for a picture of this width over height. Requires two
// points and a direction that is not parallel to `up` (unit length).
Camera PerspectiveCamera(Point3 eye,
                         Point3 target,
                         Vec3 up,
                         double vertical_fov_degrees,
                         double aspect);

// A plan camera that covers the box's area, with a small margin, from the
// height `cut_m`. The picture's right is +X; its top is +Y (or -Z with Y up).
Camera PlanCamera(const Box3& bounds, UpAxis up, double cut_m, double aspect);

}  // namespace enfilade
