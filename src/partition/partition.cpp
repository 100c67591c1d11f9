#include "partition/partition.h"

#include "partition/partition_store.h"
#include "partition/patch_writer.h"
#include "partition/space_cutter.h"

#include <string>

#include <fmt/format.h>

namespace enfilade {
namespace {

void NoteTouches(const TouchCounts& counts, std::vector<std::string>& notes) {
  const OverlapCounts& overlaps = counts.overlaps;
  if (overlaps.dropped > 0) {
    notes.push_back(fmt::format(
        "{} patches were there twice, whole or in part: {:.3g} m2 were dropped",
        overlaps.dropped,
        overlaps.area_m2));
  }
  if (overlaps.moved > 0) {
    notes.push_back(fmt::format(
        "{} patches lay in larger ones and were put {} mm before them",
        overlaps.moved,
        1e3 * kApartM));
  }
  if (counts.contacts.cut > 0 || counts.contacts.covered_m2 > 0) {
    notes.push_back(fmt::format(
        "{} patches were cut where others stand or lie on them; {:.3g} m2 are "
        "covered",
        counts.contacts.cut,
        counts.contacts.covered_m2));
  }
}

}  // namespace

Partition BuildPartition(BlockStorage& store,
                         const PartitionOptions& options,
                         MemoryBudget& budget) {
  const SceneInfo info = LoadSceneInfo(store);
  const MemoryCharge scene_charge(budget, BytesOf(info), kScenePurpose);
  Partition partition;
  GrowingCharge portals_charge(budget, "the doorways of the building");
  SpaceCutter cutter(info, options, budget, store);
  cutter.CutRegions();
  cutter.JoinRegions(portals_charge, &partition);
  const TouchCounts touches = WritePatches(
      info, cutter.Tree(), cutter.CellOfLeaf(), budget, store, partition.cells);
  partition.overlap_m2 = touches.overlaps.area_m2;
  NoteTouches(touches, partition.notes);
  partition.notes.push_back(
      fmt::format("split into {} convex regions, joined into {} cells with {} "
                  "portals",
                  cutter.Tree().leaf_count,
                  partition.cells.size(),
                  partition.portals.size()));
  SavePartition(partition, store);
  if (options.progress) {
    options.progress(1);
  }
  return partition;
}

}  // namespace enfilade
