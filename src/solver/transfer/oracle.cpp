#include "solver/transfer/oracle.h"

#include "partition/overlap.h"
#include "solver/transfer/fit_residual.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

namespace enfilade {
namespace {

// A source within this many of its diameters gets exact form factors.
constexpr float kNearDiameters = 2.0F;
// This part of the variance of sixteen samples is noise; it is divided between
// the ends by their diameters instead of by where the samples vary.
constexpr float kVarianceNoise = 0.15F;

// The values of a basis's functions at the test points. The constant basis uses
// the second-order table, because its transfers are sampled at the second-order
// nodes too.
struct TestTable {
  Basis basis;
  std::array<std::array<std::array<float, kMaxNodes>, 5>, 2> values{};

  explicit TestTable(BasisKind kind) : basis(kind) {
    for (const PatchShape shape :
         {PatchShape::kParallelogram, PatchShape::kTriangle}) {
      const auto points = TestPoints(shape);
      for (size_t i = 0; i < points.size(); ++i) {
        const auto all = basis.On(shape).Evaluate(points[i]);
        for (size_t g = 0; g < kMaxNodes; ++g) {
          values[static_cast<size_t>(shape)][i][g] = static_cast<float>(all[g]);
        }
      }
    }
  }
};

const TestTable& TestsOf(BasisKind kind) {
  static const TestTable second({2, false});
  static const TestTable third({3, false});
  static const TestTable fourth({4, false});
  static const TestTable flat_second({2, true});
  static const TestTable flat_third({3, true});
  if (kind.flat) {
    return kind.order == 2 ? flat_second : flat_third;
  }
  return kind.order == 4 ? fourth : kind.order == 3 ? third : second;
}

// The distance, m, by which an element reaches beyond its center along a
// direction.
float ExtentAlong(const TransferEnd& end, Vec3f direction) {
  const float u = end.frame.scale * Dot(end.patch->u, direction);
  const float v = end.frame.scale * Dot(end.patch->v, direction);
  if (end.patch->shape == PatchShape::kTriangle) {
    return (std::max({0.0F, u, v}) * 3 - (u + v)) / 3;
  }
  return 0.5F * (std::abs(u) + std::abs(v));
}

float WeightedSum(const float* row,
                  const std::array<float, kTransferNodes>& radiosity) {
  return (row[0] * radiosity[0] + row[1] * radiosity[1]) +
         (row[2] * radiosity[2] + row[3] * radiosity[3]);
}

}  // namespace

float SecondOrderAt(PatchShape shape,
                    UnitPoint at,
                    const std::array<float, kTransferNodes>& at_nodes) {
  const auto functions = TestsOf({2, false}).basis.On(shape).Evaluate(at);
  float value = 0;
  for (size_t g = 0; g < kTransferNodes; ++g) {
    value += static_cast<float>(functions[g]) * at_nodes[g];
  }
  return value;
}

bool IsNear(const TransferEnd& r, const TransferEnd& s) {
  return Length(s.center - r.center) - 0.5F * r.diameter <
             kNearDiameters * s.diameter ||
         IsCut(s, *r.patch);
}

bool IsBehind(const TransferEnd& end, const PatchGeometry& patch) {
  constexpr auto kClosed = static_cast<float>(kCoincidentM);
  const float rounding = PlaneTolerance(patch);
  // The centers of most elements are well in front of the plane, and then so is
  // a corner, whatever the rounding.
  if (Dot(end.center - patch.origin, patch.normal) >
      std::max(10 * rounding, 2 * kClosed)) {
    return false;
  }
  const bool faces =
      Dot(end.patch->normal, patch.normal) < -static_cast<float>(kLeastFacing);
  const float tolerance = faces ? std::max(kClosed, rounding) : rounding;
  const Corners corners = CornersOf(*end.patch, end.frame);
  return std::all_of(
      corners.View().begin(), corners.View().end(), [&](Vec3f p) {
        return Dot(p - patch.origin, patch.normal) <= tolerance;
      });
}

float FormFactorBound(const TransferEnd& r, const TransferEnd& s) {
  const Vec3f d = s.center - r.center;
  const float gap = Length(d) - (r.radius + s.radius);
  if (gap <= 0.25F * s.diameter) {
    return 1;
  }
  // Each element lies in its own plane. The height of the other end above that
  // plane therefore bounds the cosine, whatever the element's own size.
  const Vec3f n_r = r.patch->normal;
  const Vec3f n_s = s.patch->normal;
  const float cos_x =
      std::clamp((Dot(d, n_r) + ExtentAlong(s, n_r)) / gap, 0.0F, 1.0F);
  const float cos_y =
      std::clamp((ExtentAlong(r, n_s) - Dot(d, n_s)) / gap, 0.0F, 1.0F);
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
      rows[g] += v * s.nodes.weight[q];
      columns[q] += v * r.nodes.weight[g];
      mean += v * s.nodes.weight[q] * r.nodes.weight[g];
    }
  }
  float by_row = 0;
  for (size_t g = 0; g < r.node_count; ++g) {
    by_row += r.nodes.weight[g] * (rows[g] - mean) * (rows[g] - mean);
  }
  float by_column = 0;
  for (size_t q = 0; q < s.node_count; ++q) {
    by_column += s.nodes.weight[q] * (columns[q] - mean) * (columns[q] - mean);
  }
  const float size = r.diameter / (r.diameter + s.diameter + 1e-9F);
  const float noise = kVarianceNoise * mean * (1 - mean) + 1e-3F;
  return (by_row + noise * size) / (by_row + by_column + noise);
}

