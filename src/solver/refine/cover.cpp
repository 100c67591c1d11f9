#include "solver/refine/cover.h"

#include "base/check.h"
#include "base/parallel.h"
#include "base/random.h"
#include "solver/refine/cover_candidates.h"
#include "solver/refine/cover_sampler.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

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
         std::span<const RayBlockers* const> blockers,
         Found* all)
      : options_(&options),
        cell_(&cell),
        index_(patch),
        patch_(&cell.patches[patch]),
        sampler_(*patch_, blockers),
        key_(key),
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
    const float share = sampler_.CoveredShare(
        at.frame,
        here,
        {[&](float covered) { return ErrorOf(at, covered); },
         static_cast<float>(options_->tau)},
        Random(MixKey(key_, at.path)),
        &finding.rays);
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

  const CoverOptions* options_;
  const CoverSide* cell_;
  size_t index_;
  const PatchGeometry* patch_;
  CoverSampler sampler_;
  uint64_t key_;
  Found* all_;
};

// Returns false and finds nothing if there are too many receivers.
bool FindWith(const CoverOptions& options,
              const CoverSide& cell,
              Covers* covers) {
  const auto& patches = cell.patches;
  const RayBlockers* const blockers[] = {cell.blockers};
  Found found;
  found.most = options.most_receivers;
  std::vector<Finding> findings(patches.size());
  ParallelFor(patches.size(), [&](size_t i) {
    if (patches[i].reflects && !found.TooMany()) {
      const Search search(options,
                          cell,
                          i,
                          MixKey(MixKey(options.seed, cell.id.value), i),
                          blockers,
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
  ENFILADE_CHECK(now.most_receivers >= cell.patches.size(),
                 "{} receivers for {} patches",
                 now.most_receivers,
                 cell.patches.size());
  Covers covers;
  while (!FindWith(now, cell, &covers)) {
    now.tau *= kCoarser;
  }
  return covers;
}

}  // namespace enfilade
