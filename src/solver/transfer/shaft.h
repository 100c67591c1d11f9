// Conservative proof that nothing stands between two elements (an empty shaft,
// Haines and Wallace 1991). Rays that get through prove nothing; this does.

#pragma once

#include "solver/elements/geometry.h"
#include "solver/transfer/box_octets.h"
#include "solver/transfer/cast_shadow.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// The space between two elements.
struct Shaft {
  const PatchGeometry* receiver = nullptr;
  const PatchGeometry* source = nullptr;  // null: many
  std::array<Vec3f, 12> ends;             // the corners of both
  size_t count = 0;
  Box box;  // of both
  // A point in the plane of each.
  Vec3f on_receiver;
  Vec3f on_source;
};

Shaft ShaftBetween(const PatchGeometry& receiver,
                   ElementFrame receiver_frame,
                   const PatchGeometry& source,
                   ElementFrame source_frame);

// The space between an element and whatever is in a box.
Shaft ShaftBetween(const PatchGeometry& receiver,
                   ElementFrame receiver_frame,
                   const Box& source);

// The same as far as portals go. These are where a surface lies in the scene,
// and it may have been put before them (Patch::layer): so the ends go back
// there, and the box holds both places, and what they may stick out of.
Shaft AcrossPortals(Shaft shaft);

// What is looked for in shafts.
enum class BlockerKind : uint8_t { kSurfaces, kPortals };

// How far from a plane is still in it, m. What lies in the plane of an element
// is not between it and anything else. For surfaces that is as near as rays
// end before what they end on, so that both say the same. For portals it is
// rounding alone: a wall may lie a tenth of a millimetre behind an opening and
// gets all its light through it.
constexpr float CoplanarM(BlockerKind kind) {
  return kind == BlockerKind::kSurfaces ? 1e-4F : 1e-5F;
}

// The blockers of one cell, in a tree of boxes.
class ShaftBlockers {
 public:
  explicit ShaftBlockers(std::span<const PatchGeometry> patches,
                         BlockerKind kind = BlockerKind::kSurfaces);

  // True only if no blocker can cut a segment between the two elements:
  // every blocker lies outside the box of both, or has both on one side of
  // its plane, or lies behind one of them, or in its plane (unless it is a
  // portal that one may stick out of).
  [[nodiscard]] bool LeaveEmpty(const Shaft& shaft) const;

  // The shadows of the blockers, added up until one of the two sums is at least
  // `enough`, in parts of CastShadow::kWhole.
  [[nodiscard]] ShadowSum SumOfShadows(const CastShadow& shadow,
                                       uint64_t enough) const;

  [[nodiscard]] uint64_t SizeBytes() const;

  // What SizeBytes() of so many will be.
  static uint64_t BytesFor(size_t blockers);

 private:
  ShaftBlockers(std::span<const PatchGeometry> patches,
                BlockerKind kind,
                std::span<const size_t> order);

  [[nodiscard]] bool MayCut(size_t i, const Shaft& shaft) const;

  // A portal that one of the ends touches and may lie in or stick out of, since
  // faces belong to a cell that they are kOnPlaneM outside of: as where two
  // surfaces are nearly in one plane. On which side of it the end is, says
  // nothing then.
  [[nodiscard]] bool MayHold(size_t i, const Shaft& shaft) const;

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
