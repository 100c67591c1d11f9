// The visibility between the ends of a link, found in the ways of the study of
// 1997 and in the solver's own.
//
//   paper          here
//   Vis1, Vis16    Share
//   V in the link  Mask: of the whole link, or of each pair of its nodes

#pragma once

#include "solver/reference/hierarchical_options.h"
#include "solver/reference/hierarchical_transfer.h"
#include "solver/reference/reference_scene.h"
#include "solver/transfer/node_transfer.h"

#include <cstdint>

namespace enfilade {

// The rays between two panels; only rays whose ends face each other count.
struct SeenShare {
  uint32_t rays = 0;
  uint32_t seen = 0;

  // 1 if no points face each other, since nothing is known to block them.
  [[nodiscard]] float Value() const {
    return rays == 0 ? 1 : static_cast<float>(seen) / static_cast<float>(rays);
  }

  [[nodiscard]] bool IsPartial() const { return seen > 0 && seen < rays; }
};

class HierarchicalVisibility {
 public:
  // The scene is borrowed.
  HierarchicalVisibility(const ReferenceScene& scene, VisibilityMode mode)
      : scene_(scene), mode_(mode) {}

  // Whether links below inherit a share of none or all.
  [[nodiscard]] bool IsInherited() const {
    return mode_ == VisibilityMode::kTriage;
  }

  // The share that decides on refinement: by one ray for kRay, else by 16 rays.
  // Thread-safe.
  [[nodiscard]] SeenShare Share(const Panel& receiver,
                                const Panel& source) const;

  // Multiplies the kernel between the nodes of the coupling by their
  // visibility. Thread-safe.
  void Mask(const Coupling& coupling,
            const SeenShare& share,
            uint64_t key,
            NodeKernel* kernel) const;

 private:
  void MaskByNodes(const Coupling& coupling, NodeKernel* kernel) const;
  void MaskByParts(const Coupling& coupling,
                   uint64_t key,
                   NodeKernel* kernel) const;

  const ReferenceScene& scene_;
  VisibilityMode mode_;
};

}  // namespace enfilade
