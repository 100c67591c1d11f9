#include "solver/refine/cover_sampler.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>
#include <utility>

namespace enfilade {
namespace {

// A test traces this many random, cosine-weighted directions from a point. The
// point passes if all of them are blocked within the reach, and is covered if
// it passes three tests. In a corner between two walls half of the directions
// are blocked, below a cover all.
constexpr int kDirectionsPerTest = 8;
// Points with a narrow open view, as in a bowl, pass one test and fail the next
// by chance. If less than this share of the points that passed two tests pass
// the third, there is no edge to be found. Fewer failures than kLeastFailures
// are chance.
constexpr float kSharpShare = 0.7F;
constexpr size_t kLeastFailures = 4;
// Points are tested in groups of kGroup and more, until it is clear whether the
// covered share makes an error larger than tau, whatever the other groups say.
// That is asked after 1, 2, 4, 8, ... groups, so that chance has few occasions.
constexpr size_t kGroup = 64;
// It does if it seems to make kClearly times that error, and this many points
// and this share of those that passed two tests have passed three.
constexpr float kClearly = 1.5F;
constexpr size_t kClearPoints = 16;
constexpr float kClearlySharp = 0.85F;
// It does not if the largest share that chance may hide behind what was seen is
// small enough: so many standard deviations more, and the share of so many
// points.
constexpr float kHiddenDeviations = 2;
constexpr float kHiddenPoints = 3;
// One sample point per this area of each projection that may cover. The foot of
// a chair's leg is about a tenth of the projections of its sides, margins
// included.
constexpr float kAreaPerPoint = 8e-4F;  // m2
// At least this many points per projection; overlapping projections share the
// points.
constexpr float kPoints = 32;
constexpr size_t kLeastPoints = 2;
constexpr size_t kMostPoints = 256;
// Rays that are traced together.
constexpr size_t kPacket = std::tuple_size_v<decltype(SegmentPacket::from_x)>;

}  // namespace

// The shares that points stand for. Points stand for unequal shares: those of
// a few large ones are known less well than the number of points says.
struct CoverSampler::Shares {
  float sum = 0;
  float squares = 0;

  void Add(const std::vector<Suspect>& suspects) {
    for (const Suspect& s : suspects) {
      sum += s.share;
      squares += s.share * s.share;
    }
  }

  // How many points of equal shares are known as well.
  [[nodiscard]] float Points() const {
    return squares > 0 ? sum * sum / squares : 0;
  }
};

// What tests have said so far.
struct CoverSampler::Tally {
  Shares tested;
  Shares passed;
  size_t points_passed_twice = 0;
  size_t points_passed = 0;
  float share_passed_twice = 0;

  [[nodiscard]] bool HasNoEdge() const {
    return points_passed_twice - points_passed >= kLeastFailures &&
           passed.sum < kSharpShare * share_passed_twice;
  }

  [[nodiscard]] bool MustSplit(float share, const CoverLimit& limit) const {
    return points_passed >= kClearPoints &&
           passed.sum > kClearlySharp * share_passed_twice &&
           limit.error_of(share) > kClearly * limit.tau;
  }

