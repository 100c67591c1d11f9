#include "solver/transfer/shaft.h"

#include "partition/polygon.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

// Above this cosine of the angle between the normals of a portal and an
// element, the element may stick out of its cell over some length.
constexpr float kNearlyParallel = 0.99F;
// The distance, m, by which an element may stick out, and rounding.
constexpr auto kBeyond = static_cast<float>(kOnPlaneM) * 1.5F;

// Interleaves the low ten bits of three numbers.
uint32_t Morton(uint32_t x, uint32_t y, uint32_t z) {
  const auto spread = [](uint32_t v) {
    v = (v | v << 16) & 0x030000FFU;
    v = (v | v << 8) & 0x0300F00FU;
    v = (v | v << 4) & 0x030C30C3U;
    return (v | v << 2) & 0x09249249U;
  };
  return spread(x) | spread(y) << 1 | spread(z) << 2;
}

Box BoxAround(std::span<const Vec3f> points) {
  Box box;
  for (const Vec3f p : points) {
    box.Add(p);
  }
  return box;
}

Box BoxOf(const PatchGeometry& patch) {
  const Corners corners = CornersOf(patch, {});
  return BoxAround(corners.View());
}

// The order of patches along a Morton curve through the centers of their boxes.
std::vector<size_t> SpatialOrder(std::span<const PatchGeometry> patches) {
  std::vector<Vec3f> middles;
  middles.reserve(patches.size());
  Box all;
  for (const PatchGeometry& p : patches) {
    const Box box = BoxOf(p);
    middles.push_back((box.low + box.high) * 0.5F);
    all.Add(middles.back());
  }
  const auto cell = [](float v, float from, float to) {
    return static_cast<uint32_t>(1023 * (v - from) / (to - from + 1e-6F));
  };
  std::vector<uint32_t> codes;
  codes.reserve(patches.size());
  for (const Vec3f m : middles) {
    codes.push_back(Morton(cell(m.x, all.low.x, all.high.x),
                           cell(m.y, all.low.y, all.high.y),
                           cell(m.z, all.low.z, all.high.z)));
  }
  std::vector<size_t> order(patches.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return codes[a] < codes[b];
  });
  return order;
}

std::vector<Box> BoxesOf(std::span<const PatchGeometry> patches,
                         std::span<const size_t> order) {
  std::vector<Box> boxes;
  boxes.reserve(order.size());
  for (const size_t i : order) {
    boxes.push_back(BoxOf(patches[i]));
  }
  return boxes;
}

// Whether all points lie on one (closed) side of the plane, or within
// `tolerance` of it; `sign` +1: in front, -1: behind.
bool AllOnSide(std::span<const Vec3f> points,
               Vec3f on_plane,
               Vec3f normal,
               float sign,
               float tolerance) {
  return std::all_of(points.begin(), points.end(), [&](Vec3f p) {
    return sign * Dot(p - on_plane, normal) >= -tolerance;
  });
}

Box Grown(Box box, float margin) {
  box.low = box.low - Vec3f{margin, margin, margin};
  box.high = box.high + Vec3f{margin, margin, margin};
  return box;
}

ShaftEnd EndOf(const PatchGeometry& patch, ElementFrame frame) {
  ShaftEnd end;
  end.patch = &patch;
  end.on_plane = patch.origin;
  const Corners corners = CornersOf(patch, frame);
  for (const Vec3f p : corners.View()) {
    end.points[end.count++] = p;
    end.box.Add(p);
  }
  return end;
}

ShaftEnd EndOf(const Box& box) {
  ShaftEnd end;
  for (; end.count < ShaftEnd::kMostCorners; ++end.count) {
    const size_t i = end.count;
    end.points[i] = {(i & 1) != 0 ? box.high.x : box.low.x,
                     (i & 2) != 0 ? box.high.y : box.low.y,
                     (i & 4) != 0 ? box.high.z : box.low.z};
  }
  end.box = box;
  return end;
}

// The end for tests against portals (AcrossPortals).
ShaftEnd PutBack(ShaftEnd end) {
  constexpr auto kApart = static_cast<float>(kApartM);
  if (end.patch == nullptr) {
    // Any patch in the box may have been moved by its layer, in any direction.
    return EndOf(Grown(end.box, kApart * kMostLayers));
  }
  const Vec3f back =
      end.patch->normal * (-kApart * static_cast<float>(end.patch->layer));
  end.on_plane = end.on_plane + back;
  for (Vec3f& p : std::span(end.points).first(end.count)) {
    p = p + back;
    end.box.Add(p);
  }
  end.box = Grown(end.box, kBeyond);
  return end;
}

// What lies behind an element or nearly in its plane. Of the distance within
// which MayCut takes a blocker for one in the plane, half is left to MayCut, so
// that rounding leaves nothing out that MayCut would keep.
HalfSpace BehindOf(const ShaftEnd& end, Box around) {
  constexpr float kNearM = CoplanarM(BlockerKind::kSurfaces) / 2;
  around.Add(end.on_plane);
  const Vec3f back = end.patch->normal * -1.0F;
  return HalfSpaceBeyond(back, Dot(back, end.on_plane) - kNearM, around);
}

}  // namespace

