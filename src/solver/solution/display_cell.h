// The display meshes of one cell, made when they are asked for.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "solver/solution/display_mesh.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace enfilade {

class DisplayCell {
 public:
  // `gathered`: by the elements of the tree (ReceivedLight). All must outlive
  // this.
  DisplayCell(const CellTree& tree,
              const CoefficientArray& gathered,
              std::span<const Patch> patches,
              MemoryBudget& budget);

  // Groups of coplanar patches.
  [[nodiscard]] size_t GroupCount() const { return cell_.groups.size(); }

  // The first patch of a group, which stands for all of them but for its place.
  [[nodiscard]] const Patch& FirstOf(size_t group) const {
    return cell_.FirstOf(group);
  }

  // Not kept.
  [[nodiscard]] std::unique_ptr<DisplayMesh> Make(
      size_t group, const DisplayOptions& options) const;

  // Of the smooth mesh, W/m2. Keeps as many meshes as the budget holds; throws
  // DoesNotFitError if it does not hold the one. Not thread-safe.
  [[nodiscard]] Rgb IrradianceAt(PatchId patch, UnitPoint p);

 private:
  const DisplayMesh& Keep(size_t group);

  const CellTree* tree_;
  const CoefficientArray* gathered_;
  MemoryBudget* budget_;
  MemoryCharge charge_;
  CoplanarPatches cell_;
  std::vector<uint32_t> group_of_;                  // indexed by PatchId
  std::vector<std::unique_ptr<DisplayMesh>> kept_;  // indexed by group
};

}  // namespace enfilade
