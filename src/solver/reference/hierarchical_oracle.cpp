#include "solver/reference/hierarchical_oracle.h"

#include "solver/reference/hierarchical_transfer.h"
#include "solver/transfer/fit_residual.h"
#include "solver/transfer/oracle.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace enfilade {
namespace {

float HeightOver(const TransferEnd& plane, Vec3f p) {
  return Dot(p - plane.center, plane.patch->normal);
}

// The solid angle of an end as the other end sees it, times their distance
// cubed.
float ProjectedArea(const TransferEnd& end, const TransferEnd& seen_from) {
  return end.area * std::max(0.0F, HeightOver(end, seen_from.center));
}

// |B| of a coefficient, mean of the channels.
float BrightnessAt(const CandidateLink& link, size_t stride, size_t q) {
  float sum = 0;
  for (size_t c = 0; c < kRgbChannels; ++c) {
    sum += std::abs(link.radiosity[c * stride + q]);
  }
  return sum / static_cast<float>(kRgbChannels);
}

float MeanBrightness(const CandidateLink& link, size_t stride) {
  float mean = 0;
  for (size_t q = 0; q < link.source.count; ++q) {
    mean += link.source.nodes.weight[q] * BrightnessAt(link, stride, q);
  }
  return mean;
}

// A_s cos cos / (pi r^2) between points of both ends.
float KernelBetween(UnitPoint x,
                    UnitPoint y,
                    const TransferEnd& receiver,
                    const TransferEnd& source) {
  const auto at = [](const TransferEnd& end, UnitPoint p) {
    return PointOn(*end.patch,
                   end.frame,
                   static_cast<float>(p.a),
                   static_cast<float>(p.b));
  };
  const Vec3f d = at(source, y) - at(receiver, x);
  const float r2 = Dot(d, d) + 1e-12F;
  return source.area * std::max(0.0F, Dot(d, receiver.patch->normal)) *
         std::max(0.0F, -Dot(d, source.patch->normal)) * kInversePi / (r2 * r2);
}

}  // namespace

float FormFactorEstimate(const TransferEnd& receiver,
                         const TransferEnd& source) {
  const Vec3f d = source.center - receiver.center;
  const float r2 = std::max(Dot(d, d), 1e-12F);
  const float least = std::max(receiver.diameter, source.diameter) / 2;
  const float over_receiver =
      std::max(least, HeightOver(receiver, source.center));
  const float over_source =
      std::max(least, HeightOver(source, receiver.center));
  return std::min(
      1.0F, source.area * over_receiver * over_source * kInversePi / (r2 * r2));
}

HierarchicalOracle::HierarchicalOracle(OracleKind kind,
                                       const Basis& basis,
                                       Light light)
    : kind_(kind),
      basis_(basis),
      light_(light),
      polynomials_(basis.kind.order),
      tests_{ValuesOf(polynomials_.parallelogram),
             ValuesOf(polynomials_.triangle)} {}

HierarchicalOracle::TestValues HierarchicalOracle::ValuesOf(
    const ShapeBasis& basis) {
  TestValues values;
  for (const UnitPoint p : TestPoints(basis.Shape())) {
    const auto functions = basis.Evaluate(p);
    std::transform(functions.begin(),
                   functions.end(),
                   values.emplace_back().begin(),
                   [](double v) { return static_cast<float>(v); });
  }
  return values;
}

LinkError HierarchicalOracle::Error(const CandidateLink& link) const {
  const TransferEnd& receiver = link.receiver.end;
  const TransferEnd& source = link.source.end;
  const bool source_looks_larger =
      ProjectedArea(source, receiver) > ProjectedArea(receiver, source);
  switch (kind_) {
    case OracleKind::kFormFactor:
      return {FormFactorError(link), source_looks_larger};
    case OracleKind::kPower:
      return {PowerError(link), source_looks_larger};
    case OracleKind::kPolynomial:
      return {PolynomialError(link), source_looks_larger};
    case OracleKind::kTransfer:
      break;
  }
  return TransferError(link);
}

