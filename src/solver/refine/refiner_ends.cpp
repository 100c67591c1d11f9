// The part of refinement that makes the two ends of a transfer: the elements at
// which refinement begins, and the elements below them.

#include "solver/refine/refiner_task.h"
#include "solver/refine/source_weights.h"
#include "solver/transfer/fit_residual.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// NearDetail looks for concentrated detail only if this multiple of the
// source's detail could reach tau.
constexpr float kMostConcentration = 16;

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

void Refiner::SetRadiosity(Source* source) const {
  source->radiosity =
      NodeRadiosity(*source_.tree, source->element, source->end.patch->shape);
  source->detail = source_.tree->Detail(source->element);
}

Refiner::Source Refiner::RootSource(const ClusterItem& item) const {
  Source s;
  s.end = MakeTransferEnd(source_.patches[item.patch], {});
  s.patch = item.patch;
  s.element = ElementId(item.patch);
  SetRadiosity(&s);
  return s;
}

Refiner::Source Refiner::ChildSource(const Source& parent, size_t child) const {
  Source s;
  const PatchGeometry& patch = *parent.end.patch;
  s.end = MakeTransferEnd(patch, ChildOf(parent.end.frame, patch.shape, child));
  s.patch = parent.patch;
  s.path = ChildPath(parent.path, child);
  s.element = parent.element;
  if (parent.detail > 0) {
    const Element& element = source_.tree->At(parent.element);
    s.element = ElementId(element.first_child + child);
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
std::array<float, kTransferNodes> Refiner::Pushed(
    const std::array<float, kTransferNodes>& parent,
    PatchShape shape,
    size_t child) const {
  if (constant_basis_) {
    return parent;
  }
  const ShapeBasis& basis = SecondOrderBasis().On(shape);
  std::array<float, kTransferNodes> pushed{};
  for (size_t q = 0; q < basis.NodeCount(); ++q) {
    double sum = 0;
    for (size_t g = 0; g < basis.NodeCount(); ++g) {
      sum += basis.Push(child, q, g) * static_cast<double>(parent[g]);
    }
    pushed[q] = static_cast<float>(sum);
  }
  return pushed;
}

Refiner::Receiver Refiner::RootReceiver(const ClusterItem& item) const {
  const PatchGeometry& patch = receiver_.patches[item.patch];
  Receiver r;
  r.end = MakeTransferEnd(patch, FrameOfPath(patch.shape, item.path));
  r.patch = item.patch;
  r.path = item.path;
  r.care = CareOf(receiver_.care, item.patch);
  r.weight = WeightOf(patch, r.end.frame, r.care, receiver_.least_reflectance);
  return r;
}

Refiner::Receiver Refiner::ChildReceiver(const Receiver& parent,
                                         size_t child) const {
  Receiver r;
  const PatchGeometry& patch = *parent.end.patch;
  r.end = MakeTransferEnd(patch, ChildOf(parent.end.frame, patch.shape, child));
  r.patch = parent.patch;
  r.path = ChildPath(parent.path, child);
  r.level = parent.level + 1;
  r.care = parent.care;
  r.weight = 0.5F * parent.weight;
  return r;
}

bool Refiner::CanSplit(const TransferEnd& end, ElementPath path) const {
  return end.diameter > options_.least_diameter && !IsDeepest(path);
}

// The error of the source's nodes where the source lies closest to the
// receiver, W/m2 of irradiance. The oracle takes the source's detail as spread
// over all of the source; the kernel is likewise spread if the receiver is far.
// But if a bulb before a wall lights a spot of the wall and the shade beside
// the spot, detail and kernel are both concentrated. The elements below the
// source say where.
float Refiner::NearDetail(const Receiver& r,
                          const Source& s,
                          const Judgement& judgement) const {
  if (!judgement.near ||
      r.weight * judgement.form_factor * s.detail * kMostConcentration <
          static_cast<float>(options_.tau)) {
    return 0;
  }
  float worth = 0;
  Source below = s;
  std::array<float, kTransferNodes> nodes = s.radiosity;
  while (below.detail > 0) {
    const size_t child = NearestChild(below.end, r.end.center);
    nodes = Pushed(nodes, below.end.patch->shape, child);
    below = ChildSource(below, child);
    float square = below.detail * below.detail;
    for (size_t q = 0; q < below.end.node_count; ++q) {
      const float beyond = below.radiosity[q] - nodes[q];
      square += below.end.weight[q] * beyond * beyond;
    }
    const float seen =
        std::min(judgement.form_factor, FormFactorBound(r.end, below.end));
    worth = std::max(worth, seen * std::sqrt(square));
  }
  return worth;
}

}  // namespace enfilade
