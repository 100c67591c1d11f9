#include "solver/oracle.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace enfilade {
namespace {

// A source nearer than this many of its diameters gets exact form factors.
constexpr float kNearDiameters = 2.0F;
// RMS over the element per RMS over the test points, of a residual quadratic
// in the receiver's coordinates (second order) or linear (constant basis).
constexpr float kBilinearResidual = 0.6F;
constexpr float kConstantResidual = 0.9F;
// Of the variance of sixteen samples, the part that is blamed on the larger
// end rather than on the end with which they vary.
constexpr float kVarianceNoise = 0.15F;

// The point of an element that is nearest to p, a little off the rim.
UnitPoint NearestOn(const TransferEnd& end, Vec3f p) {
  const PatchGeometry& patch = *end.patch;
  const Vec3f d = p - PointOn(patch, end.frame, 0, 0);
  const Vec3f u = patch.u * end.frame.scale;
  const Vec3f v = patch.v * end.frame.scale;
  const float uu = Dot(u, u);
  const float uv = Dot(u, v);
  const float vv = Dot(v, v);
  const float determinant = std::max(uu * vv - uv * uv, 1e-20F);
  const float du = Dot(d, u);
  const float dv = Dot(d, v);
  constexpr float kRim = 0.03F;
  float s = std::clamp((vv * du - uv * dv) / determinant, kRim, 1 - kRim);
  float t = std::clamp((uu * dv - uv * du) / determinant, kRim, 1 - kRim);
  if (patch.shape == PatchShape::kTriangle && s + t > 1 - kRim) {
    const float scale = (1 - kRim) / (s + t);
    s *= scale;
    t *= scale;
  }
  return {static_cast<double>(s), static_cast<double>(t)};
}

// Where the receiver's basis is tested: off its nodes, a little off its rim.
std::span<const UnitPoint> TestPoints(PatchShape shape) {
  static constexpr std::array<UnitPoint, 5> kSquare = {
      {{0.5, 0.5}, {0.04, 0.5}, {0.96, 0.5}, {0.5, 0.04}, {0.5, 0.96}}};
  static constexpr std::array<UnitPoint, 4> kTriangle = {
      {{1.0 / 3, 1.0 / 3}, {0.48, 0.04}, {0.04, 0.48}, {0.48, 0.48}}};
  if (shape == PatchShape::kTriangle) {
    return kTriangle;
  }
  return kSquare;
}

// The values of the second-order Lagrange functions at the test points.
struct TestTable {
  Basis basis{2};
  std::array<std::array<std::array<float, kTransferNodes>, 5>, 2> values{};

  TestTable() {
    for (const PatchShape shape :
         {PatchShape::kParallelogram, PatchShape::kTriangle}) {
      const auto points = TestPoints(shape);
      for (size_t i = 0; i < points.size(); ++i) {
        const auto all = basis.On(shape).Evaluate(points[i]);
        for (size_t g = 0; g < kTransferNodes; ++g) {
          values[static_cast<size_t>(shape)][i][g] = static_cast<float>(all[g]);
        }
      }
    }
  }
};

const TestTable& Tests() {
  static const TestTable table;
  return table;
}

float WeightedSum(const float* row,
                  const std::array<float, kTransferNodes>& radiosity) {
  return (row[0] * radiosity[0] + row[1] * radiosity[1]) +
         (row[2] * radiosity[2] + row[3] * radiosity[3]);
}

}  // namespace

bool IsNear(const TransferEnd& r, const TransferEnd& s) {
  return Length(s.center - r.center) - 0.5F * r.diameter <
         kNearDiameters * s.diameter;
}

bool IsBehind(const TransferEnd& end, const PatchGeometry& patch) {
  const float tolerance = 1e-5F * (1 + patch.diameter);
  const Corners corners = CornersOf(*end.patch, end.frame);
  return std::all_of(
      corners.View().begin(), corners.View().end(), [&](Vec3f p) {
        return Dot(p - patch.origin, patch.normal) <= tolerance;
      });
}

float FormFactorBound(const TransferEnd& r, const TransferEnd& s) {
  const Vec3f d = s.center - r.center;
  const float distance = Length(d);
  const float reach = 0.5F * (r.diameter + s.diameter);
  const float gap = distance - reach;
  if (gap <= 0.25F * s.diameter) {
    return 1;
  }
  const float cos_x =
      std::clamp((Dot(d, r.patch->normal) + reach) / gap, 0.0F, 1.0F);
  const float cos_y =
      std::clamp((reach - Dot(d, s.patch->normal)) / gap, 0.0F, 1.0F);
  return std::min(
      1.0F, s.area * cos_x * cos_y / (static_cast<float>(kPi) * gap * gap));
}

