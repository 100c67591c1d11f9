// The data of a cell that kernels, shafts and the oracle need, made from the
// cell's stored patches.

#pragma once

#include "base/ids.h"
#include "base/vec.h"
#include "partition/partition.h"
#include "partition/patch.h"
#include "scene/scene_store.h"
#include "solver/elements/geometry.h"
#include "solver/elements/push_pull.h"
#include "solver/transfer/cluster_tree.h"
#include "solver/transfer/shaft.h"
#include "solver/transfer/source_group.h"
#include "visibility/cell_part.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace enfilade {

// A cell's patches as the kernels need them.
struct CellGeometry {
  std::vector<PatchGeometry> patches;
  std::unique_ptr<ShaftBlockers> portals;  // the cell's portals, as blockers
  std::unique_ptr<ClusterTree> clusters;   // of its patches
  SourceGroups groups;                     // of patches that emit

  [[nodiscard]] uint64_t SizeBytes() const;

  // About the bytes of a cell with so many patches and portal triangles.
  static uint64_t BytesFor(size_t patches, size_t portal_triangles);
};

// Builds the surface table of a scene.
SurfaceTable MakeSurfaceTable(const SceneInfo& scene);

// Makes the geometry of cells, in coordinates relative to `origin`. The scene
// and the partition must outlive the CellMaker.
class CellMaker {
 public:
  CellMaker(const SceneInfo& scene, const Partition& partition, Point3 origin);

  // The bytes in use while a cell's geometry is made, with its decoded patches.
  [[nodiscard]] uint64_t GeometryWorkBytes(CellId cell) const;

  [[nodiscard]] CellGeometry MakeGeometry(CellId cell,
                                          const CellPatches& stored,
                                          bool with_groups) const;

  // The blockers in a cell, for shafts. Besides the result, the call needs
  // memory for one PatchGeometry per blocker.
  [[nodiscard]] ShaftBlockers MakeShaftBlockers(
      const CellPatches& stored) const;

  // A box that holds all patches of a cell.
  [[nodiscard]] Box BoundsOf(CellId cell) const;

  // The box of a part of a cell; unbounded where the part is.
  [[nodiscard]] Box BoxOf(CellId cell, const CellPart& part) const;

 private:
  [[nodiscard]] size_t PortalTriangles(CellId cell) const;
  [[nodiscard]] ShaftBlockers MakePortals(CellId cell) const;
  [[nodiscard]] PatchGeometry GeometryOf(const Patch& patch) const;

  const SceneInfo* scene_;
  const Partition* partition_;
  Point3 origin_;
  std::vector<std::vector<PortalId>> portals_of_;  // per cell
};

}  // namespace enfilade
