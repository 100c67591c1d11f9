// The shadows that single blockers cast on an element from one point. Rays
// between random points of two elements miss a narrow shadow, such as that of a
// seat's rim on the upper end of a leg; the projected outline of a blocker does
// not.

#pragma once

#include "solver/elements/geometry.h"
#include "solver/transfer/box_octets.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstdint>
#include <span>

namespace enfilade {

class CastShadow {
 public:
  // Shares are integers in units of 1 / kWhole, so that sums do not depend on
  // the order of their terms.
  static constexpr uint32_t kWhole = 1U << 16;

  // The shadows of light from a point in front of the receiver; a point behind
  // the receiver gives no shadows. The receiver is borrowed.
  CastShadow(const TransferEnd& receiver, Vec3f light);

  // The share, from 0 to kWhole, of the receiver in the shadow of a convex
  // polygon of at most four corners. Parts of the polygon in the receiver's
  // plane, behind it, or farther from it than the light cast no shadow.
  [[nodiscard]] uint32_t ShareOf(std::span<const Vec3f> blocker) const;

  // Whether nothing in the box can cast a shadow on the receiver: the box lies
  // beyond a plane through the light and an edge, behind the receiver, or
  // beyond the light.
  [[nodiscard]] bool Misses(const Box& box) const;

  // Bit i of the result: box i of the octet may cast a shadow (Misses is
  // false).
  [[nodiscard]] uint32_t MayMeet(const BoxOctet& boxes) const;

  // Whether the light shines on the front of a surface through a point.
  [[nodiscard]] bool IsLit(Vec3f point, Vec3f normal) const {
    return Dot(light_ - point, normal) > 0;
  }

 private:
  struct Side {
    Vec3f normal;
    Vec3f reach;       // absolute values of the normal
    float offset = 0;  // Dot(normal, p) >= offset within
  };

  const TransferEnd* receiver_;
  Vec3f light_;
  float height_ = 0;  // of the light over the receiver's plane, m
  Vec3f along_a_;     // to element coordinates: Dot(p - origin, .)
  Vec3f along_b_;
  Box around_;  // holds all segments from the receiver to the light
  // Half-spaces whose intersection holds all segments from the receiver to the
  // light. A triangle leaves the last one unset, which holds everything.
  std::array<Side, 6> within_;
};

// The sums of the shadows of several blockers, separately for blockers with the
// light on their front and on their back, since the fronts and the backs of a
// closed solid cast the same shadow.
struct ShadowSum {
  uint64_t of_fronts = 0;
  uint64_t of_backs = 0;

  void Add(const ShadowSum& other) {
    of_fronts += other.of_fronts;
    of_backs += other.of_backs;
  }

  [[nodiscard]] uint64_t Larger() const {
    return of_fronts > of_backs ? of_fronts : of_backs;
  }
};

}  // namespace enfilade
