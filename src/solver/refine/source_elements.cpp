#include "solver/refine/source_elements.h"

#include "solver/transfer/fit_residual.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// Which child of an element lies nearest to a point.
size_t NearestChild(const TransferEnd& end, Vec3f p) {
  size_t nearest = 0;
  float least = INFINITY;
  for (size_t c = 0; c < kChildren; ++c) {
    const TransferEnd child =
        MakeTransferEnd(*end.patch, ChildOf(end.frame, end.patch->shape, c));
    const UnitPoint at = NearestOn(child, p);
    const float distance = Length(PointOn(*end.patch,
                                          child.frame,
                                          static_cast<float>(at.a),
                                          static_cast<float>(at.b)) -
                                  p);
    if (distance < least) {
      least = distance;
      nearest = c;
    }
  }
  return nearest;
}

}  // namespace

void SourceElements::SetRadiosity(SourceElement* source) const {
  source->radiosity =
      NodeRadiosity(*tree_, source->element, source->end.patch->shape);
  source->detail = tree_->Detail(source->element);
}

SourceElement SourceElements::OfPatch(uint32_t patch) const {
  SourceElement s;
  s.end = MakeTransferEnd(patches_[patch], {});
  s.patch = patch;
  s.element = ElementId(patch);
  SetRadiosity(&s);
  return s;
}

SourceElement SourceElements::OfChild(const SourceElement& parent,
                                      size_t child) const {
  SourceElement s;
  const PatchGeometry& patch = *parent.end.patch;
  s.end = MakeTransferEnd(patch, ChildOf(parent.end.frame, patch.shape, child));
  s.patch = parent.patch;
  s.path = ChildPath(parent.path, child);
  s.element = parent.element;
  if (parent.detail > 0) {
    s.element = ElementId(tree_->At(parent.element).first_child + child);
    SetRadiosity(&s);
    return s;
  }
  // If the parent has no detail, its children carry nothing beyond it. Whether
  // they exist must not matter, because links may have created them meanwhile.
  s.radiosity = Pushed(parent.radiosity, patch.shape, child);
  for (float& b : s.radiosity) {
    b = std::abs(b);
  }
  return s;
}

// The radiosity at a child's transfer nodes, from that at its parent's.
SourceElements::NodeValues SourceElements::Pushed(const NodeValues& parent,
                                                  PatchShape shape,
                                                  size_t child) const {
  if (tree_->Shape().NodeStride() == 1) {
    return parent;
  }
  const ShapeBasis& basis = SecondOrderBasis().On(shape);
  NodeValues pushed{};
  for (size_t q = 0; q < basis.NodeCount(); ++q) {
    double sum = 0;
    for (size_t g = 0; g < basis.NodeCount(); ++g) {
      sum += basis.Push(child, q, g) * static_cast<double>(parent[g]);
    }
    pushed[q] = static_cast<float>(sum);
  }
  return pushed;
}

// The oracle takes the source's detail as spread over all of the source; the
// kernel is likewise spread if the receiver is far. But if a bulb before a wall
// lights a spot of the wall and the shade beside the spot, detail and kernel
// are both concentrated. The elements below the source say where.
float SourceElements::NearestError(const SourceElement& source,
                                   const TransferEnd& receiver,
                                   float form_factor) const {
  float worth = 0;
  SourceElement below = source;
  NodeValues nodes = source.radiosity;
  while (below.detail > 0) {
    const size_t child = NearestChild(below.end, receiver.center);
    nodes = Pushed(nodes, below.end.patch->shape, child);
    below = OfChild(below, child);
    float square = below.detail * below.detail;
    for (size_t q = 0; q < below.end.node_count; ++q) {
      const float beyond = below.radiosity[q] - nodes[q];
      square += below.end.nodes.weight[q] * beyond * beyond;
    }
    const float seen =
        std::min(form_factor, FormFactorBound(receiver, below.end));
    worth = std::max(worth, seen * std::sqrt(square));
  }
  return worth;
}

}  // namespace enfilade
