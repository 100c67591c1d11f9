#include "tools/verify_points.h"

#include "base/check.h"
#include "base/random.h"

namespace enfilade {

bool Reflects(const SceneInfo& scene, const Patch& patch) {
  return patch.reflects &&
         MaxChannel(scene.materials.at(patch.material.Index()).reflectance) > 0;
}

SidePoints::SidePoints(const BuildingView& view) : view_(&view) {
  const size_t cells = view.partition->cells.size();
  cell_areas_.resize(cells);
  for (size_t c = 0; c < cells; ++c) {
    for (const Patch& patch : view.load_cell(CellId(c)).patches) {
      if (Reflects(*view.scene, patch)) {
        cell_areas_[c] += PatchArea(patch);
      }
    }
    area_ += cell_areas_[c];
  }
}

std::vector<SidePoint> SidePoints::Choose(uint32_t count, uint64_t key) const {
  ENFILADE_CHECK(area_ > 0, "no reflecting side");
  std::vector<SidePoint> points;
  points.reserve(count);
  const auto target = [&](size_t i) {
    Random random(MixKey(key, i));
    return (static_cast<double>(i) + random.Next()) * area_ / count;
  };
  const auto add = [&](CellId cell, PatchId id, const Patch& patch) {
    Random random(MixKey(MixKey(key, points.size()), 1));
    SidePoint p;
    const double s = random.Next();
    p.point = UniformPointOn(patch, s, random.Next());
    p.point.cell = cell;
    p.point.patch = id;
    p.receiver = {PointOn(patch, p.point.a, p.point.b), PatchNormal(patch)};
    p.material = patch.material;
    p.emits = patch.emits;
    points.push_back(p);
  };
  double passed = 0;  // area up to the end of the patch at hand
  for (size_t c = 0; c < cell_areas_.size() && points.size() < count; ++c) {
    const double cell_end = passed + cell_areas_[c];
    if (cell_areas_[c] <= 0 || target(points.size()) >= cell_end) {
      passed = cell_end;
      continue;
    }
    const CellPatches cell = view_->load_cell(CellId(c));
    for (size_t p = 0; p < cell.patches.size(); ++p) {
      const Patch& patch = cell.patches[p];
      if (!Reflects(*view_->scene, patch)) {
        continue;
      }
      passed += PatchArea(patch);
      while (points.size() < count && target(points.size()) < passed) {
        add(CellId(c), PatchId(p), patch);
      }
    }
  }
  // Rounding may leave the last target a hair beyond the last patch.
  ENFILADE_CHECK(points.size() + 1 >= count, "{} points", points.size());
  return points;
}

}  // namespace enfilade
