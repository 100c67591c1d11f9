// Form factors between points and polygons, and quadrature kernels between the
// nodes of two elements, unoccluded.
//
//   paper      here
//   F(x, P)    PointToPolygon (W, eq. 5)
//   K_gq       Kernel: irradiance at receiver node g per radiosity at source
//              node q; rows sum to the form factor of the node

#pragma once

#include "solver/elements/geometry.h"
#include "solver/transfer/plain_kernel.h"

#include <array>
#include <cstdint>
#include <span>

namespace enfilade {

// The form factor, in [0, 1], from a differential area at x with unit normal n
// to a convex planar polygon: the cosine-weighted share of x's hemisphere that
// the polygon covers. The part of the polygon below x's horizon is clipped.
// Either side of the polygon may face x. At most five corners.
//
// F = 1/(2 pi) sum over edges of angle(v_i, v_i+1) n . (v_i x v_i+1)/|...|,
// Lambert's formula (W, eq. 5), signed by the polygon's orientation.
float PointToPolygon(Vec3f x, Vec3f n, std::span<const Vec3f> polygon);

// Nodes per element in a transfer: four on parallelograms; three on triangles,
// padded by a fourth of weight zero.
inline constexpr size_t kTransferNodes = 4;
using TransferNodes = NodeSet<kTransferNodes>;

// The nodes of the second-order basis, whichever basis the solver uses.
TransferNodes NodesOf(const PatchGeometry& patch, ElementFrame frame);

// An element as one end of a transfer.
struct TransferEnd {
  const PatchGeometry* patch = nullptr;
  ElementFrame frame;
  float area = 0;
  float diameter = 0;
  float radius = 0;  // m, from `center` to the farthest corner
  float rim = 0;     // least distance of random points to the rim, as a share
  Vec3f center;
  size_t node_count = 0;
  TransferNodes nodes;

  // Node i, with the normal of the element.
  [[nodiscard]] SurfacePoint NodeAt(size_t i) const {
    return {nodes.At(i), patch->normal};
  }
};

TransferEnd MakeTransferEnd(const PatchGeometry& patch, ElementFrame frame);

// Whether an element may reach into a box; true whenever it does.
bool ReachesInto(const TransferEnd& end, const Box& box);

// K_gq at [g * kTransferNodes + q].
using Kernel = std::array<float, kTransferNodes * kTransferNodes>;

// The same coefficients at [q][g]: the receiver's nodes lie side by side.
using KernelColumns =
    std::array<std::array<float, kTransferNodes>, kTransferNodes>;

// Plain product quadrature: A_s w_q cos_x cos_y / (pi r^2). Accurate to about
// (diameter / distance)^4 / 10.
Kernel QuadratureKernel(const TransferEnd& receiver, const TransferEnd& source);

// Makes K_gq zero where bit (g * kTransferNodes + q) is not set.
void MaskKernel(uint16_t visible, Kernel* kernel);

// One row of the kernel, for a point of the receiver.
std::array<float, kTransferNodes> QuadratureRow(const SurfacePoint& x,
                                                const TransferEnd& source);

// Whether `end` has parts in front of the patch's plane and parts behind it.
bool IsCut(const TransferEnd& end, const PatchGeometry& patch);

// Whether a near transfer gets exact form factors from the source's nodes to
// the receiver (by reciprocity) instead of from the receiver's nodes to the
// source. NearKernel uses the nodes of the smaller end, except if the
// receiver's horizon cuts a smaller source: the source's nodes then say nothing
// of the visible part.
bool IsByColumns(const TransferEnd& receiver, const TransferEnd& source);

// The kernel for ends that are close, scaled to exact form factors.
Kernel NearKernel(const TransferEnd& receiver, const TransferEnd& source);

// A source seen from points close to it. The TransferEnd is borrowed.
class NearSource {
 public:
  explicit NearSource(const TransferEnd& source);

  // The exact form factor from x to the source, zero behind the source, spread
  // over the source's nodes (ScaleToFormFactor).
  [[nodiscard]] std::array<float, kTransferNodes> Row(
      const SurfacePoint& x) const;

 private:
  const TransferEnd* source_;
  Corners corners_;
};

}  // namespace enfilade
