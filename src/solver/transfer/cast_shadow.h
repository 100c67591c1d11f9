// The shadows that single blockers cast on an element from one point. Rays
// between random points of two elements miss a narrow one, such as that of a
// seat's rim on the upper end of a leg; its outline does not.

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
  // Shares are counted in these, so that sums do not depend on their order.
  static constexpr uint32_t kWhole = 1U << 16;

  // Of light from a point on the front of the receiver; from behind there are
  // no shadows. The receiver is borrowed.
  CastShadow(const TransferEnd& receiver, Vec3f light);

  // The share of the receiver in the shadow of a convex polygon of at most four
  // corners, from 0 to kWhole. What lies in the receiver's plane or behind it,
  // and what is farther from it than the light, casts none.
  [[nodiscard]] uint32_t ShareOf(std::span<const Vec3f> blocker) const;

  // Nothing in the box casts a shadow on the receiver: it lies beyond a plane
  // through the light and an edge, behind the receiver, or beyond the light.
  [[nodiscard]] bool Misses(const Box& box) const;

  // A bit for each of the boxes that it does not miss, in the order of the
  // octet.
  [[nodiscard]] uint32_t MayMeet(const BoxOctet& boxes) const;

  // Whether light falls on the front of a surface through a point.
  [[nodiscard]] bool IsLit(Vec3f point, Vec3f normal) const {
    return Dot(light_ - point, normal) > 0;
  }

 private:
  struct HalfSpace {
    Vec3f normal;
    Vec3f reach;       // of the normal, without signs
    float offset = 0;  // Dot(normal, p) >= offset within
  };

  const TransferEnd* receiver_;
  Vec3f light_;
  float height_ = 0;  // of the light over the receiver's plane, m
  Vec3f along_a_;     // to coordinates of the element: Dot(p - origin, .)
  Vec3f along_b_;
  Box around_;  // all segments from the receiver to the light
  // Whose intersection holds all segments from the receiver to the light; that
  // which a triangle does not need holds everything.
  std::array<HalfSpace, 6> within_;
};

// The shadows of several blockers, added up: of those with the light on their
// front and of those with it on their back, since a closed solid has as much of
// both.
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
