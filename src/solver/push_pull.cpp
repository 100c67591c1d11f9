#include "solver/push_pull.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// irradiance[child] += restriction of irradiance[parent], from the roots down.
void PushDown(const CellTree& tree,
              std::span<const PatchGeometry> patches,
              CoefficientArray* irradiance) {
  const TreeShape& shape = tree.Shape();
  std::vector<float> pushed(shape.Stride());
  for (size_t i = 0; i < tree.Size(); ++i) {
    const Element& e = tree.At(ElementId(i));
    if (e.first_child == 0) {
      continue;
    }
    const ShapeBasis& basis = shape.basis->On(patches[e.patch].shape);
    for (size_t c = 0; c < kChildren; ++c) {
      PushTo(basis, shape, c, (*irradiance)[ElementId(i)], pushed);
      const auto child = (*irradiance)[ElementId(e.first_child + c)];
      for (size_t k = 0; k < child.size(); ++k) {
        child[k] += pushed[k];
      }
    }
  }
}

void ReflectAtLeaf(const TreeShape& shape,
                   const PatchGeometry& patch,
                   const SurfaceTable& surfaces,
                   const float* kept,
                   std::span<float> values) {
  const size_t nodes = shape.basis->On(patch.shape).NodeCount();
  for (size_t c = 0; c < shape.channels; ++c) {
    const size_t at = patch.material.Index() * surfaces.channels + c;
    const float rho = patch.reflects ? surfaces.reflectance[at] : 0.0F;
    const float emitted = patch.emits ? surfaces.exitance[at] : 0.0F;
    float* b = &values[c * shape.NodeStride()];
    for (size_t q = 0; q < nodes; ++q) {
      b[q] = emitted + rho * (kept == nullptr ? 1.0F : kept[q]) * b[q];
    }
  }
}

// Leaves become radiosity, inner elements the projection of their children.
void ReflectAndPullUp(const CellTree& tree,
                      std::span<const PatchGeometry> patches,
                      const SurfaceTable& surfaces,
                      const CoefficientArray& kept,
                      CoefficientArray* values) {
  const TreeShape& shape = tree.Shape();
  for (size_t i = tree.Size(); i-- > 0;) {
    const Element& e = tree.At(ElementId(i));
    const auto own = (*values)[ElementId(i)];
    if (e.first_child == 0) {
      ReflectAtLeaf(shape,
                    patches[e.patch],
                    surfaces,
                    kept.Size() == 0 ? nullptr : kept.At(i),
                    own);
      continue;
    }
    std::fill(own.begin(), own.end(), 0.0F);
    const ShapeBasis& basis = shape.basis->On(patches[e.patch].shape);
    for (size_t c = 0; c < kChildren; ++c) {
      PullFrom(basis, shape, c, (*values)[ElementId(e.first_child + c)], own);
    }
  }
}

CoefficientArray KeepAll(const CellTree& tree) {
  return CoefficientArray(tree.Shape().NodeStride());
}

}  // namespace

CoefficientArray PushPull(const CellTree& tree,
                          const CoefficientArray& gathered,
                          std::span<const PatchGeometry> patches,
                          const SurfaceTable& surfaces,
                          const CoefficientArray& kept) {
  CoefficientArray values = gathered;
  PushDown(tree, patches, &values);
  ReflectAndPullUp(tree, patches, surfaces, kept, &values);
  return values;
}

CoefficientArray PushPull(const CellTree& tree,
                          const CoefficientArray& gathered,
                          std::span<const PatchGeometry> patches,
                          const SurfaceTable& surfaces) {
  return PushPull(tree, gathered, patches, surfaces, KeepAll(tree));
}

CoefficientArray EmittedRadiosity(const CellTree& tree,
                                  std::span<const PatchGeometry> patches,
                                  const SurfaceTable& surfaces) {
  CoefficientArray values(tree.Shape().Stride());
  values.GrowTo(tree.Size());
  ReflectAndPullUp(tree, patches, surfaces, KeepAll(tree), &values);
  return values;
}

LeafSums SumOverLeaves(const CellTree& tree,
                       std::span<const PatchGeometry> patches,
                       const CoefficientArray& values) {
  const TreeShape& shape = tree.Shape();
  LeafSums sums;
  for (size_t i = 0; i < tree.Size(); ++i) {
    const Element& e = tree.At(ElementId(i));
    if (e.first_child != 0) {
      continue;
    }
    const PatchGeometry& patch = patches[e.patch];
    const ShapeBasis& basis = shape.basis->On(patch.shape);
    const auto own = values[ElementId(i)];
    const double area = static_cast<double>(AreaOf(patch, e.frame)) /
                        static_cast<double>(shape.channels);
    for (size_t c = 0; c < shape.channels; ++c) {
      for (size_t q = 0; q < basis.NodeCount(); ++q) {
        const double v = static_cast<double>(own[c * shape.NodeStride() + q]);
        const double w = area * basis.Weight(q);
        sums.value += w * v;
        sums.absolute += w * std::abs(v);
        sums.squared += w * v * v;
      }
    }
  }
  return sums;
}

float MeanReflected(const PatchGeometry& patch,
                    std::span<const float> radiosity,
                    const TreeShape& shape,
                    const SurfaceTable& surfaces) {
  const ShapeBasis& basis = shape.basis->On(patch.shape);
  double largest = 0;
  for (size_t c = 0; c < shape.channels; ++c) {
    const size_t at = patch.material.Index() * surfaces.channels + c;
    double mean =
        patch.emits ? -static_cast<double>(surfaces.exitance[at]) : 0.0;
    for (size_t q = 0; q < basis.NodeCount(); ++q) {
      mean += basis.Weight(q) *
              static_cast<double>(radiosity[c * shape.NodeStride() + q]);
    }
    largest = std::max(largest, mean);
  }
  return static_cast<float>(largest);
}

double EmittedFlux(std::span<const PatchGeometry> patches,
                   const SurfaceTable& surfaces) {
  double flux = 0;
  for (const PatchGeometry& patch : patches) {
    for (size_t c = 0; patch.emits && c < surfaces.channels; ++c) {
      const size_t at = patch.material.Index() * surfaces.channels + c;
      flux += static_cast<double>(patch.area) *
              static_cast<double>(surfaces.exitance[at]) /
              static_cast<double>(surfaces.channels);
    }
  }
  return flux;
}

}  // namespace enfilade
