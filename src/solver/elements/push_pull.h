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

// What the radiosity B = E + rho H of a cell's elements follows from; all is
// borrowed.
struct ReflectingCell {
  const CellTree& tree;
  std::span<const PatchGeometry> patches;
  const SurfaceTable& surfaces;
  // Irradiance, as ReceivedLight; none: no light has come yet.
  const CoefficientArray* gathered = nullptr;
  // The shares of their irradiance that leaves keep (held_gain.h), which change
  // only with the links; none: all.
  const CoefficientArray* kept = nullptr;
};

// Patches whose trees are worked on one after the other; blocks of them, side
// by side.
inline constexpr size_t kBlockPatches = 64;
size_t BlockCount(const ReflectingCell& cell);

// Called with the radiosity of an element, [channel][node] like CellTree::Sent:
// of all elements, children before their parent. At inner elements it is the
// projection of their leaves. Calls of different blocks run in parallel, those
// of one block in the same order always.
using RadiosityVisitor = std::function<void(
    size_t block, ElementId e, std::span<const float> radiosity)>;

// Takes no memory that grows with the cell.
void VisitRadiosity(const ReflectingCell& cell, const RadiosityVisitor& visit);

// The same as an array.
CoefficientArray PushPull(const ReflectingCell& cell);

// Integrals over the leaves of an array of coefficients v, means of the
// channels.
struct LeafSums {
  double value = 0;     // integral of v
  double absolute = 0;  // integral of |v|
  double squared = 0;   // integral of v^2
};

// The sums of blocks in their order.
LeafSums Total(const std::vector<LeafSums>& blocks);

// Adds those over one leaf of a patch, of its coefficients.
void AddLeaf(const TreeShape& shape,
             const PatchGeometry& patch,
             ElementFrame leaf,
             std::span<const float> values,
             LeafSums* sums);

LeafSums SumOverLeaves(const CellTree& tree,
                       std::span<const PatchGeometry> patches,
                       const CoefficientArray& values);

// The flux E + rho H that leaves a cell's surfaces, mean of the channels, W.
double LeavingFlux(const ReflectingCell& cell);

// rho H of a patch: the mean over its root element of what `radiosity` (its
// coefficients) has beyond emission, largest channel, W/m2.
float MeanReflected(const PatchGeometry& patch,
                    std::span<const float> radiosity,
                    const TreeShape& shape,
                    const SurfaceTable& surfaces);

// Emitted flux of a cell, mean of the channels, W.
double EmittedFlux(std::span<const PatchGeometry> patches,
                   const SurfaceTable& surfaces);

}  // namespace enfilade
