#include "solver/cast_shadow.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace enfilade {
namespace {

// What is nearer to the receiver's plane than this lies in it, m.
constexpr float kInPlaneM = 1e-4F;
// Of the height of the light: what is higher does not stand before it.
constexpr float kBelowLight = 0.98F;

// A corner of a blocker: its height over the receiver's plane, and where on
// that plane it is, in coordinates of the element.
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
// Rounding may make it a little concave; corners for which there is no room
// then are left out.
struct Outline {
  static constexpr size_t kMost = 12;

  std::array<Corner, kMost> corners{};
  size_t count = 0;

  void Add(const Corner& corner) {
    if (count < kMost) {
      corners[count++] = corner;
    }
  }

  // The part of it where distance(corner), which is linear, is not negative.
  template <typename Distance>
  [[nodiscard]] Outline ClippedTo(const Distance& distance) const {
    Outline kept;
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
    return kept;
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

  // Wholly beyond one side of the unit square.
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
  const auto add = [this](Vec3f normal, Vec3f on_plane) {
    within_[half_spaces_++] = {normal, Dot(normal, on_plane)};
  };
  add(patch.normal, patch.origin);
  add(patch.normal * -1.0F, light);
  const Corners corners = CornersOf(patch, receiver.frame);
  for (size_t i = 0; i < corners.count; ++i) {
    const Vec3f p = corners.points[i];
    const Vec3f q = corners.points[i + 1 < corners.count ? i + 1 : 0];
    const Vec3f normal = Cross(q - p, light - p);
    const float sign = Dot(receiver.center - p, normal) < 0 ? -1.0F : 1.0F;
    add(normal * sign, p);
  }
}

bool CastShadow::Misses(const Box& box) const {
  const Vec3f middle = (box.low + box.high) * 0.5F;
  const Vec3f half = (box.high - box.low) * 0.5F;
  return std::any_of(
      within_.begin(), within_.begin() + half_spaces_, [&](const HalfSpace& h) {
        const float reach = half.x * std::abs(h.normal.x) +
                            half.y * std::abs(h.normal.y) +
                            half.z * std::abs(h.normal.z);
        return Dot(middle, h.normal) + reach < h.offset;
      });
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
  Outline outline;
  for (const Vec3f p : blocker) {
    outline.Add(place(p));
  }
  outline =
      outline.ClippedTo([](const Corner& p) { return p.height - kInPlaneM; });
  outline =
      outline.ClippedTo([most](const Corner& p) { return most - p.height; });
  const Corner from = place(light_);
  for (size_t i = 0; i < outline.count; ++i) {
    Corner& p = outline.corners[i];
    p = Between(from, p, from.height / (from.height - p.height));
  }
  if (outline.count < 3 || outline.MissesUnitSquare()) {
    return 0;
  }
  outline = outline.ClippedTo([](const Corner& p) { return p.a; });
  outline = outline.ClippedTo([](const Corner& p) { return p.b; });
  const bool is_triangle = patch.shape == PatchShape::kTriangle;
  if (is_triangle) {
    outline = outline.ClippedTo([](const Corner& p) { return 1 - p.a - p.b; });
  } else {
    outline = outline.ClippedTo([](const Corner& p) { return 1 - p.a; });
    outline = outline.ClippedTo([](const Corner& p) { return 1 - p.b; });
  }
  const float share = (is_triangle ? 2.0F : 1.0F) * outline.Area();
  // Degenerate ends give no number.
  return share > 0 ? static_cast<uint32_t>(std::min(share, 1.0F) *
                                           static_cast<float>(kWhole))
                   : 0;
}

}  // namespace enfilade
