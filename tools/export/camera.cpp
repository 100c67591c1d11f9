#include "tools/export/camera.h"

#include "base/check.h"
#include "base/error.h"
#include "base/photometry.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

constexpr double kPlanMargin = 1.04;
constexpr double kMostCoordinate = 1e9;  // m

// False for what is no number, too.
bool IsInReach(double coordinate) {
  return std::abs(coordinate) <= kMostCoordinate;
}

}  // namespace

void CameraOptions::Validate() const {
  if (!(vertical_fov_degrees >= 1) || !(vertical_fov_degrees <= 170)) {
    throw UsageError("--fov: the field of view must be 1 to 170 degrees");
  }
  for (const auto& point : {eye, target}) {
    if (point &&
        !(IsInReach(point->x) && IsInReach(point->y) && IsInReach(point->z))) {
      throw UsageError(
          "--eye, --target: coordinates must be numbers of metres up to 1e9");
    }
  }
  if (eye && target && IsOnePoint(*eye, *target)) {
    throw UsageError("--eye and --target are the same point");
  }
  if (plan_cut_m && !IsInReach(*plan_cut_m)) {
    throw UsageError("--cut: the height must be a number of metres up to 1e9");
  }
}

Camera PerspectiveCamera(Point3 eye,
                         Point3 target,
                         Vec3 up,
                         double vertical_fov_degrees,
                         double aspect) {
  Camera camera;
  camera.origin = eye;
  camera.direction = Normalize(target - eye);
  Vec3 right = Cross(camera.direction, up);
  ENFILADE_CHECK(Length(right) > 0, "the camera looks along its up vector");
  right = Normalize(right);
  const double half = std::tan(vertical_fov_degrees * kPi / 360);
  camera.direction_x = right * (half * aspect);
  camera.direction_y = Cross(right, camera.direction) * half;
  return camera;
}

Camera PlanCamera(const Box3& bounds, UpAxis up, double cut_m, double aspect) {
  const Vec3 extent = bounds.Extent();
  const Point3 center = bounds.Center();
  const bool y_up = up == UpAxis::kY;
  const double width = extent.x * kPlanMargin;
  const double height = (y_up ? extent.z : extent.y) * kPlanMargin;
  const double half_height = std::max({height, width / aspect, 1e-6}) / 2;
  Camera camera;
  camera.origin = y_up ? Point3{center.x, cut_m, center.z}
                       : Point3{center.x, center.y, cut_m};
  camera.origin_x = Vec3{1, 0, 0} * (half_height * aspect);
  camera.origin_y = (y_up ? Vec3{0, 0, -1} : Vec3{0, 1, 0}) * half_height;
  camera.direction = y_up ? Vec3{0, -1, 0} : Vec3{0, 0, -1};
  return camera;
}

}  // namespace enfilade
