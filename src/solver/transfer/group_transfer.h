// What an element gets of a group of patches that emit alike, and how much of
// it gets through.
//
//   F_gf  form factor of the receiver's node g to patch f of the group
//   F_g   sum over f of F_gf: what the node would get of 1 W/m2 if nothing
//         stood in between
//   V_g   share of rays from about node g to the group that get through; the
//         patch that a ray goes to is drawn by F_gf

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

// Some of a group's patches, by their place in it.
struct GroupPart {
  std::array<uint8_t, kMostGroupPatches> members{};
  size_t count = 0;
};

GroupPart WholeGroup(const SourceGroup& group);

// The unoccluded transfer from a group to an element.
class GroupTransfer {
 public:
  // `candidates` are the patches of the group that may face the receiver. All
  // but these are borrowed.
  GroupTransfer(const TransferEnd& receiver,
                std::span<const PatchGeometry> patches,
                const SourceGroups& groups,
                const SourceGroup& group,
                const GroupPart& candidates);

  // The candidates that do face it.
  [[nodiscard]] const GroupPart& Facing() const { return facing_; }

  // An upper bound of the mean form factor.
  [[nodiscard]] float FormFactorBound() const { return bound_; }

  // Finds F_gf.
  void Evaluate();

  // F_g; after Evaluate.
  [[nodiscard]] const std::array<float, kTransferNodes>& AtNodes() const {
    return at_nodes_;
  }

  // The mean of F_g over the receiver; after Evaluate.
  [[nodiscard]] float FormFactor() const;

  // RMS of what the basis (of order 1 or 2) cannot follow of the form factor
  // on the receiver; after Evaluate.
  [[nodiscard]] float Residual(const Basis& basis) const;

  // Whether nothing stands between the receiver and any of the patches.
  [[nodiscard]] bool IsProvenClear(const Blockers& blockers) const;

  // The form factors of a point of the receiver to the patches, by their places
  // in Facing(); returns their sum.
  float FormFactorsOf(Vec3f x,
                      std::array<float, kMostGroupPatches>* form_factors) const;

  // A random point of a patch: the one at which `share`, in [0, 1), of the sum
  // of the form factors is reached.
  Vec3f DrawPoint(const std::array<float, kMostGroupPatches>& form_factors,
                  float share,
                  Random* random) const;

  // The kernel peaks in a part of the receiver, which the group is close to.
  [[nodiscard]] bool IsPeaked() const;

  // A ray drawn by the kernel; nullopt where a few tries found none.
  [[nodiscard]] std::optional<PointPair> PairAtPeak(Random* random) const;

  // The form factor of a random point of the receiver, and a ray drawn by it.
  // Does not need Evaluate.
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

// What rays say of a transfer from a group.
struct GroupSight {
  std::array<float, kTransferNodes> at_nodes{};  // V_g
  float fraction = 0;                            // their mean, weighted by F
  // Points from which rays went: not those that face nothing of the group.
  size_t points = 0;
  float by_receiver = 0;  // variance of V over the points of the receiver
  float by_source = 0;    // mean variance of a ray over points of the group

  // All rays got through, or none did.
  [[nodiscard]] bool Agrees() const { return fraction <= 0 || fraction >= 1; }
};

// The rays of a transfer from a group. Those that say whether it may become a
// link must not be the link's own: link_rays.h says why.
class GroupRays {
 public:
  static constexpr size_t kMostPoints = 8;

  // All are borrowed; `key` decides where the rays go.
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

  // Traces rays that were not traced before: from so many random points
  // (kMostPoints at most) about each of the receiver's nodes, so many from each
  // to all of the group.
  GroupSight Look(size_t points, size_t rays);

  // As LinkRays::SeesPeak.
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