namespace {

// The irradiance that a transfer brings to points of the receiver, compared
// with the function of the receiver's basis by which a link would replace it.
class LinkFit {
 public:
  LinkFit(const TransferEnd& receiver,
          const RadiantEnd& source,
          const Basis& basis,
          bool near)
      : receiver_(&receiver),
        source_(&source),
        tests_(&TestsOf(basis.kind)),
        constant_(basis.kind.order == 1),
        near_(near) {
    if (near) {
      near_source_.emplace(source.end);
    }
  }

  // Takes the mean and the values at the second-order nodes.
  void TakeFrom(const Judgement& judgement,
                const std::array<float, kTransferNodes>& at_nodes) {
    mean_ = judgement.transfer;
    std::copy(at_nodes.begin(), at_nodes.end(), at_nodes_.begin());
  }

  // Samples the nodes of a basis that has nodes of its own. If the transfer is
  // near and IsByColumns, scales the samples to the mean `flux`, so that the
  // nodes have what a link would give them.
  void SampleNodes(float flux) {
    const ShapeBasis& basis = tests_->basis.On(receiver_->patch->shape);
    count_ = basis.NodeCount();
    float mean = 0;
    for (size_t g = 0; g < count_; ++g) {
      at_nodes_[g] =
          WeightedSum(RowAt(basis.Node(g)).data(), source_->radiosity);
      mean += static_cast<float>(basis.Weight(g)) * at_nodes_[g];
    }
    if (near_ && IsByColumns(*receiver_, source_->end) && mean > 0) {
      for (size_t g = 0; g < count_; ++g) {
        at_nodes_[g] *= flux / mean;
      }
    }
  }

  // The residual that the basis cannot follow: at a test point, at any point.
  float ResidualAtTest(size_t i) {
    const PatchShape shape = receiver_->patch->shape;
    return ResidualAt(TestPoints(shape)[i],
                      tests_->values[static_cast<size_t>(shape)][i]);
  }

  float ResidualAt(UnitPoint at) {
    const auto values = tests_->basis.On(receiver_->patch->shape).Evaluate(at);
    std::array<float, kMaxNodes> functions{};
    std::transform(
        values.begin(), values.end(), functions.begin(), [](double v) {
          return static_cast<float>(v);
        });
    return ResidualAt(at, functions);
  }

  // The largest form factor of the points evaluated so far.
  [[nodiscard]] float LargestFormFactor() const { return form_factor_; }

  void NoteFormFactor(float form_factor) {
    form_factor_ = std::max(form_factor_, form_factor);
  }

 private:
  [[nodiscard]] std::array<float, kTransferNodes> RowAt(UnitPoint at) const {
    const SurfacePoint x = {PointOn(*receiver_->patch,
                                    receiver_->frame,
                                    static_cast<float>(at.a),
                                    static_cast<float>(at.b)),
                            receiver_->patch->normal};
    return near_ ? near_source_->Row(x) : QuadratureRow(x, source_->end);
  }

