// Random points on the ends of a transfer, for rays between them.

#pragma once

#include "base/random.h"
#include "solver/transfer/point_pair.h"
#include "visibility/occlusion.h"

#include <cstddef>
#include <optional>
#include <span>

namespace enfilade {

// The index at which the running sum of the weights reaches the fraction
// `share`, in [0, 1], of their total, which is not zero. Its weight is not zero
// either. (A double below 1 may become a float of 1.)
size_t IndexAtShare(std::span<const float> weights, float share);

// A pair of random points: one in the part of the receiver that its node g
// stands for, one in the part of the source that its node q stands for. If the
// kernel varies much over the two elements, the pair is drawn in proportion to
// the kernel: the near parts of close elements weigh more and are less
// occluded, so that uniform samples would make such transfers too dark. The
// kernel of the pair is positive; nullopt if no such pair was found.
std::optional<PointPair> RandomPair(const TransferEnd& receiver,
                                    size_t g,
                                    const TransferEnd& source,
                                    size_t q,
                                    Random* random);

// Whether an end is so small and so close to a larger end that the kernel peaks
// in a part of the larger end that random points miss.
bool IsPeaked(float small_diameter, Vec3f small_center, const TransferEnd& end);

// The number of rays traced to the peak of a kernel.
inline constexpr size_t kPeakRays = 16;

// A pair drawn in proportion to the kernel: a random point of the smaller end,
// and the point where a random direction from there meets the larger end;
// nullopt if a few tries fail.
std::optional<PointPair> PairAtPeak(const TransferEnd& receiver,
                                    const TransferEnd& source,
                                    Random* random);

// An estimate of the mean form factor from the receiver to the source without
// occlusion, unbiased over all but the rim of the ends that random points keep
// off (TransferEnd::rim), and a pair of points, drawn in proportion to the
// kernel, between which a ray tests whether light gets through.
struct SampledTransfer {
  float form_factor = 0;
  PointPair ray;
};

// Samples a point near each node: of both ends if they are far apart; of the
// smaller end if they are near, with the exact form factor of each point to the
// larger end.
SampledTransfer SampleTransfer(const TransferEnd& receiver,
                               const TransferEnd& source,
                               bool near,
                               Random* random);

void AddSegment(PointPair points, SegmentPacket* packet);

}  // namespace enfilade
