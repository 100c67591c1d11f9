#include "solver/solution/display_cell.h"

#include "base/error.h"

namespace enfilade {
DisplayCell::DisplayCell(const CellTree& tree,
                         const CoefficientArray& gathered,
                         std::span<const Patch> patches,
                         MemoryBudget& budget)
    : tree_(&tree),
      gathered_(&gathered),
      budget_(&budget),
      charge_(budget,
              patches.size() * CoplanarPatches::kPatchBytes,
              "the groups of a cell's coplanar patches"),
      cell_(patches),
      group_of_(patches.size()),
      kept_(cell_.groups.size()) {
  for (size_t g = 0; g < cell_.groups.size(); ++g) {
    for (const PatchId patch : cell_.groups[g]) {
      group_of_[patch.Index()] = static_cast<uint32_t>(g);
    }
  }
}

std::unique_ptr<DisplayMesh> DisplayCell::Make(
    size_t group, const DisplayOptions& options) const {
  return std::make_unique<DisplayMesh>(
      *tree_, *gathered_, cell_, group, options, *budget_);
}

const DisplayMesh& DisplayCell::Keep(size_t group) {
  if (!kept_[group]) {
    try {
      kept_[group] = Make(group, {});
    } catch (const DoesNotFitError&) {
      for (auto& mesh : kept_) {
        mesh.reset();
      }
      kept_[group] = Make(group, {});
    }
  }
  return *kept_[group];
}

Rgb DisplayCell::IrradianceAt(PatchId patch, UnitPoint p) {
  return Keep(group_of_[patch.Index()]).IrradianceAt(patch, p);
}

}  // namespace enfilade
