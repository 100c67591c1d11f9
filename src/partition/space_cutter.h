// Cuts space along its walls into convex regions, and joins these into cells.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "partition/bsp_builder.h"
#include "partition/cell_merge.h"
#include "partition/face_survey.h"
#include "partition/open_borders.h"
#include "partition/partition.h"

#include <vector>

namespace enfilade {

class SpaceCutter {
 public:
  SpaceCutter(const SceneInfo& info,
              const PartitionOptions& options,
              MemoryBudget& budget,
              BlockStorage& store)
      : info_(&info), options_(&options), budget_(&budget), store_(&store) {}

  // Splits space into convex regions. Throws DoesNotFitError.
  void CutRegions();

  // Joins the regions: adds cells and portals to the partition, and stores the
  // tree and the openings between regions. Throws DoesNotFitError.
  void JoinRegions(GrowingCharge& portals_charge, Partition* partition);

  [[nodiscard]] const BspTree& Tree() const { return built_.tree; }

  [[nodiscard]] const std::vector<CellId>& CellOfLeaf() const {
    return cell_of_leaf_;
  }

 private:
  void ReachProgress(double fraction) const;

  [[nodiscard]] LeafCells Join(const FaceSurvey& survey,
                               const LeafBorders& borders) const;
  void MakeCells(const FaceSurvey& survey,
                 ScratchShelf& shelf,
                 GrowingCharge& portals_charge,
                 Partition* partition);
  void MakePortals(const OpenBorders& borders,
                   GrowingCharge& portals_charge,
                   Partition* partition) const;
  void SaveOpenings(const OpenBorders& borders) const;

  // Frees the part of the tree that only finding the borders needs.
  void DropOutlines();
  void DropLeaves();

  const SceneInfo* info_;
  const PartitionOptions* options_;
  MemoryBudget* budget_;
  BlockStorage* store_;
  bool all_split_ = false;
  BuiltTree built_;
  std::vector<CellId> cell_of_leaf_;
};

}  // namespace enfilade
