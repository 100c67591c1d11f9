#include "solver/reference/hierarchical_transfer.h"

#include "solver/reference/form_factor_kinds.h"

#include <algorithm>

namespace enfilade {
namespace {

// Points nearer than this share of the shorter edge count as one.
constexpr float kTouch = 1e-3F;

struct Edge {
  Vec3f from;
  Vec3f to;
};

bool Overlap(const Edge& a, const Edge& b) {
  const Vec3f along = a.to - a.from;
  const float length = Length(along);
  const float tolerance = kTouch * std::min(length, Length(b.to - b.from));
  const Vec3f unit = along * (1 / length);
  float low = length;
  float high = 0;
  for (const Vec3f p : {b.from, b.to}) {
    const Vec3f d = p - a.from;
    const float at = Dot(d, unit);
    if (Length(d - unit * at) > tolerance) {
      return false;
    }
    low = std::min(low, at);
    high = std::max(high, at);
  }
  return std::min(high, length) - std::max(low, 0.0F) > tolerance;
}

Edge EdgeOf(const Corners& corners, size_t i) {
  return {corners.points[i], corners.points[(i + 1) % corners.count]};
}

// One form factor for each pair of cells.
template <typename FormFactor>
NodeKernel BetweenCells(const Coupling& coupling,
                        const FormFactor& form_factor) {
  std::array<TransferEnd, kMaxNodes> sources;
  for (size_t q = 0; q < coupling.source.count; ++q) {
    sources[q] = CellOf(coupling.source, q);
  }
  NodeKernel kernel{};
  for (size_t g = 0; g < coupling.receiver.count; ++g) {
    const TransferEnd cell = CellOf(coupling.receiver, g);
    for (size_t q = 0; q < coupling.source.count; ++q) {
      kernel[g * kMaxNodes + q] = form_factor(cell, sources[q]);
    }
  }
  return kernel;
}

// change[g][h] is the coefficient g, in the basis `to`, of function h of
// `from`.
NodeKernel ChangeOf(const ShapeBasis& to, const ShapeBasis& from) {
  NodeKernel change{};
  for (size_t g = 0; g < to.NodeCount(); ++g) {
    const auto row = to.CoefficientsOf(from, g);
    for (size_t h = 0; h < from.NodeCount(); ++h) {
      change[g * kMaxNodes + h] = static_cast<float>(row[h]);
    }
  }
  return change;
}

NodeKernel Product(const NodeKernel& a, const NodeKernel& b) {
  NodeKernel product{};
  for (size_t i = 0; i < kMaxNodes; ++i) {
    for (size_t k = 0; k < kMaxNodes; ++k) {
      const float factor = a[i * kMaxNodes + k];
      for (size_t j = 0; factor != 0 && j < kMaxNodes; ++j) {
        product[i * kMaxNodes + j] += factor * b[k * kMaxNodes + j];
      }
    }
  }
  return product;
}

}  // namespace

bool AbutAlongEdge(const TransferEnd& a, const TransferEnd& b) {
  if (Length(a.center - b.center) > a.diameter + b.diameter) {
    return false;
  }
  const Corners of_a = CornersOf(*a.patch, a.frame);
  const Corners of_b = CornersOf(*b.patch, b.frame);
  for (size_t i = 0; i < of_a.count; ++i) {
    for (size_t j = 0; j < of_b.count; ++j) {
      if (Overlap(EdgeOf(of_a, i), EdgeOf(of_b, j))) {
        return true;
      }
    }
  }
  return false;
}

TransferEnd CellOf(const NodeEnd& end, size_t i) {
  if (end.basis->Cells().empty()) {
    return end.end;
  }
  const ChildFrame& cell = end.basis->Cells()[i];
  const ElementFrame& whole = end.end.frame;
  return MakeTransferEnd(*end.end.patch,
                         {whole.a + whole.scale * static_cast<float>(cell.a),
                          whole.b + whole.scale * static_cast<float>(cell.b),
                          whole.scale * static_cast<float>(cell.scale)});
}

HierarchicalTransfer::HierarchicalTransfer(const Basis& basis,
                                           SingularRule rule)
    : basis_(basis), rule_(rule) {
  if (rule == SingularRule::kFlatlets && basis.kind.order > 1) {
    flatlets_.emplace(BasisKind{basis.kind.order, true});
    for (const PatchShape shape :
         {PatchShape::kParallelogram, PatchShape::kTriangle}) {
      const auto i = static_cast<size_t>(shape);
      to_nodes_[i] = ChangeOf(basis.On(shape), flatlets_->On(shape));
      to_flatlets_[i] = ChangeOf(flatlets_->On(shape), basis.On(shape));
    }
  }
}

Coupling HierarchicalTransfer::Couple(const TransferEnd& receiver,
                                      const TransferEnd& source,
                                      bool abut) const {
  const Basis& basis = abut && flatlets_ ? *flatlets_ : basis_;
  const auto end = [&](const TransferEnd& e) {
    return MakeNodeEnd(basis.On(e.patch->shape), *e.patch, e.frame);
  };
  return {end(receiver), end(source), &basis, abut};
}

NodeKernel HierarchicalTransfer::Unoccluded(const Coupling& coupling) const {
  switch (rule_) {
    case SingularRule::kSwitch:
      return BetweenCells(coupling, SwitchOver);
    case SingularRule::kNear:
      return TransferKernel(coupling.receiver, coupling.source);
    case SingularRule::kFlatlets:
      if (coupling.abut) {
        return BetweenCells(coupling, CenterToPolygon);
      }
      break;
    case SingularRule::kNone:
      break;
  }
  return FarNodeKernel(coupling.receiver, coupling.source);
}

NodeKernel HierarchicalTransfer::InBasis(const Coupling& coupling,
                                         const NodeKernel& kernel) const {
  if (coupling.basis == &basis_) {
    return kernel;
  }
  const auto receiver = static_cast<size_t>(coupling.receiver.end.patch->shape);
  const auto source = static_cast<size_t>(coupling.source.end.patch->shape);
  return Product(Product(to_nodes_[receiver], kernel), to_flatlets_[source]);
}

}  // namespace enfilade
