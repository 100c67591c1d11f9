#include "solver/transfer/fit_residual.h"

#include <array>

namespace enfilade {
namespace {

// By order of the basis, 1 to 4: the RMS over the element per RMS over the test
// points of the simplest residual that the basis cannot follow, the Legendre
// polynomial of the degree `order` in the receiver's coordinates. The values of
// orders 1 and 2 are measured.
constexpr std::array<float, 5> kResidual = {0, 0.9F, 0.6F, 1.05F, 0.92F};

}  // namespace

std::span<const UnitPoint> TestPoints(PatchShape shape) {
  static constexpr std::array<UnitPoint, 5> kSquare = {
      {{0.5, 0.5}, {0.04, 0.5}, {0.96, 0.5}, {0.5, 0.04}, {0.5, 0.96}}};
  static constexpr std::array<UnitPoint, 4> kTriangle = {
      {{1.0 / 3, 1.0 / 3}, {0.48, 0.04}, {0.04, 0.48}, {0.48, 0.48}}};
  if (shape == PatchShape::kTriangle) {
    return kTriangle;
  }
  return kSquare;
}

UnitPoint CornerAlong(const TransferEnd& end, Vec3f direction) {
  constexpr float kRim = 0.03F;
  const PatchGeometry& patch = *end.patch;
  const float sign = end.frame.scale < 0 ? -1.0F : 1.0F;
  const float along_u = sign * Dot(patch.u, direction);
  const float along_v = sign * Dot(patch.v, direction);
  const bool is_triangle = patch.shape == PatchShape::kTriangle;
  const double low = kRim;
  const double high = is_triangle ? 1 - 2 * kRim : 1 - kRim;
  const bool far_u = along_u > 0 && !(is_triangle && along_v > along_u);
  const bool far_v = along_v > 0 && !(is_triangle && far_u);
  return {far_u ? high : low, far_v ? high : low};
}

UnitPoint NearestOn(const TransferEnd& end, Vec3f p) {
  const PatchGeometry& patch = *end.patch;
  const Vec3f d = p - PointOn(patch, end.frame, 0, 0);
  const Vec3f u = patch.u * end.frame.scale;
  const Vec3f v = patch.v * end.frame.scale;
  const float uu = Dot(u, u);
  const float uv = Dot(u, v);
  const float vv = Dot(v, v);
  const float determinant = std::max(uu * vv - uv * uv, 1e-20F);
  const float du = Dot(d, u);
  const float dv = Dot(d, v);
  constexpr float kRim = 0.03F;
  float s = std::clamp((vv * du - uv * dv) / determinant, kRim, 1 - kRim);
  float t = std::clamp((uu * dv - uv * du) / determinant, kRim, 1 - kRim);
  if (patch.shape == PatchShape::kTriangle && s + t > 1 - kRim) {
    const float scale = (1 - kRim) / (s + t);
    s *= scale;
    t *= scale;
  }
  return {static_cast<double>(s), static_cast<double>(t)};
}

float ResidualScale(const Basis& basis) {
  return kResidual[basis.kind.order];
}

}  // namespace enfilade
