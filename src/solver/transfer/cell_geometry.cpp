#include "solver/transfer/cell_geometry.h"

#include "visibility/occlusion.h"

#include <numeric>

namespace enfilade {
namespace {

// Patches may stick out of their cell by this much (overlap.h), m.
constexpr double kBoundsMargin = 5e-3;

}  // namespace

uint64_t CellGeometry::SizeBytes() const {
  return patches.size() * sizeof(PatchGeometry) + portals->SizeBytes() +
         clusters->SizeBytes() + groups.SizeBytes();
}

uint64_t CellGeometry::BytesFor(size_t patches, size_t portal_triangles) {
  return patches * sizeof(PatchGeometry) +
         ShaftBlockers::BytesFor(portal_triangles) +
         ClusterTree::HeldBytesFor(patches) + SourceGroups::BytesFor(patches);
}

SurfaceTable MakeSurfaceTable(const SceneInfo& scene) {
  SurfaceTable table;
  for (const Material& m : scene.materials) {
    for (size_t c = 0; c < kRgbChannels; ++c) {
      table.reflectance.push_back(static_cast<float>(m.reflectance[c]));
      table.exitance.push_back(static_cast<float>(m.exitance[c]));
    }
  }
  return table;
}

CellMaker::CellMaker(const SceneInfo& scene,
                     const Partition& partition,
                     Point3 origin)
    : scene_(&scene),
      partition_(&partition),
      origin_(origin),
      portals_of_(partition.cells.size()) {
  for (size_t i = 0; i < partition.portals.size(); ++i) {
    portals_of_[partition.portals[i].front.Index()].emplace_back(i);
    portals_of_[partition.portals[i].back.Index()].emplace_back(i);
  }
}

size_t CellMaker::PortalTriangles(CellId cell) const {
  const auto& ids = portals_of_[cell.Index()];
  return std::accumulate(
      ids.begin(), ids.end(), size_t{0}, [this](size_t sum, PortalId id) {
        return sum + partition_->portals[id.Index()].vertices.size() - 2;
      });
}

uint64_t CellMaker::GeometryWorkBytes(CellId cell) const {
  const size_t patches = partition_->cells[cell.Index()].patches;
  const size_t portal_triangles = PortalTriangles(cell);
  return patches * 2 * sizeof(Patch) +
         portal_triangles * sizeof(PatchGeometry) +
         CellGeometry::BytesFor(patches, portal_triangles) +
         ClusterTree::BytesFor(patches);
}

PatchGeometry CellMaker::GeometryOf(const Patch& patch) const {
  return MakePatchGeometry(
      patch, scene_->materials.at(patch.material.Index()), origin_);
}

ShaftBlockers CellMaker::MakePortals(CellId cell) const {
  std::vector<PatchGeometry> triangles;
  for (const PortalId id : portals_of_[cell.Index()]) {
    ForEachTriangle(
        partition_->portals[id.Index()].vertices,
        [&](Point3 a, Point3 b, Point3 c) {
          Patch patch;
          patch.origin = a;
          patch.u = b - a;
          patch.v = c - a;
          patch.shape = PatchShape::kTriangle;
          if (Length(Cross(patch.u, patch.v)) > 0) {
            triangles.push_back(MakePatchGeometry(patch, Material{}, origin_));
          }
        });
  }
  return ShaftBlockers(triangles, BlockerKind::kPortals);
}

CellGeometry CellMaker::MakeGeometry(CellId cell,
                                     const CellPatches& stored,
                                     bool with_groups) const {
  CellGeometry geometry;
  geometry.patches =
      MakePatchGeometries(stored.patches, scene_->materials, origin_);
  geometry.portals = std::make_unique<ShaftBlockers>(MakePortals(cell));
  geometry.clusters = std::make_unique<ClusterTree>(
      geometry.patches, WholePatches(geometry.patches.size()));
  if (with_groups) {
    geometry.groups = SourceGroups(geometry.patches);
  }
  return geometry;
}

ShaftBlockers CellMaker::MakeShaftBlockers(const CellPatches& stored) const {
  std::vector<PatchGeometry> blockers;
  blockers.reserve(BlockerCount(stored));
  for (const Patch& patch : stored.patches) {
    if (!patch.is_twin) {
      blockers.push_back(GeometryOf(patch));
    }
  }
  return ShaftBlockers(blockers);
}

Box CellMaker::BoundsOf(CellId cell) const {
  const Box3& bounds = partition_->cells[cell.Index()].bounds;
  const Vec3 margin{kBoundsMargin, kBoundsMargin, kBoundsMargin};
  const Vec3 low = bounds.low - margin - origin_;
  const Vec3 high = bounds.high + margin - origin_;
  return {ToFloat(low), ToFloat(high)};
}

Box CellMaker::BoxOf(CellId cell, const CellPart& part) const {
  const Box3 box =
      enfilade::BoxOf(partition_->cells[cell.Index()].bounds, part);
  return {ToFloat(box.low - origin_), ToFloat(box.high - origin_)};
}

}  // namespace enfilade
