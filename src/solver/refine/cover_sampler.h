// How much of an element is covered, by random points of it.

#pragma once

#include "base/random.h"
#include "solver/elements/geometry.h"
#include "solver/refine/cover_candidates.h"
#include "solver/transfer/cosine_directions.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace enfilade {

// The error that a cover of this share of an element makes, W/m, and the
// largest that is allowed: the share need only be known so well that it is
// clear whether it makes more.
struct CoverLimit {
  std::function<float(float share)> error_of;
  float tau = 0;
};

// Points on one patch. Thread-safe; borrows its arguments.
class CoverSampler {
 public:
  CoverSampler(const PatchGeometry& patch,
               std::span<const RayBlockers* const> blockers)
      : patch_(&patch), directions_(patch), blockers_(blockers) {}

  // The share of the element that is covered, in [0, 1], by points on its
  // `candidates` (cover_candidates.h), clipped to it. Adds the number of rays
  // traced.
  [[nodiscard]] float CoveredShare(ElementFrame frame,
                                   const std::vector<PatchRect>& candidates,
                                   const CoverLimit& limit,
                                   Random random,
                                   uint64_t* rays) const;

 private:
  // A point that may be covered, and the share of the element that it stands
  // for.
  struct Suspect {
    Vec3f point;
    float share = 0;
  };

  struct Shares;
  struct Tally;  // what tests have said so far

  void Test(std::vector<Suspect> suspects,
            Random* random,
            uint64_t* rays,
            Tally* tally) const;
  [[nodiscard]] std::vector<Suspect> DrawSuspects(
      ElementFrame frame,
      const std::vector<PatchRect>& candidates,
      Random* random) const;
  void KeepCovered(std::vector<Suspect>* suspects,
                   Random* random,
                   uint64_t* rays) const;
  [[nodiscard]] uint32_t Look(std::span<const Suspect> suspects,
                              Random* random) const;

  const PatchGeometry* patch_;
  CosineDirections directions_;
  std::span<const RayBlockers* const> blockers_;
};

}  // namespace enfilade