ShaftEnds EndsOf(const PatchGeometry& receiver,
                 ElementFrame receiver_frame,
                 const PatchGeometry& source,
                 ElementFrame source_frame) {
  return {EndOf(receiver, receiver_frame), EndOf(source, source_frame)};
}

ShaftEnds EndsOf(const PatchGeometry& receiver,
                 ElementFrame receiver_frame,
                 const Box& source) {
  return {EndOf(receiver, receiver_frame), EndOf(source)};
}

ShaftEnds AcrossPortals(const ShaftEnds& ends) {
  return {PutBack(ends.receiver), PutBack(ends.source)};
}

Shaft::Shaft(const ShaftEnds& between)
    : ends(between),
      hull(ends.receiver.box, ends.source.box),
      behind{BehindOf(ends.receiver, hull.Bounds()),
             ends.source.patch == nullptr
                 ? BehindOf(ends.receiver, hull.Bounds())
                 : BehindOf(ends.source, hull.Bounds())} {}

ShaftBlockers::ShaftBlockers(std::span<const PatchGeometry> patches,
                             BlockerKind kind)
    : ShaftBlockers(patches, kind, SpatialOrder(patches)) {}

ShaftBlockers::ShaftBlockers(std::span<const PatchGeometry> patches,
                             BlockerKind kind,
                             std::span<const size_t> order)
    : kind_(kind),
      coplanar_m_(CoplanarM(kind)),
      boxes_(BoxesOf(patches, order)) {
  points_.reserve(4 * patches.size());
  normals_.reserve(patches.size());
  for (const size_t i : order) {
    const Corners c = CornersOf(patches[i], {});
    for (size_t k = 0; k < 4; ++k) {
      points_.push_back(c.points[std::min(k, c.count - 1)]);
    }
    normals_.push_back(patches[i].normal);
  }
}

bool ShaftBlockers::MayCut(size_t i, const ShaftEnds& ends) const {
  const std::span<const Vec3f> blocker = CornersOfBlocker(i);
  const auto has_both_on = [&](float sign) {
    const auto has = [&](const ShaftEnd& end) {
      return AllOnSide(
          end.Corners(), blocker[0], normals_[i], sign, coplanar_m_);
    };
    return has(ends.receiver) && has(ends.source);
  };
  const auto is_behind = [&](const ShaftEnd& end) {
    return end.patch != nullptr &&
           AllOnSide(blocker, end.on_plane, end.patch->normal, -1, coplanar_m_);
  };
  return !has_both_on(1) && !has_both_on(-1) && !is_behind(ends.receiver) &&
         !is_behind(ends.source);
}

bool ShaftBlockers::MayHold(size_t i, const ShaftEnds& ends) const {
  const std::span<const Vec3f> portal = CornersOfBlocker(i);
  const Box opening = Grown(BoxAround(portal), kBeyond);
  const auto holds = [&](const ShaftEnd& end) {
    return end.patch != nullptr &&
           std::abs(Dot(end.patch->normal, normals_[i])) > kNearlyParallel &&
           opening.Overlaps(BoxAround(end.Corners())) &&
           !AllOnSide(portal, end.on_plane, end.patch->normal, -1, -kBeyond);
  };
  return holds(ends.receiver) || holds(ends.source);
}

bool ShaftBlockers::LeaveEmpty(const Shaft& shaft) const {
  const bool of_surfaces = kind_ == BlockerKind::kSurfaces;
  const auto reaches = [&](const BoxOctet& boxes) {
    const uint32_t bits = shaft.hull.Overlapping(boxes);
    // An end may stick out of a portal that lies behind it (MayHold).
    return of_surfaces && bits != 0 ? bits & ~boxes.WithinAny(shaft.behind)
                                    : bits;
  };
  return boxes_.VisitAll(reaches, [&](size_t i) {
    return !MayCut(i, shaft.ends) && (of_surfaces || !MayHold(i, shaft.ends));
  });
}

ShadowSum ShaftBlockers::SumOfShadows(const CastShadow& shadow,
                                      uint64_t enough) const {
  ShadowSum sum;
  boxes_.VisitAll([&](const BoxOctet& boxes) { return shadow.MayMeet(boxes); },
                  [&](size_t i) {
                    const std::span<const Vec3f> blocker = CornersOfBlocker(i);
                    (shadow.IsLit(blocker[0], normals_[i]) ? sum.of_fronts
                                                           : sum.of_backs) +=
                        shadow.ShareOf(blocker);
                    return sum.Larger() < enough;
                  });
  return sum;
}

uint64_t ShaftBlockers::BytesFor(size_t blockers) {
  return BoxOctets::BytesFor(blockers) + blockers * (4 + 1) * sizeof(Vec3f);
}

uint64_t ShaftBlockers::SizeBytes() const {
  return boxes_.SizeBytes() +
         (points_.size() + normals_.size()) * sizeof(Vec3f);
}

}  // namespace enfilade
