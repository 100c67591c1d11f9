#include "solver/solution/solved_cell.h"

#include "solver/elements/basis.h"
#include "solver/elements/push_pull.h"

#include <algorithm>

namespace enfilade {
namespace {

// The point of the patch at these coordinates of an element.
UnitPoint OnPatch(ElementFrame frame, UnitPoint p) {
  return {
      static_cast<double>(frame.a) + static_cast<double>(frame.scale) * p.a,
      static_cast<double>(frame.b) + static_cast<double>(frame.scale) * p.b};
}

// A point a hair inside the element, so that its own values are read and not
// its neighbour's.
UnitPoint JustInside(PatchShape shape, UnitPoint corner) {
  constexpr double kHair = 1e-6;
  const double middle = CentroidCoordinate(shape);
  return {corner.a + (middle - corner.a) * kHair,
          corner.b + (middle - corner.b) * kHair};
}

}  // namespace

Rgb SolvedCell::Evaluate(PatchId patch, UnitPoint p) const {
  const Basis& basis = *loaded_->tree->Shape().basis;
  const PatchShape shape = loaded_->geometry.at(patch.Index()).shape;
  const ShapeBasis& on = basis.On(shape);
  const size_t nodes = basis.parallelogram.NodeCount();
  Rgb sum{};
  ElementId e(patch.value);
  while (true) {
    const auto values = on.Evaluate(p);
    const auto gathered = loaded_->gathered[e];
    for (size_t c = 0; c < sum.size(); ++c) {
      for (size_t q = 0; q < on.NodeCount(); ++q) {
        sum[c] += values[q] * static_cast<double>(gathered[c * nodes + q]);
      }
    }
    const uint32_t first = loaded_->tree->At(e).first_child;
    if (first == 0) {
      return sum;
    }
    e = ElementId(first + ChildAt(shape, &p));
  }
}

Rgb SolvedCell::RadiosityWith(PatchId patch, const Rgb& irradiance) const {
  const PatchGeometry& geometry = loaded_->geometry.at(patch.Index());
  return RadiosityOf(
      geometry, scene_->materials.at(geometry.material.Index()), irradiance);
}

Rgb SolvedCell::IrradianceAt(const PatchPoint& point) const {
  return NotBelowZero(Evaluate(point.patch, {point.a, point.b}));
}

LightAtPoint SolvedCell::LightAt(const PatchPoint& point) const {
  const PatchGeometry& patch = loaded_->geometry.at(point.patch.Index());
  LightAtPoint light;
  light.radiosity = RadiosityWith(point.patch, IrradianceAt(point));
  if (patch.reflects) {
    light.reflecting = patch.material;
  }
  return light;
}

LeafElement SolvedCell::LeafOf(const Element& element) const {
  const Patch& patch = loaded_->stored.patches[element.patch];
  LeafElement leaf;
  leaf.patch = PatchId(element.patch);
  for (size_t k = 0; k < CornerCount(patch.shape); ++k) {
    const UnitPoint corner = UnitCorner(patch.shape, k);
    const UnitPoint at = OnPatch(element.frame, corner);
    leaf.corners.push_back(PointOn(patch, at.a, at.b));
    leaf.irradiance.push_back(Evaluate(
        leaf.patch, OnPatch(element.frame, JustInside(patch.shape, corner))));
    leaf.radiosity.push_back(RadiosityWith(leaf.patch, leaf.irradiance.back()));
  }
  return leaf;
}

void SolvedCell::ForEachLeaf(
    const std::function<void(const LeafElement&)>& visit) const {
  for (size_t i = 0; i < loaded_->tree->Size(); ++i) {
    const Element& element = loaded_->tree->At(ElementId(i));
    if (element.first_child == 0) {
      visit(LeafOf(element));
    }
  }
}

void SolvedCell::ForEachMean(
    std::span<const PatchId> patches,
    const std::function<void(const LeafMean&)>& visit) const {
  for (const PatchId patch : patches) {
    VisitMeans(ElementId(patch.value), {}, visit);
  }
}

// `above` is the irradiance that the element's ancestors bring to its nodes.
void SolvedCell::VisitMeans(
    ElementId element,
    const NodeIrradiance& above,
    const std::function<void(const LeafMean&)>& visit) const {
  const Element& e = loaded_->tree->At(element);
  const PatchGeometry& patch = loaded_->geometry[e.patch];
  const TreeShape shape = loaded_->tree->Shape();
  const ShapeBasis& on = shape.basis->On(patch.shape);
  NodeIrradiance all = above;
  const auto own = loaded_->gathered[element];
  for (size_t k = 0; k < own.size(); ++k) {
    all[k] += own[k];
  }
  if (e.first_child != 0) {
    for (size_t c = 0; c < kChildren; ++c) {
      NodeIrradiance pushed{};
      PushTo(on,
             shape,
             c,
             std::span(all).first(own.size()),
             std::span(pushed).first(own.size()));
      VisitMeans(ElementId(e.first_child + c), pushed, visit);
    }
    return;
  }
  LeafMean leaf = {PatchId(e.patch),
                   e.frame,
                   static_cast<double>(AreaOf(patch, e.frame)),
                   {}};
  for (size_t c = 0; c < kRgbChannels; ++c) {
    for (size_t q = 0; q < on.NodeCount(); ++q) {
      leaf.irradiance[c] +=
          on.Weight(q) * static_cast<double>(all[c * shape.NodeStride() + q]);
    }
  }
  visit(leaf);
}

}  // namespace enfilade
