#include "tools/verify/survey.h"

#include "base/random.h"

#include <algorithm>

#include "tools/verify/points.h"

namespace enfilade {
namespace {

constexpr uint64_t kLeastPointsOfCell = 16;      // of a cell
constexpr uint64_t kPointsOfAllCells = 1 << 19;  // of all cells, about

std::vector<Receiver> PointsOfCell(const BuildingView& view,
                                   CellId cell,
                                   uint64_t key,
                                   size_t count) {
  const CellPatches patches = view.load_cell(cell);
  double area = 0;
  for (const Patch& patch : patches.patches) {
    area += Reflects(patch, view.scene->materials) ? PatchArea(patch) : 0;
  }
  std::vector<Receiver> points;
  Random random(key);
  double passed = 0;
  for (const Patch& patch : patches.patches) {
    if (!Reflects(patch, view.scene->materials)) {
      continue;
    }
    passed += PatchArea(patch);
    while (points.size() < count &&
           (static_cast<double>(points.size()) + .5) * area <
               passed * static_cast<double>(count)) {
      const double s = random.Next();
      const PatchPoint p = UniformPointOn(patch, s, random.Next());
      points.push_back({PointOn(patch, p.a, p.b), PatchNormal(patch), cell});
    }
  }
  return points;
}

}  // namespace

CellSurveyor::CellSurveyor(const BuildingView& view)
    : view_(&view),
      points_(std::clamp(
          kPointsOfAllCells / std::max<size_t>(view.partition->cells.size(), 1),
          kLeastPointsOfCell,
          kMostPoints)) {
  neighbours_.reserve(2 * view.partition->portals.size());
  for (const Portal& portal : view.partition->portals) {
    neighbours_.emplace_back(portal.front, portal.back);
    neighbours_.emplace_back(portal.back, portal.front);
  }
  std::sort(neighbours_.begin(), neighbours_.end());
}

uint64_t CellSurveyor::Bytes(const BuildingView& view) {
  return 2 * view.partition->portals.size() * sizeof(neighbours_[0]);
}

std::vector<CellId> CellSurveyor::WithNeighbours(CellId cell) const {
  std::vector<CellId> cells = {cell};
  for (auto at = std::lower_bound(
           neighbours_.begin(), neighbours_.end(), std::pair(cell, CellId(0U)));
       at != neighbours_.end() && at->first == cell;
       ++at) {
    cells.push_back(at->second);
  }
  return cells;
}

std::vector<CellSurvey> CellSurveyor::Survey(size_t first,
                                             size_t count,
                                             uint64_t key) const {
  std::vector<CellSurvey> group(
      std::min(count, view_->partition->cells.size() - first));
  for (size_t k = 0; k < group.size(); ++k) {
    CellSurvey& survey = group[k];
    survey.cell = CellId(first + k);
    survey.key = MixKey(key, first + k);
    survey.cells = WithNeighbours(survey.cell);
    survey.points =
        PointsOfCell(*view_, survey.cell, MixKey(survey.key, 0), points_);
  }
  TraceFromPoints(group);
  for (CellSurvey& survey : group) {
    std::sort(survey.cells.begin(), survey.cells.end());
    const auto end = std::unique(survey.cells.begin(), survey.cells.end());
    survey.cells.erase(end, survey.cells.end());
  }
  return group;
}

void CellSurveyor::TraceFromPoints(std::vector<CellSurvey>& group) const {
  const double offset = RayOffset(view_->scene->bounds);
  std::vector<TraceRay> rays;
  std::vector<size_t> owners;
  for (size_t k = 0; k < group.size(); ++k) {
    Random random(MixKey(group[k].key, 1));
    for (const Receiver& r : group[k].points) {
      const double u = random.Next();
      rays.push_back({r.position + r.normal * offset,
                      CosineDirection(r.normal, u, random.Next())});
      owners.push_back(k);
    }
  }
  std::vector<TraceHit> hits(rays.size());
  view_->trace(rays, hits);
  for (size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].hit) {
      group[owners[i]].cells.push_back(hits[i].cell);
    }
  }
}

}  // namespace enfilade
