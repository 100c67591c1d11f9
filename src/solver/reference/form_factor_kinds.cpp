#include "solver/reference/form_factor_kinds.h"

#include "base/error.h"
#include "solver/transfer/oracle.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr float kSwitchEstimate = 0.01F;

constexpr std::array<std::pair<const char*, FormFactorKind>, 6> kKinds = {{
    {"exact", FormFactorKind::kExact},
    {"point", FormFactorKind::kPoint},
    {"polygon", FormFactorKind::kPolygon},
    {"switch", FormFactorKind::kSwitch},
    {"hemicube", FormFactorKind::kHemicube},
    {"montecarlo", FormFactorKind::kMonteCarlo},
}};

FormFactorKind KindNamed(const std::string& name) {
  for (const auto& [known, kind] : kKinds) {
    if (name == known) {
      return kind;
    }
  }
  throw UsageError(fmt::format(
      "--form-factors {}: give exact, point, polygon, switch, hemicube or "
      "montecarlo",
      name));
}

Projection ProjectionNamed(const std::string& name) {
  if (name != "galerkin" && name != "collocation") {
    throw UsageError(
        fmt::format("--projection {}: give galerkin or collocation", name));
  }
  return name == "galerkin" ? Projection::kGalerkin : Projection::kCollocation;
}

// A_j h_i h_j / (pi r^4), where h_i and h_j are the heights of each center
// above the plane of the other end. The height above the source is raised to
// `least_height`.
float BetweenCenters(const TransferEnd& receiver,
                     const TransferEnd& source,
                     float least_height) {
  const Vec3f d = source.center - receiver.center;
  const float r2 = std::max(Dot(d, d), 1e-12F);
  const float above_receiver = std::max(0.0F, Dot(d, receiver.patch->normal));
  const float above_source =
      std::max(least_height, -Dot(d, source.patch->normal));
  return source.area * above_receiver * above_source * kInversePi / (r2 * r2);
}

// Whether the ends are close for the size of either one.
bool AreNear(const TransferEnd& a, const TransferEnd& b) {
  return IsNear(a, b) || IsNear(b, a);
}

}  // namespace

bool FormFactorOptions::AreSymmetric() const {
  return projection == Projection::kGalerkin &&
         (kind == FormFactorKind::kExact || kind == FormFactorKind::kPoint);
}

bool FormFactorOptions::AreTraced() const {
  return kind == FormFactorKind::kHemicube ||
         kind == FormFactorKind::kMonteCarlo;
}

FormFactorOptions FormFactorOptionsOf(const MethodOptions& method) {
  return {KindNamed(method.form_factors), ProjectionNamed(method.projection)};
}

float PointToPoint(const TransferEnd& receiver, const TransferEnd& source) {
  return BetweenCenters(receiver, source, 0);
}

float ModifiedEstimate(const TransferEnd& receiver, const TransferEnd& source) {
  return BetweenCenters(receiver, source, source.diameter / 2);
}

float CenterToPolygon(const TransferEnd& receiver, const TransferEnd& source) {
  const PatchGeometry& patch = *source.patch;
  if (Dot(receiver.center - patch.origin, patch.normal) <= 0) {
    return 0;
  }
  const Corners corners = CornersOf(patch, source.frame);
  return PointToPolygon(
      receiver.center, receiver.patch->normal, corners.View());
}

float SwitchOver(const TransferEnd& receiver, const TransferEnd& source) {
  return ModifiedEstimate(receiver, source) < kSwitchEstimate
             ? PointToPoint(receiver, source)
             : CenterToPolygon(receiver, source);
}

float ExactFromCenter(const TransferEnd& receiver, const TransferEnd& source) {
  if (AreNear(receiver, source)) {
    return CenterToPolygon(receiver, source);
  }
  float sum = 0;
  for (const float part :
       QuadratureRow({receiver.center, receiver.patch->normal}, source)) {
    sum += part;
  }
  return sum;
}

}  // namespace enfilade
