#include "solver/transfer/transfer_sample.h"

#include "base/photometry.h"
#include "solver/transfer/cosine_directions.h"
#include "solver/transfer/fit_residual.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>

namespace enfilade {
namespace {

// Whether the ends are so close that the kernel varies much over them.
bool AreClose(const TransferEnd& r, const TransferEnd& s) {
  return Length(s.center - r.center) < 2.0F * std::max(r.diameter, s.diameter);
}

// Whether a point in an element's plane lies on the element, off the rim.
bool IsOn(const TransferEnd& end, Vec3f p) {
  const PatchGeometry& patch = *end.patch;
  const Vec3f u = patch.u * end.frame.scale;
  const Vec3f v = patch.v * end.frame.scale;
  const Vec3f d = p - PointOn(patch, end.frame, 0, 0);
  const Vec3f n = Cross(u, v);
  const float square = std::max(Dot(n, n), 1e-30F);
  const float s = Dot(Cross(d, v), n) / square;
  const float t = Dot(Cross(u, d), n) / square;
  const float rim = end.rim;
  const float most = patch.shape == PatchShape::kTriangle ? 1 - s : 1.0F;
  return s > rim && t > rim && s < 1 - rim && t < most - rim;
}

// Draws an index in proportion to the weights, whose sum is not zero.
size_t DrawByWeight(std::span<const float> weights, Random* random) {
  return IndexAtShare(weights, static_cast<float>(random->Next()));
}

// The form factor from a point of `end` to all of `other`.
float PointFormFactor(Vec3f p,
                      const TransferEnd& end,
                      const TransferEnd& other) {
  if (Dot(p - other.center, other.patch->normal) <= 0) {
    return 0;
  }
  const Corners corners = CornersOf(*other.patch, other.frame);
  return PointToPolygon(p, end.patch->normal, corners.View());
}

// The part of an element above the horizon of a point, as a triangle fan.
class SeenPart {
 public:
  SeenPart(const TransferEnd& end, Vec3f p, Vec3f normal) : rim_(end.rim) {
    const Corners corners = CornersOf(*end.patch, end.frame);
    const auto view = corners.View();
    for (size_t i = 0; i < view.size(); ++i) {
      const Vec3f a = view[i];
      const Vec3f b = view[(i + 1) % view.size()];
      const float above_a = Dot(a - p, normal);
      const float above_b = Dot(b - p, normal);
      if (above_a > 0) {
        Append(a);
      }
      if ((above_a > 0) != (above_b > 0)) {
        Append(a + (b - a) * (above_a / (above_a - above_b)));
      }
    }
    for (size_t i = 0; i + 2 < count_; ++i) {
      areas_[i] = Length(
          Cross(points_[i + 1] - points_[0], points_[i + 2] - points_[0]));
    }
  }

  [[nodiscard]] bool IsEmpty() const { return count_ < 3; }

  // A random point of the part, off the rim.
  Vec3f Draw(Random* random) const {
    const size_t i = DrawByWeight(std::span(areas_).first(count_ - 2), random);
    const auto [a, b] = random->NextTwo();
    const auto [s, t] = FoldedOnto(PatchShape::kTriangle, a, b);
    const Vec3f drawn = points_[0] + (points_[i + 1] - points_[0]) * s +
                        (points_[i + 2] - points_[0]) * t;
    return drawn +
           (center_ * (1.0F / static_cast<float>(count_)) - drawn) * (2 * rim_);
  }

 private:
  // Rounding may put four corners above and below the horizon in turn: each
  // edge then adds its crossing.
  static constexpr size_t kMostCorners = 8;

  void Append(Vec3f p) {
    points_.at(count_++) = p;
    center_ = center_ + p;
  }

