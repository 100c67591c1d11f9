// The unoccluded transfer of a link between two elements, by the chosen rule
// for singular kernels.
//
//   paper   here
//   K_gq    NodeKernel: irradiance of receiver node g per radiosity of source
//           node q
//   R, S    of C-C (W, 2.4.2, after Schroeder 1993): from flatlets to nodes,
//           from nodes to flatlets; K = R K_flat S

#pragma once

#include "solver/reference/hierarchical_options.h"
#include "solver/reference/reference_scene.h"
#include "solver/transfer/node_transfer.h"

#include <array>
#include <optional>

namespace enfilade {

// Whether two ends share a part of an edge that is more than a point.
bool AbutAlongEdge(const TransferEnd& a, const TransferEnd& b);

// The part of an element that cell i of a flat basis covers; for other bases
// the whole element.
TransferEnd CellOf(const NodeEnd& end, size_t i);

// Two ends with the nodes between which their transfer is computed: the nodes
// of the basis, or those of the flatlets instead.
struct Coupling {
  NodeEnd receiver;
  NodeEnd source;
  const Basis* basis = nullptr;  // of these nodes; borrowed
  bool abut = false;             // along an edge
};

class HierarchicalTransfer {
 public:
  // The basis is borrowed.
  HierarchicalTransfer(const Basis& basis, SingularRule rule);

  // Only C-C asks whether two ends abut.
  [[nodiscard]] bool AsksForEdges() const {
    return rule_ == SingularRule::kFlatlets;
  }

  [[nodiscard]] Coupling Couple(const TransferEnd& receiver,
                                const TransferEnd& source,
                                bool abut) const;

  // K_gq between the nodes of the coupling, at [g * kMaxNodes + q].
  [[nodiscard]] NodeKernel Unoccluded(const Coupling& coupling) const;

  // Converts the kernel from the coupling's nodes to those of the basis.
  [[nodiscard]] NodeKernel InBasis(const Coupling& coupling,
                                   const NodeKernel& kernel) const;

 private:
  const Basis& basis_;
  SingularRule rule_;
  std::optional<Basis> flatlets_;  // of the same order; for C-C beyond Haar
  std::array<NodeKernel, 2> to_nodes_{};     // R, by shape
  std::array<NodeKernel, 2> to_flatlets_{};  // S, likewise
};

}  // namespace enfilade
