// The shadows that single blockers cast on an element from one point. Rays
// between random points of two elements miss a narrow one, such as that of a
// seat's rim on the upper end of a leg; its outline does not.

#pragma once

#include "solver/form_factor.h"
#include "solver/geometry.h"

#include <cstdint>
#include <span>

namespace enfilade {

class CastShadow {
 public:
  // Shares are counted in these, so that sums do not depend on their order.
  static constexpr uint32_t kWhole = 1U << 16;

  // Of light from a point on the front of the receiver; from behind there are
  // no shadows. The receiver is borrowed.
  CastShadow(const TransferEnd& receiver, Vec3f light);

  // The share of the receiver in the shadow of a convex polygon of at most four
  // corners, from 0 to kWhole. What lies in the receiver's plane or behind it,
  // and what is farther from it than the light, casts none.
  [[nodiscard]] uint32_t ShareOf(std::span<const Vec3f> blocker) const;

 private:
  const TransferEnd* receiver_;
  Vec3f light_;
  float height_ = 0;  // of the light over the receiver's plane, m
  Vec3f along_a_;     // to coordinates of the element: Dot(p - origin, .)
  Vec3f along_b_;
};

}  // namespace enfilade
