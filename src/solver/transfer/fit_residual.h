// The residual of a link: the part of a source's irradiance that the basis on
// the receiver cannot follow, estimated from a few points of the receiver. For
// links between two elements (oracle.h) and from groups (group_transfer.h).

#pragma once

#include "solver/elements/basis.h"
#include "solver/transfer/form_factor.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

namespace enfilade {

// The points at which the residual is tested: the middle of the element, and a
// point near the middle of each edge.
std::span<const UnitPoint> TestPoints(PatchShape shape);

// The corner of an element that lies farthest along a direction, moved a little
// off the rim.
UnitPoint CornerAlong(const TransferEnd& end, Vec3f direction);

// The point of an element that is nearest to p, moved a little off the rim.
UnitPoint NearestOn(const TransferEnd& end, Vec3f p);

// The RMS of the residual over an element per RMS at the test points.
float ResidualScale(const Basis& basis);

// The position of a source, as far as it tells where the source's irradiance
// may peak between the test points.
struct SourceExtent {
  Vec3f center;
  float diameter = 0;
  float area = 0;  // that shines towards the receiver, m2
  bool near = false;
  // The normal of the source's plane if that plane cuts the receiver (for a
  // group, the sum of such normals): points to the lit side.
  std::optional<Vec3f> lit_side;
};

// If the source's plane cuts the receiver, the lit part may be a corner that
// holds neither nodes nor test points: a ninth of a triangle, in which
// irradiance rises from zero. This is the mean square of that irradiance over
// the element, per square of the corner's irradiance.
inline constexpr float kCornerShare = 0.1F;

// The RMS over the receiver of the residual. at_test(i) returns the residual at
// TestPoints()[i], at_point(p) the residual at any other point p.
template <typename AtTest, typename AtPoint>
float RmsResidual(const TransferEnd& receiver,
                  const SourceExtent& source,
                  const Basis& basis,
                  const AtTest& at_test,
                  const AtPoint& at_point) {
  const size_t tests = TestPoints(receiver.patch->shape).size();
  float square = 0;
  for (size_t i = 0; i < tests; ++i) {
    const float residual = at_test(i);
    square += residual * residual;
  }
  square /= static_cast<float>(tests);
  if (source.lit_side) {
    const float residual = at_point(CornerAlong(receiver, *source.lit_side));
    square = std::max(square, kCornerShare * residual * residual);
  }
  if (source.near && source.diameter < 2 * receiver.diameter) {
    // The irradiance from a small source close to a large receiver peaks
    // between the receiver's nodes, over the source's area plus its squared
    // distance.
    const UnitPoint at = NearestOn(receiver, source.center);
    const Vec3f d = source.center - PointOn(*receiver.patch,
                                            receiver.frame,
                                            static_cast<float>(at.a),
                                            static_cast<float>(at.b));
    const float residual = at_point(at);
    square += residual * residual *
              std::min(1.0F, (source.area + Dot(d, d)) / receiver.area);
  }
  return ResidualScale(basis) * std::sqrt(square);
}

}  // namespace enfilade
