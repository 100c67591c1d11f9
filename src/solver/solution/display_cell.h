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
  // `gathered` is indexed by the elements of `tree` (ReceivedLight). All
  // arguments must outlive this.
  DisplayCell(const CellTree& tree,
              const CoefficientArray& gathered,
              std::span<const Patch> patches,
              MemoryBudget& budget);

  // Groups of coplanar patches.
  [[nodiscard]] size_t GroupCount() const { return cell_.groups.size(); }

  // The first patch of a group. All patches of the group are alike but for
  // their place in the plane.
  [[nodiscard]] const Patch& FirstOf(size_t group) const {
    return cell_.FirstOf(group);
  }

  // Makes a mesh and does not keep it.
  [[nodiscard]] std::unique_ptr<DisplayMesh> Make(
      size_t group, const DisplayOptions& options) const;

  // Irradiance of the smooth mesh, W/m2. Keeps as many meshes as the budget
  // holds; throws DoesNotFitError if the budget does not hold the mesh of this
  // patch alone. Not thread-safe.
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
