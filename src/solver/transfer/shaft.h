// A conservative proof that nothing stands between two elements (an empty
// shaft, Haines and Wallace 1991). Rays that get through prove no such thing.

#pragma once

#include "solver/elements/geometry.h"
#include "solver/transfer/box_hull.h"
#include "solver/transfer/box_octets.h"
#include "solver/transfer/cast_shadow.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// An end of a shaft: an element, or a box of patches.
struct ShaftEnd {
  static constexpr size_t kMostCorners = 8;

  const PatchGeometry* patch = nullptr;  // null: a box
  Vec3f on_plane;                        // a point in the plane of the patch
  std::array<Vec3f, kMostCorners> points;
  size_t count = 0;
  Box box;  // bounds of the end

  [[nodiscard]] std::span<const Vec3f> Corners() const {
    return std::span(points).first(count);
  }
};

struct ShaftEnds {
  ShaftEnd receiver;  // an element
  ShaftEnd source;
};

ShaftEnds EndsOf(const PatchGeometry& receiver,
                 ElementFrame receiver_frame,
                 const PatchGeometry& source,
                 ElementFrame source_frame);

// An element and whatever is in a box.
ShaftEnds EndsOf(const PatchGeometry& receiver,
                 ElementFrame receiver_frame,
                 const Box& source);

// The ends for tests against portals. Portals lie where surfaces lie in the
// scene, but a surface may have been moved in front of a portal (Patch::layer).
// The ends therefore move back, and their boxes hold both positions and the
// distance by which ends may stick out of their cells.
ShaftEnds AcrossPortals(const ShaftEnds& ends);

// The space between two ends.
struct Shaft {
  explicit Shaft(const ShaftEnds& between);

  ShaftEnds ends;
  BoxHull hull;  // of the boxes of both ends
  // Behind the receiver and the source; if the source is a box, behind the
  // receiver twice.
  std::array<HalfSpace, 2> behind;
};

// The kind of blockers that are tested against shafts.
enum class BlockerKind : uint8_t { kSurfaces, kPortals };

// The distance from a plane, m, within which points count as lying in it. A
// blocker in the plane of an element is not between that element and anything
// else. For surfaces, rays end this far before their target, so that shafts and
// rays agree. For portals, the distance covers rounding alone: a wall may lie a
// tenth of a millimetre behind an opening and get all its light through it.
constexpr float CoplanarM(BlockerKind kind) {
  return kind == BlockerKind::kSurfaces ? 1e-4F : 1e-5F;
}

// The blockers of one cell, in a tree of boxes.
class ShaftBlockers {
 public:
  explicit ShaftBlockers(std::span<const PatchGeometry> patches,
                         BlockerKind kind = BlockerKind::kSurfaces);

  // True only if no blocker can cut a segment between the two ends: every
  // blocker lies outside the hull of both ends, or has both ends on one side of
  // the blocker's plane, or lies behind one end or in that end's plane (unless
  // the blocker is a portal that an end may stick out of).
  [[nodiscard]] bool LeaveEmpty(const Shaft& shaft) const;

  // The shadows of the blockers, added up until one of the two sums reaches
  // `enough`, in units of 1 / CastShadow::kWhole.
  [[nodiscard]] ShadowSum SumOfShadows(const CastShadow& shadow,
                                       uint64_t enough) const;

  [[nodiscard]] uint64_t SizeBytes() const;

  // What SizeBytes() of so many blockers will be.
  static uint64_t BytesFor(size_t blockers);

 private:
  ShaftBlockers(std::span<const PatchGeometry> patches,
                BlockerKind kind,
                std::span<const size_t> order);

  [[nodiscard]] bool MayCut(size_t i, const ShaftEnds& ends) const;

  // Whether blocker i, a portal, touches an end that may lie in it or stick out
  // of it. A face may lie up to kOnPlaneM outside of its cell, as where two
  // surfaces are nearly in one plane. The side of the portal on which the end
  // lies then proves nothing.
  [[nodiscard]] bool MayHold(size_t i, const ShaftEnds& ends) const;

  [[nodiscard]] std::span<const Vec3f> CornersOfBlocker(size_t i) const {
    return std::span<const Vec3f>(points_).subspan(4 * i, 4);
  }

  BlockerKind kind_;
  float coplanar_m_;
  BoxOctets boxes_;
  std::vector<Vec3f> points_;  // four corners each (a triangle repeats one)
  std::vector<Vec3f> normals_;
};

}  // namespace enfilade
