#include "solver/shaft.h"

#include <algorithm>
#include <numeric>

namespace enfilade {
namespace {

constexpr size_t kGroupSize = 8;
constexpr size_t kSuperGroupSize = 16;
// Coplanar is not between: tolerance on plane distances, m.
constexpr float kPlaneTolerance = 1e-4F;

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
  Box box;
  for (const PatchGeometry& p : patches) {
    box.Add(p.origin);
  }
  const auto cell = [](float v, float from, float to) {
    return static_cast<uint32_t>(1023 * (v - from) / (to - from + 1e-6F));
  };
  std::vector<uint32_t> codes(patches.size());
  for (size_t i = 0; i < patches.size(); ++i) {
    const Vec3f o = patches[i].origin;
    codes[i] = Morton(cell(o.x, box.low.x, box.high.x),
                      cell(o.y, box.low.y, box.high.y),
                      cell(o.z, box.low.z, box.high.z));
  }
  std::vector<size_t> order(patches.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return codes[a] < codes[b];
  });
  return order;
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

bool IsBehindSource(std::span<const Vec3f> blocker, const Shaft& shaft) {
  return shaft.source != nullptr &&
         AllOnSide(blocker, shaft.source->origin, shaft.source->normal, -1);
}

}  // namespace

Shaft ShaftBetween(const PatchGeometry& receiver,
                   ElementFrame receiver_frame,
                   const PatchGeometry& source,
                   ElementFrame source_frame) {
  Shaft shaft;
  shaft.receiver = &receiver;
  shaft.source = &source;
  const Corners r = CornersOf(receiver, receiver_frame);
  const Corners s = CornersOf(source, source_frame);
  for (const Corners* c : {&r, &s}) {
    for (const Vec3f p : c->View()) {
      shaft.ends[shaft.count++] = p;
      shaft.box.Add(p);
    }
  }
  return shaft;
}

Shaft ShaftBetween(const PatchGeometry& receiver,
                   ElementFrame receiver_frame,
                   const Box& source) {
  Shaft shaft;
  shaft.receiver = &receiver;
  const Corners r = CornersOf(receiver, receiver_frame);
  for (const Vec3f p : r.View()) {
    shaft.ends[shaft.count++] = p;
    shaft.box.Add(p);
  }
  const auto corner = [&](size_t i) {
    return Vec3f{(i & 1) != 0 ? source.high.x : source.low.x,
                 (i & 2) != 0 ? source.high.y : source.low.y,
                 (i & 4) != 0 ? source.high.z : source.low.z};
  };
  for (size_t i = 0; i < 8; ++i) {
    shaft.ends[shaft.count++] = corner(i);
  }
  shaft.box.Add(source);
  return shaft;
}

ShaftBlockers::ShaftBlockers(std::span<const PatchGeometry> patches) {
  for (const size_t i : SpatialOrder(patches)) {
    const Corners c = CornersOf(patches[i], {});
    Box box;
    for (size_t k = 0; k < 4; ++k) {
      points_.push_back(c.points[std::min(k, c.count - 1)]);
      box.Add(points_.back());
    }
    normals_.push_back(patches[i].normal);
    if (boxes_.size() % kGroupSize == 0) {
      groups_.push_back({{}, static_cast<uint32_t>(boxes_.size()), 0});
    }
    groups_.back().box.Add(box);
    ++groups_.back().count;
    boxes_.push_back(box);
    box_.Add(box);
  }
  for (size_t i = 0; i < groups_.size(); ++i) {
    if (i % kSuperGroupSize == 0) {
      supergroups_.push_back({{}, static_cast<uint32_t>(i), 0});
    }
    supergroups_.back().box.Add(groups_[i].box);
    ++supergroups_.back().count;
  }
}

bool ShaftBlockers::MayCut(size_t i, const Shaft& shaft) const {
  const auto both = std::span<const Vec3f>(shaft.ends).first(shaft.count);
  const std::span<const Vec3f> blocker = CornersOfBlocker(i);
  return !AllOnSide(both, blocker[0], normals_[i], 1) &&
         !AllOnSide(both, blocker[0], normals_[i], -1) &&
         !AllOnSide(
             blocker, shaft.receiver->origin, shaft.receiver->normal, -1) &&
         !IsBehindSource(blocker, shaft);
}

template <typename Misses, typename Visit>
bool ShaftBlockers::VisitGroup(const Group& group,
                               const Misses& misses,
                               const Visit& visit) const {
  if (misses(group.box)) {
    return true;
  }
  for (uint32_t i = group.first; i < group.first + group.count; ++i) {
    if (!misses(boxes_[i]) && !visit(i)) {
      return false;
    }
  }
  return true;
}

template <typename Misses, typename Visit>
bool ShaftBlockers::VisitAll(const Misses& misses, const Visit& visit) const {
  if (misses(box_)) {
    return true;
  }
  for (const Group& super : supergroups_) {
    if (misses(super.box)) {
      continue;
    }
    for (uint32_t g = super.first; g < super.first + super.count; ++g) {
      if (!VisitGroup(groups_[g], misses, visit)) {
        return false;
      }
    }
  }
  return true;
}

bool ShaftBlockers::LeaveEmpty(const Shaft& shaft) const {
  return VisitAll([&](const Box& box) { return !shaft.box.Overlaps(box); },
                  [&](size_t i) { return !MayCut(i, shaft); });
}

ShadowSum ShaftBlockers::SumOfShadows(const CastShadow& shadow,
                                      uint64_t enough) const {
  ShadowSum sum;
  VisitAll([&](const Box& box) { return shadow.Misses(box); },
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
  const size_t groups = (blockers + kGroupSize - 1) / kGroupSize;
  const size_t supergroups = (groups + kSuperGroupSize - 1) / kSuperGroupSize;
  return (groups + supergroups) * sizeof(Group) +
         blockers * (sizeof(Box) + (4 + 1) * sizeof(Vec3f));
}

uint64_t ShaftBlockers::SizeBytes() const {
  return (groups_.size() + supergroups_.size()) * sizeof(Group) +
         boxes_.size() * sizeof(Box) +
         (points_.size() + normals_.size()) * sizeof(Vec3f);
}

}  // namespace enfilade
