#include "solver/transfer/node_transfer.h"

#include "solver/transfer/oracle.h"

#include <algorithm>

namespace enfilade {
namespace {

using NodeRow = std::array<float, kMaxNodes>;

NodeRow QuadratureRow(const SurfacePoint& x, const NodeEnd& source) {
  return PlainRow(x, source.nodes, source.end.area, source.end.patch->normal);
}

// The form factors to the cells of a source with a flat basis.
NodeRow FlatRow(const SurfacePoint& x, const NodeEnd& source) {
  NodeRow row{};
  for (size_t q = 0; q < source.count; ++q) {
    const ChildFrame& cell = source.basis->Cells()[q];
    const ElementFrame& whole = source.end.frame;
    const ElementFrame frame = {
        whole.a + whole.scale * static_cast<float>(cell.a),
        whole.b + whole.scale * static_cast<float>(cell.b),
        whole.scale * static_cast<float>(cell.scale)};
    const Corners corners = CornersOf(*source.end.patch, frame);
    row[q] = PointToPolygon(x.at, x.normal, corners.View());
  }
  return row;
}

// The form factor to the whole source, spread over its nodes.
NodeRow SpreadRow(const SurfacePoint& x, const NodeEnd& source) {
  const Corners corners = CornersOf(*source.end.patch, source.end.frame);
  NodeRow row = QuadratureRow(x, source);
  ScaleToFormFactor(PointToPolygon(x.at, x.normal, corners.View()),
                    source.nodes.weight,
                    &row);
  return row;
}

NodeRow ExactRow(const SurfacePoint& x, const NodeEnd& source) {
  const PatchGeometry& patch = *source.end.patch;
  if (Dot(x.at - patch.origin, patch.normal) <= 0) {
    return {};
  }
  return source.basis->Cells().empty() ? SpreadRow(x, source)
                                       : FlatRow(x, source);
}

}  // namespace

NodeEnd MakeNodeEnd(const ShapeBasis& basis,
                    const PatchGeometry& patch,
                    ElementFrame frame) {
  NodeEnd end;
  end.end = MakeTransferEnd(patch, frame);
  end.basis = &basis;
  end.count = basis.NodeCount();
  for (size_t i = 0; i < kMaxNodes; ++i) {
    const UnitPoint at = basis.Node(std::min(i, end.count - 1));
    const Vec3f p = PointOn(
        patch, frame, static_cast<float>(at.a), static_cast<float>(at.b));
    end.nodes.x[i] = p.x;
    end.nodes.y[i] = p.y;
    end.nodes.z[i] = p.z;
    end.nodes.weight[i] =
        i < end.count ? static_cast<float>(basis.Weight(i)) : 0.0F;
  }
  return end;
}

NodeKernel FarNodeKernel(const NodeEnd& receiver, const NodeEnd& source) {
  NodeKernel kernel{};
  for (size_t g = 0; g < receiver.count; ++g) {
    const NodeRow row = QuadratureRow(receiver.NodeAt(g), source);
    std::copy(row.begin(), row.end(), kernel.begin() + g * kMaxNodes);
  }
  return kernel;
}

NodeKernel NearNodeKernel(const NodeEnd& receiver, const NodeEnd& source) {
  NodeKernel kernel{};
  if (!IsByColumns(receiver.end, source.end)) {
    for (size_t g = 0; g < receiver.count; ++g) {
      const NodeRow row = ExactRow(receiver.NodeAt(g), source);
      std::copy(row.begin(), row.end(), kernel.begin() + g * kMaxNodes);
    }
    return kernel;
  }
  // By reciprocity A_r F_rs = A_s F_sr, the flux of a small source is right
  // wherever the spot that the source lights lies.
  for (size_t q = 0; q < source.count; ++q) {
    const NodeRow column = ExactRow(source.NodeAt(q), receiver);
    const float scale =
        source.end.area * source.nodes.weight[q] / receiver.end.area;
    for (size_t g = 0; g < receiver.count; ++g) {
      kernel[g * kMaxNodes + q] = scale * column[g] / receiver.nodes.weight[g];
    }
  }
  return kernel;
}

NodeKernel TransferKernel(const NodeEnd& receiver, const NodeEnd& source) {
  return IsNear(receiver.end, source.end) ? NearNodeKernel(receiver, source)
                                          : FarNodeKernel(receiver, source);
}

void MaskNodeKernel(uint16_t visible,
                    const SampleMap& receiver,
                    const SampleMap& source,
                    NodeKernel* kernel) {
  for (size_t g = 0; g < kMaxNodes; ++g) {
    // The visibility of each sample of the source from receiver node g.
    std::array<float, kSampleNodes> seen{};
    for (size_t i = 0; i < kSampleNodes; ++i) {
      for (size_t k = 0; k < kSampleNodes; ++k) {
        const bool pair = (visible >> (i * kTransferNodes + k) & 1) != 0;
        seen[k] += pair ? receiver.share[g][i] : 0.0F;
      }
    }
    for (size_t q = 0; q < kMaxNodes; ++q) {
      const auto& share = source.share[q];
      (*kernel)[g * kMaxNodes + q] *=
          (seen[0] * share[0] + seen[1] * share[1]) +
          (seen[2] * share[2] + seen[3] * share[3]);
    }
  }
}

}  // namespace enfilade