  float ResidualAt(UnitPoint at,
                   const std::array<float, kMaxNodes>& functions) {
    const auto row = RowAt(at);
    NoteFormFactor((row[0] + row[1]) + (row[2] + row[3]));
    return WeightedSum(row.data(), source_->radiosity) - Fit(functions);
  }

  [[nodiscard]] float Fit(const std::array<float, kMaxNodes>& functions) const {
    if (constant_) {
      return mean_;
    }
    float fit = (functions[0] * at_nodes_[0] + functions[1] * at_nodes_[1]) +
                (functions[2] * at_nodes_[2] + functions[3] * at_nodes_[3]);
    for (size_t g = kTransferNodes; g < count_; ++g) {
      fit += functions[g] * at_nodes_[g];
    }
    return fit;
  }

  const TransferEnd* receiver_;
  const RadiantEnd* source_;
  const TestTable* tests_;
  bool constant_;
  bool near_;
  std::optional<NearSource> near_source_;
  size_t count_ = kTransferNodes;
  float mean_ = 0;
  float form_factor_ = 0;
  std::array<float, kMaxNodes> at_nodes_{};
};

// The irradiance of the receiver's transfer nodes.
std::array<float, kTransferNodes> AtNodes(const Judgement& j,
                                          const TransferEnd& r,
                                          const RadiantEnd& s) {
  std::array<float, kTransferNodes> at_nodes{};
  for (size_t g = 0; g < r.node_count; ++g) {
    at_nodes[g] = WeightedSum(&j.kernel[g * kTransferNodes], s.radiosity);
  }
  return at_nodes;
}

}  // namespace

Judgement JudgeTransfer(const TransferEnd& r, const RadiantEnd& s) {
  Judgement j;
  j.near = IsNear(r, s.end);
  j.kernel = j.near ? NearKernel(r, s.end) : QuadratureKernel(r, s.end);
  const auto at_nodes = AtNodes(j, r, s);
  for (size_t g = 0; g < r.node_count; ++g) {
    const float* row = &j.kernel[g * kTransferNodes];
    j.transfer += r.nodes.weight[g] * at_nodes[g];
    j.form_factor +=
        r.nodes.weight[g] * ((row[0] + row[1]) + (row[2] + row[3]));
  }
  return j;
}

void JudgeErrors(const TransferEnd& r,
                 const RadiantEnd& s,
                 const Basis& basis,
                 Judgement* judgement) {
  Judgement& j = *judgement;
  LinkFit light(r, s, basis, j.near);
  light.NoteFormFactor(j.form_factor);
  if (basis.HasOwnNodes()) {
    light.SampleNodes(j.transfer);
  } else {
    light.TakeFrom(j, AtNodes(j, r, s));
  }
  SourceExtent extent{s.end.center, s.end.diameter, s.end.area, j.near, {}};
  if (IsCut(r, *s.end.patch)) {
    extent.lit_side = s.end.patch->normal;
  }
  j.receiver_error = RmsResidual(
      r,
      extent,
      basis,
      [&](size_t i) { return light.ResidualAtTest(i); },
      [&](UnitPoint at) { return light.ResidualAt(at); });
  // The source error: the radiosity that the source's nodes do not represent,
  // damped by the kernel's smoothness, by one power of diameter / distance per
  // order of the basis.
  const float distance = Length(s.end.center - r.center);
  const float ratio =
      std::min(1.0F, s.end.diameter / std::max(distance, 1e-6F));
  float damping = ratio;
  for (size_t i = 1; i < basis.kind.order; ++i) {
    damping *= ratio;
  }
  const auto [low, high] = std::minmax_element(
      s.radiosity.begin(),
      s.radiosity.begin() + static_cast<std::ptrdiff_t>(s.end.node_count));
  const float spread = j.near ? 0.25F * (*high - *low) * damping : 0.0F;
  j.form_factor = light.LargestFormFactor();
  j.source_error = j.form_factor * (s.detail * damping + spread);
}

Judgement Judge(const TransferEnd& r, const RadiantEnd& s, const Basis& basis) {
  Judgement j = JudgeTransfer(r, s);
  JudgeErrors(r, s, basis, &j);
  return j;
}

}  // namespace enfilade