float ReceiverShare(uint16_t bits, const TransferEnd& r, const TransferEnd& s) {
  std::array<float, kTransferNodes> rows{};
  std::array<float, kTransferNodes> columns{};
  float mean = 0;
  for (size_t g = 0; g < r.node_count; ++g) {
    for (size_t q = 0; q < s.node_count; ++q) {
      const size_t bit = g * kTransferNodes + q;
      const float v = (bits >> bit & 1) != 0 ? 1.0F : 0.0F;
      rows[g] += v * s.weight[q];
      columns[q] += v * r.weight[g];
      mean += v * s.weight[q] * r.weight[g];
    }
  }
  float by_row = 0;
  for (size_t g = 0; g < r.node_count; ++g) {
    by_row += r.weight[g] * (rows[g] - mean) * (rows[g] - mean);
  }
  float by_column = 0;
  for (size_t q = 0; q < s.node_count; ++q) {
    by_column += s.weight[q] * (columns[q] - mean) * (columns[q] - mean);
  }
  const float size = r.diameter / (r.diameter + s.diameter + 1e-9F);
  const float noise = kVarianceNoise * mean * (1 - mean) + 1e-3F;
  return (by_row + noise * size) / (by_row + by_column + noise);
}

Judgement Judge(const TransferEnd& r,
                const RadiantEnd& s,
                bool constant_basis) {
  Judgement j;
  j.near = IsNear(r, s.end);
  j.kernel = j.near ? NearKernel(r, s.end) : QuadratureKernel(r, s.end);
  std::array<float, kTransferNodes> at_nodes{};
  float form_factor = 0;  // the largest seen
  for (size_t g = 0; g < r.node_count; ++g) {
    const float* row = &j.kernel[g * kTransferNodes];
    at_nodes[g] = WeightedSum(row, s.radiosity);
    j.transfer += r.weight[g] * at_nodes[g];
    form_factor += r.weight[g] * ((row[0] + row[1]) + (row[2] + row[3]));
  }
  const PatchShape shape = r.patch->shape;
  const auto residual_at = [&](UnitPoint at, const float* lagrange) {
    const Vec3f x = PointOn(
        *r.patch, r.frame, static_cast<float>(at.a), static_cast<float>(at.b));
    const auto row = j.near ? NearRow(x, r.patch->normal, s.end)
                            : QuadratureRow(x, r.patch->normal, s.end);
    form_factor = std::max(form_factor, (row[0] + row[1]) + (row[2] + row[3]));
    const float fit =
        constant_basis ? j.transfer : WeightedSum(lagrange, at_nodes);
    return WeightedSum(row.data(), s.radiosity) - fit;
  };
  const auto points = TestPoints(shape);
  float square = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto& lagrange = Tests().values[static_cast<size_t>(shape)][i];
    const float residual = residual_at(points[i], lagrange.data());
    square += residual * residual;
  }
  square /= static_cast<float>(points.size());
  if (s.end.diameter < 2 * r.diameter && j.near) {
    // A small source close to a large receiver peaks between its nodes: over
    // an area like the source's, widened by its distance.
    const UnitPoint at = NearestOn(r, s.end.center);
    const auto values = Tests().basis.On(shape).Evaluate(at);
    std::array<float, kTransferNodes> lagrange{};
    for (size_t g = 0; g < r.node_count; ++g) {
      lagrange[g] = static_cast<float>(values[g]);
    }
    const Vec3f x = PointOn(
        *r.patch, r.frame, static_cast<float>(at.a), static_cast<float>(at.b));
    const Vec3f d = s.end.center - x;
    const float residual = residual_at(at, lagrange.data());
    square +=
        residual * residual * std::min(1.0F, (s.end.area + Dot(d, d)) / r.area);
  }
  j.receiver_error = (constant_basis ? kConstantResidual : kBilinearResidual) *
                     std::sqrt(square);
  // The source's radiosity beyond its nodes, damped by the kernel's
  // smoothness: one order of distance per order of the basis.
  const float distance = Length(s.end.center - r.center);
  float damping = std::min(1.0F, s.end.diameter / std::max(distance, 1e-6F));
  damping = constant_basis ? damping : damping * damping;
  const auto [low, high] = std::minmax_element(
      s.radiosity.begin(),
      s.radiosity.begin() + static_cast<std::ptrdiff_t>(s.end.node_count));
  const float spread = j.near ? 0.25F * (*high - *low) * damping : 0.0F;
  j.source_error = form_factor * (s.detail * damping + spread);
  return j;
}

}  // namespace enfilade
