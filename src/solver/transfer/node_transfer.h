// Transfers between elements at the nodes of bases other than M1 and M2. Their
// links keep no coefficients: each gather of light rebuilds the kernel.
//
//   paper   here
//   K_gq    NodeKernel: irradiance at receiver node g per radiosity at source
//           node q, unoccluded. M3, M4: product quadrature. F2, F3: the form
//           factor from the centroid of a receiver cell to a source cell, so
//           that R and S of W (eq. 14) are identities
//   V_gq    the visibility of pairs of second-order nodes, weighted by the
//           share of each node in them (SampleMap)
//
// Close ends get exact form factors, on the side that IsByColumns
// (form_factor.h) chooses: from each receiver node to the source (to its cells,
// in flat bases) or, by reciprocity, from each source node to the receiver.

#pragma once

#include "solver/elements/basis.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstdint>

namespace enfilade {

// An element as one end of a transfer, with the nodes of a basis.
struct NodeEnd {
  TransferEnd end;
  const ShapeBasis* basis = nullptr;  // borrowed
  size_t count = 0;
  // From `count` on the last node is repeated with weight zero.
  NodeSet<kMaxNodes> nodes;

  // Node i, with the normal of the element.
  [[nodiscard]] SurfacePoint NodeAt(size_t i) const {
    return {nodes.At(i), end.patch->normal};
  }
};

NodeEnd MakeNodeEnd(const ShapeBasis& basis,
                    const PatchGeometry& patch,
                    ElementFrame frame);

// K_gq at [g * kMaxNodes + q]; zero if g or q is no node.
using NodeKernel = std::array<float, kMaxNodes * kMaxNodes>;

// The kernel by plain quadrature.
NodeKernel FarNodeKernel(const NodeEnd& receiver, const NodeEnd& source);

// The kernel with exact form factors; finite if the ends touch.
NodeKernel NearNodeKernel(const NodeEnd& receiver, const NodeEnd& source);

// NearNodeKernel if IsNear (oracle.h) holds for the ends, else FarNodeKernel.
NodeKernel TransferKernel(const NodeEnd& receiver, const NodeEnd& source);

// Multiplies K_gq by V_gq, which follows from visibility bits as in link_rays.h
// and from the samples' shares of both ends.
void MaskNodeKernel(uint16_t visible,
                    const SampleMap& receiver,
                    const SampleMap& source,
                    NodeKernel* kernel);

}  // namespace enfilade
