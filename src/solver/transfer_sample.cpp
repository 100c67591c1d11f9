#include "solver/transfer_sample.h"

#include <algorithm>
#include <array>

namespace enfilade {
namespace {

// A random point in the part of an element that node g stands for: a quarter
// of a parallelogram, the third of a triangle nearest to a corner.
Vec3f PointNearNode(const TransferEnd& end, size_t g, Random* random) {
  float s = static_cast<float>(random->Next());
  float t = static_cast<float>(random->Next());
  if (end.node_count == 4) {
    s = 0.5F * (s + static_cast<float>(g & 1));
    t = 0.5F * (t + static_cast<float>(g >> 1));
    return PointOn(*end.patch, end.frame, s, t);
  }
  if (s + t > 1) {
    s = 1 - s;
    t = 1 - t;
  }
  // Nodes 0, 1, 2 lie near the corners of weight (1 - s - t), s, t.
  std::array<float, 3> corner = {1 - s - t, s, t};
  const size_t largest = static_cast<size_t>(
      std::max_element(corner.begin(), corner.end()) - corner.begin());
  std::swap(corner[largest], corner[g]);
  return PointOn(*end.patch, end.frame, corner[1], corner[2]);
}

// The kernel varies much over the two elements.
bool AreClose(const TransferEnd& r, const TransferEnd& s) {
  return Length(s.center - r.center) < 2.0F * std::max(r.diameter, s.diameter);
}

// One of a few candidates, drawn by the kernel.
PointPair PairByKernel(const TransferEnd& r,
                       size_t g,
                       const TransferEnd& s,
                       size_t q,
                       Random* random) {
  constexpr size_t kCandidates = 4;
  std::array<PointPair, kCandidates> candidates;
  std::array<float, kCandidates> sums{};
  float sum = 0;
  for (size_t i = 0; i < kCandidates; ++i) {
    candidates[i] = {PointNearNode(r, g, random), PointNearNode(s, q, random)};
    sum += PointKernel(candidates[i], r, s) + 1e-20F;
    sums[i] = sum;
  }
  const float pick = sum * static_cast<float>(random->Next());
  size_t i = 0;
  while (i + 1 < kCandidates && sums[i] < pick) {
    ++i;
  }
  return candidates[i];
}

}  // namespace

Vec3f RandomPoint(const TransferEnd& end, Random* random) {
  return PointNearNode(
      end, random->NextBelow(static_cast<uint32_t>(end.node_count)), random);
}

PointPair RandomPair(const TransferEnd& receiver,
                     size_t g,
                     const TransferEnd& source,
                     size_t q,
                     Random* random) {
  if (AreClose(receiver, source)) {
    return PairByKernel(receiver, g, source, q, random);
  }
  const Vec3f x = PointNearNode(receiver, g, random);
  return {x, PointNearNode(source, q, random)};
}

float PointKernel(PointPair points,
                  const TransferEnd& receiver,
                  const TransferEnd& source) {
  const Vec3f d = points.y - points.x;
  const float r2 = Dot(d, d) + 1e-12F;
  return std::max(0.0F, Dot(d, receiver.patch->normal)) *
         std::max(0.0F, -Dot(d, source.patch->normal)) /
         (static_cast<float>(kPi) * r2 * r2);
}

void AddSegment(PointPair points, SegmentPacket* packet) {
  const uint32_t i = packet->count++;
  packet->from_x[i] = points.x.x;
  packet->from_y[i] = points.x.y;
  packet->from_z[i] = points.x.z;
  packet->to_x[i] = points.y.x;
  packet->to_y[i] = points.y.y;
  packet->to_z[i] = points.y.z;
}

}  // namespace enfilade
