// The transfer from a group of patches that emit alike to an element, and the
// share of the transfer that gets through.
//
//   F_gf  form factor from the receiver's node g to patch f of the group
//   F_g   sum over f of F_gf: the node's irradiance per 1 W/m2 of radiosity if
//         nothing stood in between
//   V_g   share of rays from about node g to the group that get through; the
//         patch that a ray goes to is drawn in proportion to F_gf

#pragma once

#include "base/random.h"
#include "solver/transfer/blockers.h"
#include "solver/transfer/fit_residual.h"
#include "solver/transfer/form_factor.h"
#include "solver/transfer/link_rays.h"
#include "solver/transfer/source_group.h"
#include "solver/transfer/transfer_sample.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace enfilade {

// Some of a group's patches, by their index in the group.
struct GroupPart {
  std::array<uint8_t, kMostGroupPatches> members{};
  size_t count = 0;
};

GroupPart WholeGroup(const SourceGroup& group);

// The unoccluded transfer from a group to an element.
class GroupTransfer {
 public:
  // `candidates` are the patches of the group that may face the receiver. All
  // other arguments are borrowed.
  GroupTransfer(const TransferEnd& receiver,
                std::span<const PatchGeometry> patches,
                const SourceGroups& groups,
                const SourceGroup& group,
                const GroupPart& candidates);

  // The candidates that face the receiver.
  [[nodiscard]] const GroupPart& Facing() const { return facing_; }

  // An upper bound of the mean form factor.
  [[nodiscard]] float FormFactorBound() const { return bound_; }

  // Computes F_g.
  void Evaluate();

  // F_g; after Evaluate.
  [[nodiscard]] const std::array<float, kTransferNodes>& AtNodes() const {
    return at_nodes_;
  }

  // The mean of F_g over the receiver; after Evaluate.
  [[nodiscard]] float FormFactor() const;

  // RMS over the receiver of the part of the form factor that the basis (of
  // order 1 or 2) cannot follow; after Evaluate.
  [[nodiscard]] float Residual(const Basis& basis) const;

  // Whether nothing stands between the receiver and any of the patches.
  [[nodiscard]] bool IsProvenClear(const Blockers& blockers) const;

  // Computes the form factors from a point of the receiver to the patches, in
  // the order of Facing(); returns their sum.
  float FormFactorsOf(Vec3f at,
                      std::array<float, kMostGroupPatches>* form_factors) const;

  // A random point of the patch at which the running sum of the form factors
  // reaches the fraction `share`, in [0, 1), of their total.
  Vec3f DrawPoint(const std::array<float, kMostGroupPatches>& form_factors,
                  float share,
                  Random* random) const;

  // Whether the group is so close to the receiver that the kernel peaks in a
  // part of the receiver.
  [[nodiscard]] bool IsPeaked() const;

  // A ray drawn in proportion to the kernel; nullopt if a few tries find none.
  [[nodiscard]] std::optional<PointPair> PairAtPeak(Random* random) const;

  // The form factor from a random point of the receiver, and a ray from there
  // to a patch drawn in proportion to its form factor. Does not need Evaluate.
  SampledTransfer Sample(Random* random) const;

 private:
  [[nodiscard]] const PatchGeometry& PatchAt(size_t i) const {
    return patches_[members_[facing_.members[i]]];
  }

  [[nodiscard]] SourceExtent Extent() const;

  // The sum of the normals of the patches whose planes cut the receiver.
  [[nodiscard]] Vec3f NormalOfCuts() const;

  const TransferEnd* receiver_;
  std::span<const PatchGeometry> patches_;
  const SourceGroup* group_;
  std::span<const uint32_t> members_;
  GroupPart facing_;
  float bound_ = 0;
  std::array<float, kTransferNodes> at_nodes_{};
};

// The visibility of a group by rays.
struct GroupSight {
  std::array<float, kTransferNodes> at_nodes{};  // V_g
  float fraction = 0;                            // mean of V_g, weighted by F
  // The number of points with rays; points that face no patch have none.
  size_t points = 0;
  float by_receiver = 0;  // variance of V over the points of the receiver
  float by_source = 0;    // mean variance of a ray over points of the group

  // Whether all rays got through, or none.
  [[nodiscard]] bool Agrees() const { return fraction <= 0 || fraction >= 1; }
};

// The rays of a transfer from a group. The rays that decide whether the
// transfer becomes a link must not serve the link itself: link_rays.h says why.
class GroupRays {
 public:
  static constexpr size_t kMostPoints = 8;

  // All arguments are borrowed; `key` seeds the rays.
  GroupRays(const Blockers& blockers,
            const TransferEnd& receiver,
            const GroupTransfer& transfer,
            uint64_t key,
            RayCount* count)
      : blockers_(&blockers),
        receiver_(&receiver),
        transfer_(&transfer),
        random_(key),
        count_(count) {}

  // Traces new rays: from `points` random points (at most kMostPoints) about
  // each of the receiver's nodes, `rays` rays from each point to the whole
  // group.
  GroupSight Look(size_t points, size_t rays);

  // Same as LinkRays::SeesPeak.
  [[nodiscard]] bool SeesPeak();

 private:
  struct Point;

  void Trace(std::span<Point> points, size_t rays);
  static GroupSight SightOf(std::span<const Point> points, size_t rays);

  const Blockers* blockers_;
  const TransferEnd* receiver_;
  const GroupTransfer* transfer_;
  Random random_;
  RayCount* count_;
};

}  // namespace enfilade
