// Where a surface is covered: below a lamp hung close to the ceiling, where a
// chair leg stands, behind a shelf. All light is cut off there, whatever its
// source; so the edge of the cover is an error that every link to the element
// shares. No single link can see that it matters, hence it is looked for
// before links are made: elements that are partly covered are split first.

#pragma once

#include "solver/element_tree.h"
#include "solver/geometry.h"
#include "visibility/occlusion.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

struct CoverOptions {
  double tau = 1;  // W/m: largest weighted error that may stay at an edge
  uint64_t seed = 0;
  float least_diameter = 0.005F;  // m
};

// The elements of a cell that must be split because they are partly covered.
class CoverMap {
 public:
  // `reflected`: rho H of every patch, mean, W/m2. `occluders`: of the cell.
  CoverMap(const CoverOptions& options,
           CellId cell,
           std::span<const PatchGeometry> patches,
           std::span<const float> reflected,
           std::span<const CellBlockers* const> occluders);

  [[nodiscard]] bool MustSplit(uint32_t patch, ElementPath path) const {
    return std::binary_search(split_[patch].begin(), split_[patch].end(), path);
  }

  // How many elements of a patch must be split.
  [[nodiscard]] size_t SplitCount(size_t patch) const {
    return split_[patch].size();
  }

  [[nodiscard]] uint64_t SizeBytes() const;

  [[nodiscard]] uint64_t Rays() const { return rays_; }

 private:
  std::vector<std::vector<ElementPath>> split_;  // per patch, ascending
  uint64_t rays_ = 0;
};

}  // namespace enfilade
