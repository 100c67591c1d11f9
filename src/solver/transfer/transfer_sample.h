// Random points on the ends of a transfer, for rays between them.

#pragma once

#include "base/random.h"
#include "solver/transfer/point_pair.h"
#include "visibility/occlusion.h"

#include <cstddef>
#include <optional>
#include <span>

namespace enfilade {

// Where `share`, in [0, 1), of the sum of the weights is reached.
size_t IndexAtShare(std::span<const float> weights, float share);

// A pair of random points, one in the part of the receiver that its node g
// stands for, one in the part of the source that its node q does. Where the
// kernel varies much over the two elements, the pair is drawn by it: the near
// parts of close elements weigh more and are less occluded, so that uniform
// samples would make such transfers too dark. Light goes from one of the two to
// the other if nothing is between; nullopt where no such pair was found.
std::optional<PointPair> RandomPair(const TransferEnd& receiver,
                                    size_t g,
                                    const TransferEnd& source,
                                    size_t q,
                                    Random* random);

// Whether a small end is so close to an element, the larger one, that the
// kernel peaks in a part of it, which random points miss.
bool IsPeaked(float small_diameter, Vec3f small_center, const TransferEnd& end);

// Rays that are traced to where the kernel peaks.
inline constexpr size_t kPeakRays = 16;

// A pair drawn by the kernel: a random point of the smaller end, and where a
// random direction from it meets the larger one; nullopt if a few tries fail.
std::optional<PointPair> PairAtPeak(const TransferEnd& receiver,
                                    const TransferEnd& source,
                                    Random* random);

// A guess at the mean form factor of the receiver to the source without
// occlusion, unbiased, and one pair of points drawn by the kernel to ask
// whether light gets through.
struct SampledTransfer {
  float form_factor = 0;
  PointPair ray;
};

// From a point near each node: of both ends where they are far apart, and where
// they are near of the smaller one, with its exact form factor to the other.
SampledTransfer SampleTransfer(const TransferEnd& receiver,
                               const TransferEnd& source,
                               bool near,
                               Random* random);

void AddSegment(PointPair points, SegmentPacket* packet);

}  // namespace enfilade