float HierarchicalOracle::FormFactorError(const CandidateLink& link) const {
  return std::max(FormFactorEstimate(link.receiver.end, link.source.end),
                  FormFactorEstimate(link.source.end, link.receiver.end));
}

float HierarchicalOracle::PowerError(const CandidateLink& link) const {
  const size_t stride = basis_.parallelogram.NodeCount();
  const auto power = [&](const TransferEnd& r, const TransferEnd& s, float b) {
    return r.area * FormFactorEstimate(r, s) * b /
           static_cast<float>(light_.emitted_power);
  };
  if (!basis_.kind.flat) {
    return power(
        link.receiver.end, link.source.end, MeanBrightness(link, stride));
  }
  float largest = 0;
  for (size_t q = 0; q < link.source.count; ++q) {
    const TransferEnd source = CellOf(link.source, q);
    const float brightness = BrightnessAt(link, stride, q);
    for (size_t g = 0; g < link.receiver.count; ++g) {
      largest = std::max(largest,
                         power(CellOf(link.receiver, g), source, brightness));
    }
  }
  return largest;
}

float HierarchicalOracle::PolynomialError(const CandidateLink& link) const {
  const TransferEnd& receiver = link.receiver.end;
  const TransferEnd& source = link.source.end;
  const ShapeBasis& r_basis = polynomials_.On(receiver.patch->shape);
  const ShapeBasis& s_basis = polynomials_.On(source.patch->shape);
  const size_t r_count = r_basis.NodeCount();
  const size_t s_count = s_basis.NodeCount();
  NodeKernel nodes{};
  for (size_t g = 0; g < r_count; ++g) {
    for (size_t q = 0; q < s_count; ++q) {
      nodes[g * kMaxNodes + q] =
          KernelBetween(r_basis.Node(g), s_basis.Node(q), receiver, source);
    }
  }
  const TestValues& r_values = tests_[static_cast<size_t>(r_basis.Shape())];
  const TestValues& s_values = tests_[static_cast<size_t>(s_basis.Shape())];
  float sum = 0;
  for (size_t i = 0; i < r_values.size(); ++i) {
    std::array<float, kMaxNodes> row{};  // the polynomial, by source node
    for (size_t g = 0; g < r_count; ++g) {
      for (size_t q = 0; q < s_count; ++q) {
        row[q] += r_values[i][g] * nodes[g * kMaxNodes + q];
      }
    }
    for (size_t j = 0; j < s_values.size(); ++j) {
      float fit = 0;
      for (size_t q = 0; q < s_count; ++q) {
        fit += s_values[j][q] * row[q];
      }
      sum += std::abs(fit - KernelBetween(TestPoints(r_basis.Shape())[i],
                                          TestPoints(s_basis.Shape())[j],
                                          receiver,
                                          source));
    }
  }
  const float mean =
      sum / static_cast<float>(r_values.size() * s_values.size());
  return receiver.area * std::min(1.0F, mean) *
         MeanBrightness(link, basis_.parallelogram.NodeCount()) /
         static_cast<float>(light_.emitted_power);
}

LinkError HierarchicalOracle::TransferError(const CandidateLink& link) const {
  const SampleMap& samples = basis_.SamplesOn(link.source.end.patch->shape);
  const size_t stride = basis_.parallelogram.NodeCount();
  RadiantEnd source{link.source.end, {}, link.detail};
  for (size_t i = 0; i < link.source.end.node_count; ++i) {
    for (size_t c = 0; c < kRgbChannels; ++c) {
      float value = 0;
      for (size_t q = 0; q < link.source.count; ++q) {
        value += samples.to_samples[q][i] * link.radiosity[c * stride + q];
      }
      source.radiosity[i] = std::max(source.radiosity[i], value);
    }
  }
  const TransferEnd& receiver = link.receiver.end;
  const Judgement judged = Judge(receiver, source, basis_);
  const double scale =
      static_cast<double>(receiver.patch->max_reflectance) *
      std::sqrt(static_cast<double>(receiver.area) / light_.area) /
      (light_.emitted_power / light_.area);
  return {static_cast<float>(scale) *
              std::hypot(judged.receiver_error, judged.source_error),
          judged.source_error > judged.receiver_error};
}

}  // namespace enfilade