  // `all`: the share of all points, tested or not.
  [[nodiscard]] bool NeedNotSplit(float share,
                                  float all,
                                  const CoverLimit& limit) const {
    const float known = std::max(passed.Points(), 1.0F);
    const float most = share * (1 + kHiddenDeviations / std::sqrt(known)) +
                       all * kHiddenPoints / tested.Points();
    return most < 0.5F && limit.error_of(most) <= limit.tau;
  }
};

float CoverSampler::CoveredShare(ElementFrame frame,
                                 const std::vector<PatchRect>& candidates,
                                 const CoverLimit& limit,
                                 Random random,
                                 uint64_t* rays) const {
  const std::vector<Suspect> suspects =
      DrawSuspects(frame, candidates, &random);
  if (suspects.empty()) {
    return 0;  // a triangle, and candidates beside it
  }
  Shares all;
  all.Add(suspects);
  // The points of a candidate are spread over the groups.
  const size_t groups = std::max<size_t>(suspects.size() / kGroup, 1);
  Tally tally;
  float share = 0;
  for (size_t group = 0; group < groups; ++group) {
    std::vector<Suspect> some;
    some.reserve(suspects.size() / groups + 1);
    for (size_t i = group; i < suspects.size(); i += groups) {
      some.push_back(suspects[i]);
    }
    Test(std::move(some), &random, rays, &tally);
    share = std::min(tally.passed.sum * all.sum / tally.tested.sum, 1.0F);
    if (!std::has_single_bit(group + 1)) {
      continue;
    }
    if (tally.MustSplit(share, limit)) {
      return share;
    }
    if (tally.NeedNotSplit(share, all.sum, limit)) {
      break;
    }
  }
  return tally.HasNoEdge() ? 0 : share;
}

void CoverSampler::Test(std::vector<Suspect> suspects,
                        Random* random,
                        uint64_t* rays,
                        Tally* tally) const {
  tally->tested.Add(suspects);
  KeepCovered(&suspects, random, rays);
  KeepCovered(&suspects, random, rays);
  tally->points_passed_twice += suspects.size();
  Shares twice;
  twice.Add(suspects);
  tally->share_passed_twice += twice.sum;
  KeepCovered(&suspects, random, rays);
  tally->points_passed += suspects.size();
  tally->passed.Add(suspects);
}

// Draws points on each candidate. Candidates may overlap: the share of a
// point is divided by the number of candidates that contain it.
std::vector<CoverSampler::Suspect> CoverSampler::DrawSuspects(
    ElementFrame frame,
    const std::vector<PatchRect>& candidates,
    Random* random) const {
  // The share of the parallelogram around the element that the element fills.
  const float fill = patch_->shape == PatchShape::kTriangle ? 0.5F : 1.0F;
  const float area = AreaOf(*patch_, frame) / fill;
  const float rect_area = PatchRectOf(frame).Area();
  float layers = 0;  // candidates over a point, on average
  for (const PatchRect& rect : candidates) {
    layers += rect.Area() / rect_area;
  }
  std::vector<Suspect> suspects;
  for (const PatchRect& rect : candidates) {
    const float share = rect.Area() / rect_area;
    const float wanted = std::max(kPoints, share * area / kAreaPerPoint) /
                         std::max(layers, 1.0F);
    const size_t points =
        std::clamp(static_cast<size_t>(wanted), kLeastPoints, kMostPoints);
    const float scale = share / (fill * static_cast<float>(points));
    for (size_t i = 0; i < points; ++i) {
      const auto [s, t] = random->NextTwo();
      const float a = rect.low_a + s * (rect.high_a - rect.low_a);
      const float b = rect.low_b + t * (rect.high_b - rect.low_b);
      if (patch_->shape == PatchShape::kTriangle &&
          (a - frame.a + b - frame.b) / frame.scale > 1) {
        continue;
      }
      const auto over = std::count_if(
          candidates.begin(), candidates.end(), [&](const PatchRect& r) {
            return r.Has(a, b);
          });
      suspects.push_back(
          {PointOn(*patch_, {}, a, b),
           scale / static_cast<float>(std::max<std::ptrdiff_t>(over, 1))});
    }
  }
  return suspects;
}

// Drops the points from which at least one of the directions is free.
void CoverSampler::KeepCovered(std::vector<Suspect>* suspects,
                               Random* random,
                               uint64_t* rays) const {
  for (int k = 0; k < kDirectionsPerTest; ++k) {
    size_t left = 0;
    for (size_t first = 0; first < suspects->size(); first += kPacket) {
      const size_t count = std::min(kPacket, suspects->size() - first);
      const uint32_t blocked = Look({suspects->data() + first, count}, random);
      for (size_t i = 0; i < count; ++i) {
        (*suspects)[left] = (*suspects)[first + i];
        left += blocked >> i & 1;
      }
    }
    *rays += suspects->size();
    suspects->resize(left);
  }
}

// Returns the points, as bits, from which a random direction is blocked.
uint32_t CoverSampler::Look(std::span<const Suspect> suspects,
                            Random* random) const {
  SegmentPacket packet;
  for (size_t i = 0; i < suspects.size(); ++i) {
    const Vec3f from = suspects[i].point;
    const Vec3f to = from + directions_.Draw(random) * kCoverReach;
    packet.from_x[i] = from.x;
    packet.from_y[i] = from.y;
    packet.from_z[i] = from.z;
    packet.to_x[i] = to.x;
    packet.to_y[i] = to.y;
    packet.to_z[i] = to.z;
  }
  packet.count = static_cast<uint32_t>(suspects.size());
  return Occluded(blockers_, packet);
}

}  // namespace enfilade
