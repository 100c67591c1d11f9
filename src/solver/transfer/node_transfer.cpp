#include "solver/transfer/node_transfer.h"

#include "solver/transfer/oracle.h"

#include <algorithm>
#include <numeric>

namespace enfilade {
namespace {

using NodeRow = std::array<float, kMaxNodes>;

// A point with a normal, at which irradiance is computed.
struct SurfacePoint {
  Vec3f at;
  Vec3f normal;
};

// A_s w_q cos_x cos_y / (pi r^2)
NodeRow PlainRow(const SurfacePoint& x, const NodeEnd& source) {
  const Vec3f n = x.normal;
  const Vec3f m = source.end.patch->normal;
  const float scale = source.end.area * kInversePi;
  NodeRow row{};
  for (size_t q = 0; q < kMaxNodes; ++q) {
    const float dx = source.x[q] - x.at.x;
    const float dy = source.y[q] - x.at.y;
    const float dz = source.z[q] - x.at.z;
    const float r2 = dx * dx + dy * dy + dz * dz + 1e-12F;
    const float cos_x = std::max(0.0F, dx * n.x + dy * n.y + dz * n.z);
    const float cos_y = std::max(0.0F, -(dx * m.x + dy * m.y + dz * m.z));
    row[q] = scale * source.weight[q] * cos_x * cos_y / (r2 * r2);
  }
  return row;
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

// The form factor to the whole source, spread over its nodes like PlainRow plus
// a small even part, so that no row is left without a node.
NodeRow SpreadRow(const SurfacePoint& x, const NodeEnd& source) {
  const Corners corners = CornersOf(*source.end.patch, source.end.frame);
  const float exact = PointToPolygon(x.at, x.normal, corners.View());
  NodeRow row = PlainRow(x, source);
  const float sum = std::accumulate(row.begin(), row.end(), 0.0F);
  const float floor = 0.02F * sum + 1e-9F;
  const float scale = exact / (sum + floor);
  for (size_t q = 0; q < row.size(); ++q) {
    row[q] = scale * (row[q] + floor * source.weight[q]);
  }
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
    end.x[i] = p.x;
    end.y[i] = p.y;
    end.z[i] = p.z;
    end.weight[i] = i < end.count ? static_cast<float>(basis.Weight(i)) : 0.0F;
  }
  return end;
}

NodeKernel FarNodeKernel(const NodeEnd& receiver, const NodeEnd& source) {
  NodeKernel kernel{};
  for (size_t g = 0; g < receiver.count; ++g) {
    const NodeRow row =
        PlainRow({receiver.At(g), receiver.end.patch->normal}, source);
    std::copy(row.begin(), row.end(), kernel.begin() + g * kMaxNodes);
  }
  return kernel;
}

NodeKernel NearNodeKernel(const NodeEnd& receiver, const NodeEnd& source) {
  NodeKernel kernel{};
  if (!IsByColumns(receiver.end, source.end)) {
    for (size_t g = 0; g < receiver.count; ++g) {
      const NodeRow row =
          ExactRow({receiver.At(g), receiver.end.patch->normal}, source);
      std::copy(row.begin(), row.end(), kernel.begin() + g * kMaxNodes);
    }
    return kernel;
  }
  // By reciprocity A_r F_rs = A_s F_sr, the flux of a small source is right
  // wherever the spot that the source lights lies.
  for (size_t q = 0; q < source.count; ++q) {
    const NodeRow column =
        ExactRow({source.At(q), source.end.patch->normal}, receiver);
    const float scale = source.end.area * source.weight[q] / receiver.end.area;
    for (size_t g = 0; g < receiver.count; ++g) {
      kernel[g * kMaxNodes + q] = scale * column[g] / receiver.weight[g];
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
