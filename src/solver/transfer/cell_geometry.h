// What kernels, shafts and the oracle need of a cell, made of its stored
// patches.

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

// A cell's patches for kernels.
struct CellGeometry {
  std::vector<PatchGeometry> patches;
  std::unique_ptr<ShaftBlockers> portals;  // its openings, as if they blocked
  std::unique_ptr<ClusterTree> clusters;   // of its patches
  SourceGroups groups;                     // of those that emit

  [[nodiscard]] uint64_t SizeBytes() const;

  // About what a cell of these numbers will take.
  static uint64_t BytesFor(size_t patches, size_t portal_triangles);
};

// Builds the surface table of a scene.
SurfaceTable MakeSurfaceTable(const SceneInfo& scene);

// The scene and the partition must outlive it. Geometry is in coordinates about
// `origin`.
class CellMaker {
 public:
  CellMaker(const SceneInfo& scene, const Partition& partition, Point3 origin);

  // What a cell's geometry takes while it is made, its decoded patches too.
  [[nodiscard]] uint64_t GeometryWorkBytes(CellId cell) const;

  [[nodiscard]] CellGeometry MakeGeometry(CellId cell,
                                          const CellPatches& stored,
                                          bool with_groups) const;

  // What stands in a cell, for shafts. Takes a PatchGeometry for each blocker
  // besides.
  [[nodiscard]] ShaftBlockers MakeObstacles(const CellPatches& stored) const;

  // A box that holds all patches of a cell.
  [[nodiscard]] Box BoundsOf(CellId cell) const;

  // The box of a part of a cell; without end where that has none.
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
