// What the function that a link makes of a source's light cannot follow of it,
// by a few points of the receiver: of links between two elements (oracle.h) and
// from groups (group_transfer.h).

#pragma once

#include "solver/elements/basis.h"
#include "solver/transfer/form_factor.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

namespace enfilade {

// Where the receiver's basis is tested: the middle, and near each edge.
std::span<const UnitPoint> TestPoints(PatchShape shape);

// The corner of an element that lies farthest along a direction, a little off
// its rim.
UnitPoint CornerAlong(const TransferEnd& end, Vec3f direction);

// The point of an element that is nearest to p, a little off its rim.
UnitPoint NearestOn(const TransferEnd& end, Vec3f p);

// The RMS over an element of what the basis cannot follow, per RMS at the test
// points.
float ResidualScale(const Basis& basis);

// Where a source is, as far as it tells where its light may rise unseen by the
// test points.
struct SourceExtent {
  Vec3f center;
  float diameter = 0;
  float area = 0;  // that shines towards the receiver
  bool near = false;
  // Out of the planes in which the source cuts the receiver, if it does.
  std::optional<Vec3f> lit_side;
};

// Where the plane of the source cuts the receiver, what is lit may be a corner
// that neither nodes nor test points lie in: a ninth of a triangle, on which
// irradiance rises from nothing. The mean square of such light over the
// element, per square of what the corner gets.
inline constexpr float kCornerShare = 0.1F;

// The RMS over the receiver of what the basis cannot follow. What it cannot
// follow at points is asked for: at_test(i) at TestPoints()[i], at_point(p)
// anywhere else.
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
    // A small source close to a large receiver peaks between its nodes: over
    // an area like the source's, widened by its distance.
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
