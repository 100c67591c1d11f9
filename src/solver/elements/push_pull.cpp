#include "solver/elements/push_pull.h"

#include "base/parallel.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

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

// Walks the trees of patches: pushes irradiance down, pulls radiosity up. Holds
// one irradiance and one radiosity per level only.
class TreeWalk {
 public:
  TreeWalk(const ReflectingCell& cell,
           size_t block,
           const RadiosityVisitor& visit)
      : cell_(cell),
        shape_(cell.tree.Shape()),
        block_(block),
        visit_(visit),
        irradiance_((kMaxLevel + 2) * shape_.Stride()),
        radiosity_(irradiance_.size()) {}

  void VisitPatch(size_t patch) {
    std::fill(irradiance_.begin(), irradiance_.end(), 0.0F);
    basis_ = &shape_.basis->On(cell_.patches[patch].shape);
    Visit(ElementId(patch), 0);
  }

 private:
  std::span<float> At(size_t level, std::vector<float>* values) const {
    const size_t stride = shape_.Stride();
    return std::span(*values).subspan(level * stride, stride);
  }

  // On entry, the irradiance of `level` is the parent's, restricted to this
  // element.
  void Visit(ElementId id, size_t level) {
    const std::span<float> irradiance = At(level, &irradiance_);
    const std::span<float> radiosity = At(level, &radiosity_);
    if (cell_.gathered != nullptr) {
      const float* own = cell_.gathered->At(id.Index());
      for (float& h : irradiance) {
        h += *own++;
      }
    }
    const Element& e = cell_.tree.At(id);
    if (e.first_child == 0) {
      std::copy(irradiance.begin(), irradiance.end(), radiosity.begin());
      const bool keeps_all = cell_.kept == nullptr || cell_.kept->Size() == 0;
      ReflectAtLeaf(shape_,
                    cell_.patches[e.patch],
                    cell_.surfaces,
                    keeps_all ? nullptr : cell_.kept->At(id.Index()),
                    radiosity);
    } else {
      std::fill(radiosity.begin(), radiosity.end(), 0.0F);
      for (size_t c = 0; c < kChildren; ++c) {
        PushTo(*basis_, shape_, c, irradiance, At(level + 1, &irradiance_));
        Visit(ElementId(e.first_child + c), level + 1);
        PullFrom(*basis_, shape_, c, At(level + 1, &radiosity_), radiosity);
      }
    }
    visit_(block_, id, radiosity);
  }

  const ReflectingCell& cell_;
  const TreeShape& shape_;
  size_t block_;
  const RadiosityVisitor& visit_;
  const ShapeBasis* basis_ = nullptr;
  std::vector<float> irradiance_;  // by level
  std::vector<float> radiosity_;
};

}  // namespace

size_t BlockCount(const ReflectingCell& cell) {
  return (cell.tree.PatchCount() + kBlockPatches - 1) / kBlockPatches;
}

void VisitRadiosity(const ReflectingCell& cell, const RadiosityVisitor& visit) {
  const size_t patches = cell.tree.PatchCount();
  ParallelFor(BlockCount(cell), [&](size_t block) {
    TreeWalk walk(cell, block, visit);
    const size_t end = std::min(patches, (block + 1) * kBlockPatches);
    for (size_t patch = block * kBlockPatches; patch < end; ++patch) {
      walk.VisitPatch(patch);
    }
  });
}

CoefficientArray PushPull(const ReflectingCell& cell) {
  CoefficientArray values(cell.tree.Shape().Stride());
  values.GrowTo(cell.tree.Size());
  VisitRadiosity(cell,
                 [&](size_t /*block*/, ElementId e, std::span<const float> b) {
                   std::copy(b.begin(), b.end(), values[e].begin());
                 });
  return values;
}

LeafSums Total(const std::vector<LeafSums>& blocks) {
  LeafSums total;
  for (const LeafSums& sums : blocks) {
    total.value += sums.value;
    total.absolute += sums.absolute;
    total.squared += sums.squared;
  }
  return total;
}

void AddLeaf(const TreeShape& shape,
             const PatchGeometry& patch,
             ElementFrame leaf,
             std::span<const float> values,
             LeafSums* sums) {
  const ShapeBasis& basis = shape.basis->On(patch.shape);
  const double area = static_cast<double>(AreaOf(patch, leaf)) /
                      static_cast<double>(shape.channels);
  for (size_t c = 0; c < shape.channels; ++c) {
    for (size_t q = 0; q < basis.NodeCount(); ++q) {
      const double v = static_cast<double>(values[c * shape.NodeStride() + q]);
      const double w = area * basis.Weight(q);
      sums->value += w * v;
      sums->absolute += w * std::abs(v);
      sums->squared += w * v * v;
    }
  }
}

LeafSums SumOverLeaves(const CellTree& tree,
                       std::span<const PatchGeometry> patches,
                       const CoefficientArray& values) {
  LeafSums sums;
  for (size_t i = 0; i < tree.Size(); ++i) {
    const Element& e = tree.At(ElementId(i));
    if (e.first_child == 0) {
      AddLeaf(
          tree.Shape(), patches[e.patch], e.frame, values[ElementId(i)], &sums);
    }
  }
  return sums;
}

double LeavingFlux(const ReflectingCell& cell) {
  std::vector<LeafSums> sums(BlockCount(cell));
  VisitRadiosity(
      cell, [&](size_t block, ElementId id, std::span<const float> radiosity) {
        const Element& e = cell.tree.At(id);
        if (e.first_child == 0) {
          AddLeaf(cell.tree.Shape(),
                  cell.patches[e.patch],
                  e.frame,
                  radiosity,
                  &sums[block]);
        }
      });
  return Total(sums).value;
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