  float rim_;
  size_t count_ = 0;
  std::array<Vec3f, kMostCorners> points_;
  std::array<float, kMostCorners> areas_{};
  Vec3f center_;  // the sum of the points
};

// A pair whose second point is above the horizon of the first, for sources that
// lie mostly behind the receiver. nullopt if no such pair is found.
std::optional<PointPair> PairAboveHorizon(const TransferEnd& r,
                                          size_t g,
                                          const TransferEnd& s,
                                          Random* random) {
  constexpr int kTrials = 4;
  for (int i = 0; i < kTrials; ++i) {
    const Vec3f x = PointNearNode(r, g, random);
    const SeenPart seen(s, x, r.patch->normal);
    if (!seen.IsEmpty()) {
      const PointPair pair = {x, seen.Draw(random)};
      if (PointKernel(pair, r, s) > 0) {
        return pair;
      }
    }
  }
  return std::nullopt;
}

// One of a few candidate pairs, drawn in proportion to the kernel.
std::optional<PointPair> PairByKernel(const TransferEnd& r,
                                      size_t g,
                                      const TransferEnd& s,
                                      size_t q,
                                      Random* random) {
  const PairCandidates candidates = DrawCandidates(r, g, s, q, random);
  const auto& kernels = candidates.kernels;
  if (std::accumulate(kernels.begin(), kernels.end(), 0.0F) > 0) {
    return candidates.At(DrawByWeight(kernels, random));
  }
  return PairAboveHorizon(r, g, s, random);
}

// Samples points of the smaller end, each with its form factor to the larger
// end.
SampledTransfer SampleNear(const TransferEnd& r,
                           const TransferEnd& s,
                           Random* random) {
  const bool from_receiver = r.area <= s.area;
  const TransferEnd& small = from_receiver ? r : s;
  const TransferEnd& large = from_receiver ? s : r;
  std::array<Vec3f, kTransferNodes> points;
  std::array<float, kTransferNodes> factors{};
  float sum = 0;
  for (size_t k = 0; k < small.node_count; ++k) {
    points[k] = PointNearNode(small, k, random);
    factors[k] = PointFormFactor(points[k], small, large);
    sum += factors[k];
  }
  SampledTransfer sample;
  if (!(sum > 0)) {
    return sample;
  }
  sample.form_factor = sum / static_cast<float>(small.node_count) *
                       (from_receiver ? 1.0F : s.area / r.area);
  const Vec3f p =
      points[DrawByWeight(std::span(factors).first(small.node_count), random)];
  const SeenPart seen(large, p, small.patch->normal);
  if (seen.IsEmpty()) {
    return {};
  }
  std::array<PointPair, kTransferNodes> pairs;
  std::array<float, kTransferNodes> kernels{};
  for (size_t k = 0; k < kTransferNodes; ++k) {
    const Vec3f other = seen.Draw(random);
    pairs[k] = from_receiver ? PointPair{p, other} : PointPair{other, p};
    kernels[k] = PointKernel(pairs[k], r, s) + 1e-20F;
  }
  sample.ray = pairs[DrawByWeight(kernels, random)];
  return sample;
}

// Samples pairs of points, one pair near each node of the receiver.
SampledTransfer SampleFar(const TransferEnd& r,
                          const TransferEnd& s,
                          Random* random) {
  std::array<PointPair, kTransferNodes> pairs;
  std::array<float, kTransferNodes> kernels{};
  float sum = 0;
  const size_t turn = random->NextBelow(static_cast<uint32_t>(s.node_count));
  for (size_t g = 0; g < r.node_count; ++g) {
    const size_t q = (g + turn) % s.node_count;
    pairs[g] = {PointNearNode(r, g, random), PointNearNode(s, q, random)};
    kernels[g] = PointKernel(pairs[g], r, s);
    sum += kernels[g];
  }
  if (!(sum > 0)) {
    return {};
  }
  return {s.area * sum / static_cast<float>(r.node_count),
          pairs[DrawByWeight(std::span(kernels).first(r.node_count), random)]};
}

}  // namespace

size_t IndexAtShare(std::span<const float> weights, float share) {
  float rest = std::accumulate(weights.begin(), weights.end(), 0.0F) * share;
  size_t i = 0;
  while (i + 1 < weights.size() && rest >= weights[i]) {
    rest -= weights[i++];
  }
  // A share of 1, or rounding, may lead past the last weight.
  while (i > 0 && !(weights[i] > 0)) {
    --i;
  }
  return i;
}

std::optional<PointPair> RandomPair(const TransferEnd& receiver,
                                    size_t g,
                                    const TransferEnd& source,
                                    size_t q,
                                    Random* random) {
  if (!AreClose(receiver, source)) {
    const Vec3f x = PointNearNode(receiver, g, random);
    const PointPair pair = {x, PointNearNode(source, q, random)};
    if (PointKernel(pair, receiver, source) > 0) {
      return pair;
    }
  }
  return PairByKernel(receiver, g, source, q, random);
}

bool IsPeaked(float small_diameter,
              Vec3f small_center,
              const TransferEnd& end) {
  if (2 * small_diameter >= end.diameter) {
    return false;
  }
  const UnitPoint at = NearestOn(end, small_center);
  const Vec3f foot = PointOn(*end.patch,
                             end.frame,
                             static_cast<float>(at.a),
                             static_cast<float>(at.b));
  return 2 * Length(small_center - foot) < end.diameter;
}

std::optional<PointPair> PairAtPeak(const TransferEnd& receiver,
                                    const TransferEnd& source,
                                    Random* random) {
  constexpr int kTrials = 4;
  const bool from_source = source.diameter < receiver.diameter;
  const TransferEnd& small = from_source ? source : receiver;
  const TransferEnd& large = from_source ? receiver : source;
  const CosineDirections directions(*small.patch);
  for (int i = 0; i < kTrials; ++i) {
    const Vec3f from = RandomPoint(small, random);
    const Vec3f way = directions.Draw(random);
    const float speed = Dot(way, large.patch->normal);
    const float height = Dot(large.center - from, large.patch->normal);
    if (!(speed < 0) || !(height < 0)) {
      continue;
    }
    const Vec3f to = from + way * (height / speed);
    if (IsOn(large, to)) {
      return from_source ? PointPair{to, from} : PointPair{from, to};
    }
  }
  return std::nullopt;
}

SampledTransfer SampleTransfer(const TransferEnd& receiver,
                               const TransferEnd& source,
                               bool near,
                               Random* random) {
  return near ? SampleNear(receiver, source, random)
              : SampleFar(receiver, source, random);
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
