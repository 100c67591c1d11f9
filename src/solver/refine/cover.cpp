#include "solver/refine/cover.h"

#include "base/parallel.h"
#include "base/random.h"
#include "solver/refine/cover_candidates.h"
#include "solver/transfer/cosine_directions.h"

#include <algorithm>
#include <array>
#include <atomic>
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
// If more candidates may cover a surface, its parts are looked at instead.
constexpr size_t kMostCandidates = 64;
// Levels of elements whose children are looked at in parallel.
constexpr size_t kParallelLevels = 4;
// The most receivers of a cell: kMostReceivers, plus kMostReceiversPerPatch for
// each patch.
constexpr size_t kMostReceivers = 16384;
constexpr size_t kMostReceiversPerPatch = 8;
// If there would be more receivers, tau is multiplied by this factor.
constexpr double kCoarser = 4;
// Rays that are traced together.
constexpr size_t kPacket = std::tuple_size_v<decltype(SegmentPacket::from_x)>;

// The rectangle of an element; for a triangle, of the parallelogram around it.
PatchRect PatchRectOf(ElementFrame frame) {
  const float end_a = frame.a + frame.scale;
  const float end_b = frame.b + frame.scale;
  return {std::min(frame.a, end_a),
          std::max(frame.a, end_a),
          std::min(frame.b, end_b),
          std::max(frame.b, end_b)};
}

// Counts the receivers of all patches of a cell so far, including those that
// others have replaced. Whether there are too many therefore does not depend on
// the order of the searches. If there are too many, all searches end, and what
// they have found is of no use.
struct Found {
  std::atomic<size_t> receivers = 0;
  size_t most = 0;

  [[nodiscard]] bool TooMany() const { return receivers > most; }
};

// What was found on an element.
struct Finding {
  std::vector<ElementPath> receivers;
  bool is_covered = false;  // something covers a part of it
  uint64_t rays = 0;

  void Append(Finding&& other) {
    receivers.insert(
        receivers.end(), other.receivers.begin(), other.receivers.end());
    is_covered |= other.is_covered;
    rays += other.rays;
  }
};

// Looks for covers on one patch.
class Search {
 public:
  Search(const CoverOptions& options,
         const CoverSide& cell,
         size_t patch,
         uint64_t key,
         std::span<const CellBlockers* const> occluders,
         Found* all)
      : options_(&options),
        cell_(&cell),
        index_(patch),
        patch_(&cell.patches[patch]),
        directions_(*patch_),
        key_(key),
        occluders_(occluders),
        all_(all) {}

  // The receivers of the whole patch.
  [[nodiscard]] Finding Run() const {
    const Place whole{.light =
                          cell_->light->OfPatch(static_cast<uint32_t>(index_))};
    // Most patches of furniture are too small: nothing is looked up for them.
    return CanMatter(whole) ? Visit(whole, CoverCandidates(*cell_, index_))
                            : One(whole, false);
  }

 private:
  struct Place {
    ElementPath path = kRootPath;
    ElementFrame frame = {};
    size_t level = 0;
    ReflectedElement light = {};
  };

  // The largest error that a cover of this share of the element may make, W/m.
  // A cover hides the mean reflected light and may hide all finer detail.
  [[nodiscard]] float ErrorOf(const Place& at, float share) const {
    if (share <= 0 || share >= 1) {
      return 0;
    }
    return (at.light.mean * std::sqrt(share * (1 - share)) +
            0.5F * at.light.detail) *
           std::sqrt(AreaOf(*patch_, at.frame));
  }

  // Whether a cover of a part of the element could matter.
  [[nodiscard]] bool CanMatter(const Place& at) const {
    // The error is largest if the cover hides half of the element.
    return ErrorOf(at, 0.5F) > static_cast<float>(options_->tau) &&
           DiameterOf(*patch_, at.frame) > options_->least_diameter &&
           !IsDeepest(at.path);
  }

  // Returns one receiver if nothing covers any part of the element.
  [[nodiscard]] Finding Visit(const Place& at,
                              const std::vector<PatchRect>& candidates) const {
    if (all_->TooMany()) {
      return {};
    }
    const std::vector<PatchRect> here =
        Within(PatchRectOf(at.frame), candidates);
    if (here.empty() || !CanMatter(at)) {
      return One(at, false);
    }
    if (here.size() > kMostCandidates) {
      Finding finding = VisitChildren(at, here);
      if (!finding.is_covered) {
        finding.receivers.clear();
        finding.Append(One(at, false));
      }
      return finding;
    }
    Finding finding;
    const float share = CoveredShare(at, here, &finding.rays);
    finding.Append(ErrorOf(at, share) <= static_cast<float>(options_->tau)
                       ? One(at, share > 0)
                       : VisitChildren(at, here));
    return finding;
  }

  [[nodiscard]] Finding One(const Place& at, bool is_covered) const {
    ++all_->receivers;
    return {{at.path}, is_covered, 0};
  }

