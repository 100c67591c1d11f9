#include "scene/gbxml_repair.h"

#include "base/planar_polygon.h"

#include <utility>

namespace enfilade {
namespace {

// Surfaces that come this near to each other are meant to touch.
constexpr double kCrackMetres = 3e-3;
constexpr double kLeastThicknessMetres = 1e-3;  // thinner polygons have no area

CrackSummary CloseModelCracks(MemoryBudget& budget, GbxmlModel& model) {
  std::vector<PolygonWithOpenings> polygons(model.surfaces.size());
  for (size_t i = 0; i < polygons.size(); ++i) {
    polygons[i].outline = std::move(model.surfaces[i].polygon);
    for (GbxmlOpening& opening : model.surfaces[i].openings) {
      polygons[i].openings.push_back(std::move(opening.polygon));
    }
  }
  const CrackSummary summary = CloseCracks(kCrackMetres, budget, polygons);
  for (size_t i = 0; i < polygons.size(); ++i) {
    GbxmlSurface& surface = model.surfaces[i];
    surface.polygon = std::move(polygons[i].outline);
    for (size_t k = 0; k < surface.openings.size(); ++k) {
      surface.openings[k].polygon = std::move(polygons[i].openings[k]);
    }
  }
  return summary;
}

}  // namespace

GbxmlRepair RepairGbxmlModel(MemoryBudget& budget, GbxmlModel& model) {
  GbxmlRepair repair;
  repair.cracks = CloseModelCracks(budget, model);
  const auto is_thin = [](const auto& shape) {
    return Thickness(shape.polygon) < kLeastThicknessMetres;
  };
  for (GbxmlSurface& surface : model.surfaces) {
    const size_t thin =
        std::erase_if(surface.openings, is_thin) + (is_thin(surface) ? 1U : 0U);
    if (repair.dropped == 0 && thin > 0) {
      repair.first_dropped = surface.id;
    }
    repair.dropped += thin;
  }
  std::erase_if(model.surfaces, is_thin);
  return repair;
}

}  // namespace enfilade
