#include "solver/form_factor.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

constexpr float kInversePi = static_cast<float>(1 / kPi);

struct Clipped {
  std::array<Vec3, 8> points{};
  size_t count = 0;
};

// The polygon relative to x, without what lies below the horizon.
Clipped ClipToHorizon(Vec3f x, Vec3f n, std::span<const Vec3f> polygon) {
  const auto relative = [&](Vec3f p) {
    return Vec3{static_cast<double>(p.x) - static_cast<double>(x.x),
                static_cast<double>(p.y) - static_cast<double>(x.y),
                static_cast<double>(p.z) - static_cast<double>(x.z)};
  };
  const Vec3 normal{n.x, n.y, n.z};
  Clipped out;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 a = relative(polygon[i]);
    const Vec3 b = relative(polygon[(i + 1) % polygon.size()]);
    const double height_a = Dot(a, normal);
    const double height_b = Dot(b, normal);
    if (height_a >= 0) {
      out.points[out.count++] = a;
    }
    if ((height_a > 0 && height_b < 0) || (height_a < 0 && height_b > 0)) {
      out.points[out.count++] =
          a + (b - a) * (height_a / (height_a - height_b));
    }
  }
  return out;
}

}  // namespace

float PointToPolygon(Vec3f x, Vec3f n, std::span<const Vec3f> polygon) {
  const Clipped clipped = ClipToHorizon(x, n, polygon);
  const Vec3 normal{n.x, n.y, n.z};
  double sum = 0;
  for (size_t i = 0; i < clipped.count; ++i) {
    const Vec3 a = clipped.points[i];
    const Vec3 b = clipped.points[(i + 1) % clipped.count];
    const Vec3 cross = Cross(a, b);
    const double sine = Length(cross);
    if (sine > 1e-14) {
      sum += std::atan2(sine, Dot(a, b)) * Dot(normal, cross) / sine;
    }
  }
  return static_cast<float>(std::clamp(std::abs(sum) / (2 * kPi), 0.0, 1.0));
}

TransferEnd MakeTransferEnd(const PatchGeometry& patch, ElementFrame frame) {
  // The Gauss points of the unit square and of the unit triangle.
  constexpr float kLow = 0.21132487F;
  constexpr float kHigh = 0.78867513F;
  constexpr float kSixth = 1.0F / 6;
  constexpr std::array<std::array<float, 2>, 4> kSquare = {
      {{kLow, kLow}, {kHigh, kLow}, {kLow, kHigh}, {kHigh, kHigh}}};
  constexpr std::array<std::array<float, 2>, 4> kTriangle = {
      {{kSixth, kSixth},
       {4 * kSixth, kSixth},
       {kSixth, 4 * kSixth},
       {2 * kSixth, 2 * kSixth}}};
  const bool triangle = patch.shape == PatchShape::kTriangle;
  TransferEnd end;
  end.patch = &patch;
  end.frame = frame;
  end.area = AreaOf(patch, frame);
  end.diameter = DiameterOf(patch, frame);
  end.node_count = triangle ? 3 : 4;
  const float middle = triangle ? 1.0F / 3 : 0.5F;
  end.center = PointOn(patch, frame, middle, middle);
  for (size_t i = 0; i < kTransferNodes; ++i) {
    const auto& at = triangle ? kTriangle[i] : kSquare[i];
    const Vec3f p = PointOn(patch, frame, at[0], at[1]);
    end.x[i] = p.x;
    end.y[i] = p.y;
    end.z[i] = p.z;
    end.weight[i] =
        i < end.node_count ? 1 / static_cast<float>(end.node_count) : 0.0F;
  }
  return end;
}

std::array<float, kTransferNodes> QuadratureRow(Vec3f x,
                                                Vec3f n,
                                                const TransferEnd& source) {
  const Vec3f m = source.patch->normal;
  const float scale = source.area * kInversePi;
  std::array<float, kTransferNodes> row{};
  for (size_t q = 0; q < kTransferNodes; ++q) {
    const float dx = source.x[q] - x.x;
    const float dy = source.y[q] - x.y;
    const float dz = source.z[q] - x.z;
    const float r2 = dx * dx + dy * dy + dz * dz + 1e-12F;
    const float cos_x = std::max(0.0F, dx * n.x + dy * n.y + dz * n.z);
    const float cos_y = std::max(0.0F, -(dx * m.x + dy * m.y + dz * m.z));
    row[q] = scale * source.weight[q] * cos_x * cos_y / (r2 * r2);
  }
  return row;
}

Kernel QuadratureKernel(const TransferEnd& receiver,
                        const TransferEnd& source) {
  Kernel kernel{};
  for (size_t g = 0; g < kTransferNodes; ++g) {
    const auto row =
        QuadratureRow({receiver.x[g], receiver.y[g], receiver.z[g]},
                      receiver.patch->normal,
                      source);
    for (size_t q = 0; q < kTransferNodes; ++q) {
      kernel[g * kTransferNodes + q] = row[q];
    }
  }
  return kernel;
}

std::array<float, kTransferNodes> NearRow(Vec3f x,
                                          Vec3f n,
                                          const TransferEnd& source) {
  std::array<float, kTransferNodes> row{};
  if (Dot(x - source.patch->origin, source.patch->normal) <= 0) {
    return row;
  }
  const Corners corners = CornersOf(*source.patch, source.frame);
  const float exact = PointToPolygon(x, n, corners.View());
  row = QuadratureRow(x, n, source);
  float sum = 0;
  for (const float k : row) {
    sum += k;
  }
  // Blend towards the uniform spread, so that no row is left without a node.
  const float floor = 0.02F * sum + 1e-9F;
  const float scale = exact / (sum + floor);
  for (size_t q = 0; q < kTransferNodes; ++q) {
    row[q] = scale * (row[q] + floor * source.weight[q]);
  }
  return row;
}

namespace {

// Exact rows: what each receiver node sees of the source.
Kernel KernelByRows(const TransferEnd& receiver, const TransferEnd& source) {
  Kernel kernel{};
  for (size_t g = 0; g < receiver.node_count; ++g) {
    const auto row = NearRow({receiver.x[g], receiver.y[g], receiver.z[g]},
                             receiver.patch->normal,
                             source);
    for (size_t q = 0; q < kTransferNodes; ++q) {
      kernel[g * kTransferNodes + q] = row[q];
    }
  }
  return kernel;
}

// Exact columns: what each source node sees of the receiver, by reciprocity
// A_r F_rs = A_s F_sr. A source that is small and close lights a spot that may
// lie between the receiver's nodes; its flux is right all the same.
Kernel KernelByColumns(const TransferEnd& receiver, const TransferEnd& source) {
  Kernel kernel{};
  for (size_t q = 0; q < source.node_count; ++q) {
    const auto column = NearRow({source.x[q], source.y[q], source.z[q]},
                                source.patch->normal,
                                receiver);
    const float scale = source.area * source.weight[q] / receiver.area;
    for (size_t g = 0; g < receiver.node_count; ++g) {
      kernel[g * kTransferNodes + q] = scale * column[g] / receiver.weight[g];
    }
  }
  return kernel;
}

}  // namespace

void MaskKernel(uint16_t visible, Kernel* kernel) {
  for (size_t i = 0; i < kernel->size(); ++i) {
    (*kernel)[i] = (visible >> i & 1) != 0 ? (*kernel)[i] : 0.0F;
  }
}

Kernel NearKernel(const TransferEnd& receiver, const TransferEnd& source) {
  return source.diameter < receiver.diameter ? KernelByColumns(receiver, source)
                                             : KernelByRows(receiver, source);
}

}  // namespace enfilade
