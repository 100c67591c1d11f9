// Transfers between elements at the nodes of bases other than M1 and M2, whose
// links keep no coefficients: the kernel is rebuilt whenever light is gathered.
//
//   paper   here
//   K_gq    NodeKernel: irradiance at receiver node g per radiosity at source
//           node q, unoccluded. M3, M4: product quadrature. F2, F3: the form
//           factor of a source cell from the centroid of a receiver cell, so
//           that R and S of W (eq. 14) are identities
//   V_gq    by the visibility of the pairs of second-order nodes, of which each
//           node has a share (SampleMap)
//
// Close ends get exact form factors, as in form_factor.h: of each receiver node
// to the source (its cells, in flat bases) where the source is the larger one,
// by reciprocity where the receiver is.

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
  // Of the nodes; beyond `count` weightless copies of the last one.
  std::array<float, kMaxNodes> x{};  // m
  std::array<float, kMaxNodes> y{};
  std::array<float, kMaxNodes> z{};
  std::array<float, kMaxNodes> weight{};  // sums to 1

  [[nodiscard]] Vec3f At(size_t i) const { return {x[i], y[i], z[i]}; }
};

NodeEnd MakeNodeEnd(const ShapeBasis& basis,
                    const PatchGeometry& patch,
                    ElementFrame frame);

// K_gq at [g * kMaxNodes + q]; zero beyond the nodes.
using NodeKernel = std::array<float, kMaxNodes * kMaxNodes>;

// By plain quadrature.
NodeKernel FarNodeKernel(const NodeEnd& receiver, const NodeEnd& source);

// With exact form factors; finite where the ends touch.
NodeKernel NearNodeKernel(const NodeEnd& receiver, const NodeEnd& source);

// The one of both that suits the distance of the ends.
NodeKernel TransferKernel(const NodeEnd& receiver, const NodeEnd& source);

// K_gq V_gq of visibility bits as in link_rays.h, with the samples' shares of
// both ends.
void MaskNodeKernel(uint16_t visible,
                    const SampleMap& receiver,
                    const SampleMap& source,
                    NodeKernel* kernel);

}  // namespace enfilade
