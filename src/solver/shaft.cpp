#include "solver/shaft.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace enfilade {
namespace {

constexpr size_t kGroupSize = 8;
constexpr size_t kSuperGroupSize = 16;
// Coplanar is not between: tolerance on plane distances, m.
constexpr float kPlaneTolerance = 1e-4F;

Vec3f Min(Vec3f a, Vec3f b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}

Vec3f Max(Vec3f a, Vec3f b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

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

std::vector<size_t> SpatialOrder(std::span<const PatchGeometry> patches) {
  Vec3f low{1e30F, 1e30F, 1e30F};
  Vec3f high{-1e30F, -1e30F, -1e30F};
  for (const PatchGeometry& p : patches) {
    low = Min(low, p.origin);
    high = Max(high, p.origin);
  }
  const auto cell = [](float v, float from, float to) {
    return static_cast<uint32_t>(1023 * (v - from) / (to - from + 1e-6F));
  };
  std::vector<uint32_t> codes(patches.size());
  for (size_t i = 0; i < patches.size(); ++i) {
    const Vec3f o = patches[i].origin;
    codes[i] = Morton(cell(o.x, low.x, high.x),
                      cell(o.y, low.y, high.y),
                      cell(o.z, low.z, high.z));
  }
  std::vector<size_t> order(patches.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return codes[a] < codes[b];
  });
  return order;
}

bool Overlap(Vec3f low_a, Vec3f high_a, Vec3f low_b, Vec3f high_b) {
  return low_a.x <= high_b.x && low_b.x <= high_a.x && low_a.y <= high_b.y &&
         low_b.y <= high_a.y && low_a.z <= high_b.z && low_b.z <= high_a.z;
}

// All points on one (closed) side of the plane; `sign` +1: in front.
bool AllOnSide(std::span<const Vec3f> points,
               Vec3f on_plane,
               Vec3f normal,
               float sign) {
  return std::all_of(points.begin(), points.end(), [&](Vec3f p) {
    return sign * Dot(p - on_plane, normal) >= -kPlaneTolerance;
  });
}

}  // namespace

ShaftBlockers::ShaftBlockers(std::span<const PatchGeometry> patches) {
  for (const size_t i : SpatialOrder(patches)) {
    const Corners c = CornersOf(patches[i], {});
    Box box{c.points[0], c.points[0]};
    for (size_t k = 0; k < 4; ++k) {
      const Vec3f p = c.points[std::min(k, c.count - 1)];
      points_.push_back(p);
      box = {Min(box.low, p), Max(box.high, p)};
    }
    normals_.push_back(patches[i].normal);
    if (boxes_.size() % kGroupSize == 0) {
      groups_.push_back({box, static_cast<uint32_t>(boxes_.size()), 0});
    }
    Group& group = groups_.back();
    group.box = {Min(group.box.low, box.low), Max(group.box.high, box.high)};
    ++group.count;
    boxes_.push_back(box);
  }
  for (size_t i = 0; i < groups_.size(); ++i) {
    if (i % kSuperGroupSize == 0) {
      supergroups_.push_back({groups_[i].box, static_cast<uint32_t>(i), 0});
    }
    Group& super = supergroups_.back();
    super.box = {Min(super.box.low, groups_[i].box.low),
                 Max(super.box.high, groups_[i].box.high)};
    ++super.count;
  }
}

struct ShaftBlockers::Shaft {
  const PatchGeometry* receiver = nullptr;
  const PatchGeometry* source = nullptr;
  std::array<Vec3f, 8> ends;  // the corners of both
  size_t count = 0;
  Vec3f low;
  Vec3f high;
};

bool ShaftBlockers::IsClearOf(const Group& group, const Shaft& shaft) const {
  const auto both = std::span<const Vec3f>(shaft.ends).first(shaft.count);
  for (uint32_t i = group.first; i < group.first + group.count; ++i) {
    const auto blocker = std::span<const Vec3f>(&points_[size_t{4} * i], 4);
    if (Overlap(shaft.low, shaft.high, boxes_[i].low, boxes_[i].high) &&
        !AllOnSide(both, blocker[0], normals_[i], 1) &&
        !AllOnSide(both, blocker[0], normals_[i], -1) &&
        !AllOnSide(
            blocker, shaft.receiver->origin, shaft.receiver->normal, -1) &&
        !AllOnSide(blocker, shaft.source->origin, shaft.source->normal, -1)) {
      return false;
    }
  }
  return true;
}

bool ShaftBlockers::IsEmptyBetween(const PatchGeometry& receiver,
                                   ElementFrame receiver_frame,
                                   const PatchGeometry& source,
                                   ElementFrame source_frame) const {
  const Corners r = CornersOf(receiver, receiver_frame);
  const Corners s = CornersOf(source, source_frame);
  Shaft shaft{&receiver, &source, {}, 0, r.points[0], r.points[0]};
  for (const Corners* c : {&r, &s}) {
    for (const Vec3f p : c->View()) {
      shaft.ends[shaft.count++] = p;
      shaft.low = Min(shaft.low, p);
      shaft.high = Max(shaft.high, p);
    }
  }
  for (const Group& super : supergroups_) {
    if (!Overlap(shaft.low, shaft.high, super.box.low, super.box.high)) {
      continue;
    }
    for (uint32_t i = super.first; i < super.first + super.count; ++i) {
      const Group& group = groups_[i];
      if (Overlap(shaft.low, shaft.high, group.box.low, group.box.high) &&
          !IsClearOf(group, shaft)) {
        return false;
      }
    }
  }
  return true;
}

uint64_t ShaftBlockers::SizeBytes() const {
  return (groups_.size() + supergroups_.size()) * sizeof(Group) +
         boxes_.size() * sizeof(Box) +
         (points_.size() + normals_.size()) * sizeof(Vec3f);
}

}  // namespace enfilade
