// Push-pull on the trees of one cell: irradiance down to the leaves, reflection
// there, radiosity back up.

#pragma once

#include "base/photometry.h"
#include "solver/element_tree.h"
#include "solver/geometry.h"

#include <span>
#include <vector>

namespace enfilade {

// Emission and reflectance per channel of every material of the scene.
struct SurfaceTable {
  size_t channels = kRgbChannels;
  std::vector<float> reflectance;  // [material][channel]
  std::vector<float> exitance;     // likewise, W/m2
};

// The radiosity B = E + rho H of every element for the gathered irradiance
// (ReceivedLight), an array like CellTree::Sent(). At inner elements it is the
// projection of their leaves. `kept`: the shares of their irradiance that
// leaves keep (held_gain.h), which change only with the links.
CoefficientArray PushPull(const CellTree& tree,
                          const CoefficientArray& gathered,
                          std::span<const PatchGeometry> patches,
                          const SurfaceTable& surfaces,
                          const CoefficientArray& kept);

// The same where leaves keep all.
CoefficientArray PushPull(const CellTree& tree,
                          const CoefficientArray& gathered,
                          std::span<const PatchGeometry> patches,
                          const SurfaceTable& surfaces);

// The radiosity before any light has travelled: E, on all elements.
CoefficientArray EmittedRadiosity(const CellTree& tree,
                                  std::span<const PatchGeometry> patches,
                                  const SurfaceTable& surfaces);

// Integrals over the leaves of an array of coefficients v, means of the
// channels.
struct LeafSums {
  double value = 0;     // integral of v
  double absolute = 0;  // integral of |v|
  double squared = 0;   // integral of v^2
};

LeafSums SumOverLeaves(const CellTree& tree,
                       std::span<const PatchGeometry> patches,
                       const CoefficientArray& values);

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
