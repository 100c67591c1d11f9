// Pairs of points of two elements, one by one or a few at a time.

#pragma once

#include "base/random.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstddef>

namespace enfilade {

struct PointPair {
  Vec3f x;  // on the receiver
  Vec3f y;  // on the source
};

// A random point of an element.
Vec3f RandomPoint(const TransferEnd& end, Random* random);

// A random point of the part of an element that its node g stands for: a
// quarter of a parallelogram, or the third of a triangle nearest to a corner.
Vec3f PointNearNode(const TransferEnd& end, size_t g, Random* random);

// The unoccluded kernel between a point of each end, without the source's area:
// cos_x cos_y / (pi r^2), 1/m2.
float PointKernel(PointPair points,
                  const TransferEnd& receiver,
                  const TransferEnd& source);

// The number of pairs drawn together. Structures of arrays let them be
// processed side by side.
inline constexpr size_t kCandidates = 4;
using CandidateLanes = std::array<float, kCandidates>;

struct CandidatePoints {
  CandidateLanes x{}, y{}, z{};

  [[nodiscard]] Vec3f At(size_t i) const { return {x[i], y[i], z[i]}; }
};

struct PairCandidates {
  CandidatePoints x;  // on the receiver
  CandidatePoints y;  // on the source
  CandidateLanes kernels{};

  [[nodiscard]] PointPair At(size_t i) const { return {x.At(i), y.At(i)}; }
};

// Draws kCandidates pairs. The points are bit-identical to those of
// PointNearNode for the receiver's node g and the source's node q in turn, and
// the kernels to PointKernel.
PairCandidates DrawCandidates(const TransferEnd& receiver,
                              size_t g,
                              const TransferEnd& source,
                              size_t q,
                              Random* random);

}  // namespace enfilade
