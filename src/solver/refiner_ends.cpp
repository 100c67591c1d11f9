// The part of refinement that knows its two ends: what a receiver weighs, and
// what a source sends.

#include "solver/oracle.h"
#include "solver/refiner_task.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// By how much detail may be concentrated for it to be looked for.
constexpr float kMostConcentration = 16;

float CareOf(std::span<const PatchCare> care, uint32_t patch) {
  return care.empty() ? 1.0F : care[patch].care;
}

// How much errors weigh on an element of a patch.
float WeightOf(const PatchGeometry& patch, ElementFrame frame, float care) {
  return care * std::max(patch.max_reflectance, kLeastWeightReflectance) *
         std::sqrt(AreaOf(patch, frame));
}

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

// The largest radiosity of a source, by that at its nodes and by its detail.
float Peak(const std::array<float, kTransferNodes>& radiosity, float detail) {
  return *std::max_element(radiosity.begin(), radiosity.end()) + detail;
}

}  // namespace

std::vector<float> ReceiverWeights(std::span<const PatchGeometry> patches,
                                   const ClusterTree& clusters,
                                   std::span<const PatchCare> care) {
  std::vector<float> weights;
  weights.reserve(clusters.Items().size());
  for (const ClusterItem& item : clusters.Items()) {
    const PatchGeometry& patch = patches[item.patch];
    weights.push_back(WeightOf(
        patch, FrameOfPath(patch.shape, item.path), CareOf(care, item.patch)));
  }
  return clusters.LargestOf(weights);
}

// At the transfer nodes of an element, of the brightest channel, W/m2.
std::array<float, kTransferNodes> Refiner::NodeRadiosity(
    ElementId element, PatchShape patch) const {
  const TreeShape& shape = source_.tree->Shape();
  const auto sent = source_.tree->Sent()[element];
  const size_t nodes = SecondOrderBasis().On(patch).NodeCount();
  std::array<float, kTransferNodes> radiosity{};
  for (size_t c = 0; c < shape.channels; ++c) {
    const auto of_channel = sent.subspan(c * shape.NodeStride());
    for (size_t q = 0; q < nodes; ++q) {
      const float value = basis_->HasOwnNodes()
                              ? SampleAt(q, patch, of_channel)
                              : of_channel[constant_basis_ ? 0 : q];
      radiosity[q] = std::max(radiosity[q], std::abs(value));
    }
  }
  return radiosity;
}

// Of a basis that has nodes of its own, at a transfer node.
float Refiner::SampleAt(size_t node,
                        PatchShape patch,
                        std::span<const float> coefficients) const {
  const auto& rows = basis_->SamplesOn(patch).to_samples;
  float value = 0;
  for (size_t g = 0; g < basis_->On(patch).NodeCount(); ++g) {
    value += rows[g][node] * coefficients[g];
  }
  return value;
}

void Refiner::SetRadiosity(Source* source) const {
  source->radiosity = NodeRadiosity(source->element, source->end.patch->shape);
  source->detail = source_.tree->Detail(source->element);
}

float Refiner::PeakOf(const Source& s) {
  return Peak(s.radiosity, s.detail);
}

// The same of a whole patch, before anything else of it is needed.
float Refiner::PeakOf(const ClusterItem& item) const {
  const ElementId element(item.patch);
  return Peak(NodeRadiosity(element, source_.patches[item.patch].shape),
              source_.tree->Detail(element));
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
  // Children that are there say nothing beyond their parent; whether they are
  // must not matter: links may have been made to them meanwhile.
  s.radiosity = Pushed(parent.radiosity, patch.shape, child);
  for (float& b : s.radiosity) {
    b = std::abs(b);
  }
  return s;
}

// Radiosity at the transfer nodes, of a child by that of its parent.
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
  r.weight = WeightOf(patch, r.end.frame, r.care);
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

// How wrong the source's nodes are where it lies closest to the receiver, W/m2
// of irradiance. The oracle takes detail as spread over all of the source, and
// so is the kernel if the receiver is far. A bulb before a wall lights a spot
// of it and the shade beside the spot: then both are concentrated, and where,
// the elements say that lie below the source.
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
