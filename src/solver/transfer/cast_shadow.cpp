#include "solver/transfer/cast_shadow.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace enfilade {
namespace {

// Points nearer to the receiver's plane than this, m, count as lying in it.
constexpr float kInPlaneM = 1e-4F;
// Only the parts of a blocker below this share of the light's height cast a
// shadow.
constexpr float kBelowLight = 0.98F;

// A corner of a blocker: its height over the receiver's plane, and its foot in
// that plane in coordinates of the element.
struct Corner {
  float height = 0;
  float a = 0;
  float b = 0;
};

Corner Between(const Corner& p, const Corner& q, float t) {
  return {p.height + t * (q.height - p.height),
          p.a + t * (q.a - p.a),
          p.b + t * (q.b - p.b)};
}

// A convex polygon of few corners: four, and one more for each of six cuts.
// Rounding may make the polygon slightly concave; corners beyond kMost are then
// left out.
struct ShadowOutline {
  static constexpr size_t kMost = 12;

  std::array<Corner, kMost> corners{};
  size_t count = 0;

  void Add(const Corner& corner) {
    if (count < kMost) {
      corners[count++] = corner;
    }
  }

  // Clips the polygon to the part where distance(corner), a linear function, is
  // not negative.
  template <typename Distance>
  void ClipTo(const Distance& distance) {
    const bool is_within =
        std::all_of(corners.begin(),
                    corners.begin() + static_cast<std::ptrdiff_t>(count),
                    [&](const Corner& p) { return distance(p) >= 0; });
    if (is_within) {
      return;
    }
    ShadowOutline kept;
    for (size_t i = 0; i < count; ++i) {
      const Corner& p = corners[i];
      const Corner& q = corners[i + 1 < count ? i + 1 : 0];
      const float at_p = distance(p);
      const float at_q = distance(q);
      if (at_p >= 0) {
        kept.Add(p);
      }
      if ((at_p < 0) != (at_q < 0)) {
        kept.Add(Between(p, q, at_p / (at_p - at_q)));
      }
    }
    *this = kept;
  }

  [[nodiscard]] float Area() const {
    float twice = 0;
    for (size_t i = 0; i < count; ++i) {
      const Corner& p = corners[i];
      const Corner& q = corners[i + 1 < count ? i + 1 : 0];
      twice += p.a * q.b - q.a * p.b;
    }
    return 0.5F * std::abs(twice);
  }

  // Whether the polygon lies wholly beyond one side of the unit square.
  [[nodiscard]] bool MissesUnitSquare() const {
    const auto all = [this](const auto& is_beyond) {
      return std::all_of(corners.begin(),
                         corners.begin() + static_cast<std::ptrdiff_t>(count),
                         is_beyond);
    };
    return all([](const Corner& p) { return p.a <= 0; }) ||
           all([](const Corner& p) { return p.b <= 0; }) ||
           all([](const Corner& p) { return p.a >= 1; }) ||
           all([](const Corner& p) { return p.b >= 1; });
  }
};

}  // namespace

CastShadow::CastShadow(const TransferEnd& receiver, Vec3f light)
    : receiver_(&receiver), light_(light) {
  const PatchGeometry& patch = *receiver.patch;
  height_ = Dot(light - patch.origin, patch.normal);
  const Vec3f cross = Cross(patch.u, patch.v);
  const float square = Dot(cross, cross);
  along_a_ = Cross(patch.v, cross) * (1 / square);
  along_b_ = Cross(cross, patch.u) * (1 / square);
  size_t planes = 0;
  const auto add = [&](Vec3f normal, Vec3f on_plane) {
    const Vec3f reach{
        std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)};
    within_[planes++] = {normal, reach, Dot(normal, on_plane)};
  };
  add(patch.normal, patch.origin);
  add(patch.normal * -1.0F, light);
  const Corners corners = CornersOf(patch, receiver.frame);
  around_.Add(light);
  for (size_t i = 0; i < corners.count; ++i) {
    const Vec3f p = corners.points[i];
    around_.Add(p);
    const Vec3f q = corners.points[i + 1 < corners.count ? i + 1 : 0];
    const Vec3f normal = Cross(q - p, light - p);
    const float sign = Dot(receiver.center - p, normal) < 0 ? -1.0F : 1.0F;
    add(normal * sign, p);
  }
}

