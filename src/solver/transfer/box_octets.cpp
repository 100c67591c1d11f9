#include "solver/transfer/box_octets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace enfilade {
namespace {

size_t OctetsFor(size_t count) {
  return (count + BoxOctet::kCount - 1) / BoxOctet::kCount;
}

}  // namespace

HalfSpace HalfSpaceBeyond(Vec3f normal, float offset, const Box& bounds) {
  // Three products and two sums are rounded, once for the offset and once for
  // the point.
  constexpr float kRounding = 8 * std::numeric_limits<float>::epsilon();
  const auto farthest = [](float n, float low, float high) {
    return std::abs(n) * std::max(std::abs(low), std::abs(high));
  };
  return {
      normal,
      offset + kRounding * (farthest(normal.x, bounds.low.x, bounds.high.x) +
                            farthest(normal.y, bounds.low.y, bounds.high.y) +
                            farthest(normal.z, bounds.low.z, bounds.high.z))};
}

BoxOctet::BoxOctet() {
  for (size_t i = 0; i < kCount; ++i) {
    Set(i, Box{});
  }
}

void BoxOctet::Set(size_t i, const Box& box) {
  for (size_t axis = 0; axis < 3; ++axis) {
    low[axis][i] = box.low[axis];
    high[axis][i] = box.high[axis];
  }
}

BoxOctets::BoxOctets(std::span<const Box> boxes) {
  std::vector<Box> below(boxes.begin(), boxes.end());
  octets_.reserve(BytesFor(boxes.size()) / sizeof(BoxOctet));
  while (!below.empty() && (levels_.empty() || below.size() > 1)) {
    levels_.push_back({octets_.size(), below.size()});
    std::vector<Box> unions(OctetsFor(below.size()));
    for (size_t i = 0; i < below.size(); ++i) {
      if (i % BoxOctet::kCount == 0) {
        octets_.emplace_back();
      }
      octets_.back().Set(i % BoxOctet::kCount, below[i]);
      unions[i / BoxOctet::kCount].Add(below[i]);
    }
    below = std::move(unions);
  }
}

uint64_t BoxOctets::SizeBytes() const {
  return octets_.size() * sizeof(BoxOctet);
}

uint64_t BoxOctets::BytesFor(size_t boxes) {
  uint64_t octets = OctetsFor(boxes);
  for (size_t count = octets; count > 1; count = OctetsFor(count)) {
    octets += OctetsFor(count);
  }
  return octets * sizeof(BoxOctet);
}

}  // namespace enfilade
