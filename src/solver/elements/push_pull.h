// Push-pull on the trees of one cell: irradiance down to the leaves, reflection
// there, radiosity back up.

#pragma once

#include "base/photometry.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace enfilade {

// Emission and reflectance per channel of every material of the scene.
struct SurfaceTable {
  size_t channels = kRgbChannels;
  std::vector<float> reflectance;  // [material][channel]
  std::vector<float> exitance;     // likewise, W/m2
};

// The input of the radiosity B = E + rho H of a cell's elements; all members
// are borrowed.
struct ReflectingCell {
  const CellTree& tree;
  std::span<const PatchGeometry> patches;
  const SurfaceTable& surfaces;
  // Irradiance as in ReceivedLight; null: no light has arrived yet.
  const CoefficientArray* gathered = nullptr;
  // The shares of its irradiance that each leaf keeps (held_gain.h), which
  // change only with the links; null: leaves keep all.
  const CoefficientArray* kept = nullptr;
};

// Patches per block: the trees of a block are walked one after the other, and
// blocks run in parallel.
inline constexpr size_t kBlockPatches = 64;
size_t BlockCount(const ReflectingCell& cell);

// Called with the radiosity of every element, [channel][node] like
// CellTree::Sent, children before their parent. The radiosity of an inner
// element is the projection of its leaves' radiosity. Calls for different
// blocks run in parallel; calls for one block always come in the same order.
using RadiosityVisitor = std::function<void(
    size_t block, ElementId e, std::span<const float> radiosity)>;

// Calls `visit` for every element of the cell. Memory use does not grow with
// the cell.
void VisitRadiosity(const ReflectingCell& cell, const RadiosityVisitor& visit);

// The radiosity of all elements as an array.
CoefficientArray PushPull(const ReflectingCell& cell);

// Integrals over leaves of a function v given by coefficients, as means over
// the channels.
struct LeafSums {
  double value = 0;     // integral of v
  double absolute = 0;  // integral of |v|
  double squared = 0;   // integral of v^2
};

// Adds up the sums of blocks in the order of the blocks.
LeafSums Total(const std::vector<LeafSums>& blocks);

// Adds the integrals over one leaf of a patch; `values` are the leaf's
// coefficients.
void AddLeaf(const TreeShape& shape,
             const PatchGeometry& patch,
             ElementFrame leaf,
             std::span<const float> values,
             LeafSums* sums);

LeafSums SumOverLeaves(const CellTree& tree,
                       std::span<const PatchGeometry> patches,
                       const CoefficientArray& values);

// The flux E + rho H that leaves a cell's surfaces, mean over the channels, W.
double LeavingFlux(const ReflectingCell& cell);

// The mean of rho H over the root element of a patch, in the largest channel,
// W/m2: `radiosity` (the element's coefficients) minus emission.
float MeanReflected(const PatchGeometry& patch,
                    std::span<const float> radiosity,
                    const TreeShape& shape,
                    const SurfaceTable& surfaces);

// The emitted flux of a cell, mean over the channels, W.
double EmittedFlux(std::span<const PatchGeometry> patches,
                   const SurfaceTable& surfaces);

}  // namespace enfilade