bool CastShadow::Misses(const Box& box) const {
  BoxOctet boxes;
  boxes.Set(0, box);
  return (MayMeet(boxes) & 1) == 0;
}

uint32_t CastShadow::MayMeet(const BoxOctet& boxes) const {
  const uint32_t near = boxes.Overlapping(around_);
  if (near == 0) {
    return 0;
  }
  uint32_t bits = 0;
  for (size_t i = 0; i < BoxOctet::kCount; ++i) {  // becomes vector code
    const float middle_x = (boxes.low[0][i] + boxes.high[0][i]) * 0.5F;
    const float middle_y = (boxes.low[1][i] + boxes.high[1][i]) * 0.5F;
    const float middle_z = (boxes.low[2][i] + boxes.high[2][i]) * 0.5F;
    const float half_x = (boxes.high[0][i] - boxes.low[0][i]) * 0.5F;
    const float half_y = (boxes.high[1][i] - boxes.low[1][i]) * 0.5F;
    const float half_z = (boxes.high[2][i] - boxes.low[2][i]) * 0.5F;
    uint32_t meets = BoxOctet::kBits[i];
    for (const Side& h : within_) {
      const float most =
          middle_x * h.normal.x + middle_y * h.normal.y +
          middle_z * h.normal.z +
          (half_x * h.reach.x + half_y * h.reach.y + half_z * h.reach.z);
      meets &= most < h.offset ? 0U : ~0U;
    }
    bits |= meets;
  }
  return bits & near;
}

uint32_t CastShadow::ShareOf(std::span<const Vec3f> blocker) const {
  const PatchGeometry& patch = *receiver_->patch;
  const float most = kBelowLight * height_;
  if (most <= kInPlaneM) {
    return 0;
  }
  const ElementFrame& frame = receiver_->frame;
  const auto place = [&](Vec3f p) {
    const Vec3f d = p - patch.origin;
    return Corner{Dot(d, patch.normal),
                  (Dot(d, along_a_) - frame.a) / frame.scale,
                  (Dot(d, along_b_) - frame.b) / frame.scale};
  };
  ShadowOutline outline;
  for (const Vec3f p : blocker) {
    outline.Add(place(p));
  }
  outline.ClipTo([](const Corner& p) { return p.height - kInPlaneM; });
  outline.ClipTo([most](const Corner& p) { return most - p.height; });
  const Corner from = place(light_);
  for (size_t i = 0; i < outline.count; ++i) {
    Corner& p = outline.corners[i];
    p = Between(from, p, from.height / (from.height - p.height));
  }
  if (outline.count < 3 || outline.MissesUnitSquare()) {
    return 0;
  }
  outline.ClipTo([](const Corner& p) { return p.a; });
  outline.ClipTo([](const Corner& p) { return p.b; });
  const bool is_triangle = patch.shape == PatchShape::kTriangle;
  if (is_triangle) {
    outline.ClipTo([](const Corner& p) { return 1 - p.a - p.b; });
  } else {
    outline.ClipTo([](const Corner& p) { return 1 - p.a; });
    outline.ClipTo([](const Corner& p) { return 1 - p.b; });
  }
  const float share = (is_triangle ? 2.0F : 1.0F) * outline.Area();
  // A degenerate receiver gives NaN.
  return share > 0 ? static_cast<uint32_t>(std::min(share, 1.0F) *
                                           static_cast<float>(kWhole))
                   : 0;
}

}  // namespace enfilade