  [[nodiscard]] Finding VisitChildren(
      const Place& at, const std::vector<PatchRect>& candidates) const {
    std::array<Finding, kChildren> children;
    const auto visit = [&](size_t c) {
      children[c] = Visit({ChildPath(at.path, c),
                           ChildOf(at.frame, patch_->shape, c),
                           at.level + 1,
                           cell_->light->OfChild(at.light, c)},
                          candidates);
    };
    // The floor of a hall may be one patch, so the patches of a cell alone are
    // too few to share out among the threads.
    if (at.level < kParallelLevels) {
      ParallelForInside(kChildren, visit);
    } else {
      for (size_t c = 0; c < kChildren; ++c) {
        visit(c);
      }
    }
    Finding all;
    for (Finding& child : children) {
      all.Append(std::move(child));
    }
    return all;
  }

  static std::vector<PatchRect> Within(const PatchRect& element,
                                       const std::vector<PatchRect>& rects) {
    std::vector<PatchRect> within;
    for (const PatchRect& r : rects) {
      const PatchRect part = r.ClippedTo(element);
      if (part.low_a < part.high_a && part.low_b < part.high_b) {
        within.push_back(part);
      }
    }
    return within;
  }

  // A point that may be covered, and the share of the element that it stands
  // for.
  struct Suspect {
    Vec3f point;
    float share = 0;
  };

  // The shares that points stand for. Points stand for unequal shares: those of
  // a few large ones are known less well than the number of points says.
  struct Shares {
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
  struct Tally {
    Shares tested;
    Shares passed;
    size_t points_passed_twice = 0;
    size_t points_passed = 0;
    float share_passed_twice = 0;

    [[nodiscard]] bool HasNoEdge() const {
      return points_passed_twice - points_passed >= kLeastFailures &&
             passed.sum < kSharpShare * share_passed_twice;
    }
  };

  // The share of the element that is covered, which need not be exact if it is
  // clear whether the element has to be split.
  [[nodiscard]] float CoveredShare(const Place& at,
                                   const std::vector<PatchRect>& candidates,
                                   uint64_t* rays) const {
    Random random(MixKey(key_, at.path));
    const std::vector<Suspect> suspects =
        DrawSuspects(at.frame, candidates, &random);
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
      if (MustSplit(at, share, tally)) {
        return share;
      }
      if (NeedNotSplit(at, share, all.sum, tally)) {
        break;
      }
    }
    return tally.HasNoEdge() ? 0 : share;
  }

  [[nodiscard]] bool MustSplit(const Place& at,
                               float share,
                               const Tally& tally) const {
    return tally.points_passed >= kClearPoints &&
           tally.passed.sum > kClearlySharp * tally.share_passed_twice &&
           ErrorOf(at, share) > kClearly * static_cast<float>(options_->tau);
  }

  // `all`: the share of all points, tested or not.
  [[nodiscard]] bool NeedNotSplit(const Place& at,
                                  float share,
                                  float all,
                                  const Tally& tally) const {
    const float passed = std::max(tally.passed.Points(), 1.0F);
    const float most = share * (1 + kHiddenDeviations / std::sqrt(passed)) +
                       all * kHiddenPoints / tally.tested.Points();
    return most < 0.5F &&
           ErrorOf(at, most) <= static_cast<float>(options_->tau);
  }

  void Test(std::vector<Suspect> suspects,
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
  [[nodiscard]] std::vector<Suspect> DrawSuspects(
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
  void KeepCovered(std::vector<Suspect>* suspects,
                   Random* random,
                   uint64_t* rays) const {
    for (int k = 0; k < kDirectionsPerTest; ++k) {
      size_t left = 0;
      for (size_t first = 0; first < suspects->size(); first += kPacket) {
        const size_t count = std::min(kPacket, suspects->size() - first);
        const uint32_t blocked =
            Look({suspects->data() + first, count}, random);
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
  [[nodiscard]] uint32_t Look(std::span<const Suspect> suspects,
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
    return Occluded(occluders_, packet);
  }

  const CoverOptions* options_;
  const CoverSide* cell_;
  size_t index_;
  const PatchGeometry* patch_;
  CosineDirections directions_;
  uint64_t key_;
  std::span<const CellBlockers* const> occluders_;
  Found* all_;
};

// Returns false and finds nothing if there are too many receivers.
bool FindWith(const CoverOptions& options,
              const CoverSide& cell,
              Covers* covers) {
  const auto& patches = cell.patches;
  const CellBlockers* const occluders[] = {cell.occluders};
  Found found;
  found.most = options.most_receivers;
  std::vector<Finding> findings(patches.size());
  ParallelFor(patches.size(), [&](size_t i) {
    if (patches[i].reflects && !found.TooMany()) {
      const Search search(options,
                          cell,
                          i,
                          MixKey(MixKey(options.seed, cell.id.value), i),
                          occluders,
                          &found);
      findings[i] = search.Run();
    }
  });
  if (found.TooMany()) {
    return false;
  }
  for (size_t i = 0; i < patches.size(); ++i) {
    covers->rays += findings[i].rays;
    for (const ElementPath path : findings[i].receivers) {
      covers->receivers.push_back({static_cast<uint32_t>(i), path});
    }
  }
  return true;
}

}  // namespace

Covers FindCovers(const CoverOptions& options, const CoverSide& cell) {
  CoverOptions now = options;
  now.most_receivers =
      std::min(options.most_receivers,
               kMostReceivers + kMostReceiversPerPatch * cell.patches.size());
  Covers covers;
  while (!FindWith(now, cell, &covers)) {
    now.tau *= kCoarser;
  }
  return covers;
}

}  // namespace enfilade
