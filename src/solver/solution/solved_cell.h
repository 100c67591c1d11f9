// The solution in one cell, while the cell is in memory.

#pragma once

#include "base/ids.h"
#include "base/photometry.h"
#include "base/vec.h"
#include "partition/patch.h"
#include "scene/scene_store.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/solution/cell_loader.h"
#include "solver/solution/points_by_cell.h"

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// A leaf of an element tree: three or four corners in the order of
// AreaVector (counter-clockwise seen from the front), and the radiosity and
// irradiance that the solution has there.
struct LeafElement {
  PatchId patch;
  std::vector<Point3> corners;
  std::vector<Rgb> radiosity;   // W/m2 at the corners
  std::vector<Rgb> irradiance;  // W/m2 at the corners
};

// A leaf and its mean irradiance, W/m2.
struct LeafMean {
  PatchId patch;
  ElementFrame frame;
  double area = 0;  // m2
  Rgb irradiance{};
};

// The light that leaves a point, and what the surface there reflects.
struct LightAtPoint {
  Rgb radiosity{};                       // W/m2
  std::optional<MaterialId> reflecting;  // none if the side reflects nothing
};

// The radiosity of a patch (a Patch or PatchGeometry) of this material that
// receives this irradiance, W/m2.
template <typename PatchLike>
Rgb RadiosityOf(const PatchLike& patch,
                const Material& material,
                const Rgb& irradiance) {
  Rgb radiosity{};
  for (size_t c = 0; c < kRgbChannels; ++c) {
    radiosity[c] =
        (patch.emits ? material.exitance[c] : 0.0) +
        (patch.reflects ? material.reflectance[c] * irradiance[c] : 0.0);
  }
  return radiosity;
}

class SolvedCell {
 public:
  // Both are borrowed.
  SolvedCell(const SceneInfo& scene, const LoadedCell& loaded)
      : scene_(&scene), loaded_(&loaded) {}

  [[nodiscard]] std::span<const Patch> Patches() const {
    return loaded_->stored.patches;
  }

  // At a point on one of the cell's patches, W/m2; none below 0.
  [[nodiscard]] Rgb IrradianceAt(const PatchPoint& point) const;
  [[nodiscard]] LightAtPoint LightAt(const PatchPoint& point) const;

  // Visits all leaves in a fixed order. At their corners the basis may swing
  // below 0; these values are as they are, so that means are right.
  void ForEachLeaf(const std::function<void(const LeafElement&)>& visit) const;

  // Visits the leaves of `patches`, patch by patch and in a fixed order.
  void ForEachMean(std::span<const PatchId> patches,
                   const std::function<void(const LeafMean&)>& visit) const;

 private:
  using NodeIrradiance = std::array<float, kRgbChannels * kMaxNodes>;

  // The polynomial's value, which may be below 0.
  [[nodiscard]] Rgb Evaluate(PatchId patch, UnitPoint p) const;
  [[nodiscard]] LeafElement LeafOf(const Element& element) const;
  void VisitMeans(ElementId element,
                  const NodeIrradiance& above,
                  const std::function<void(const LeafMean&)>& visit) const;
  [[nodiscard]] Rgb RadiosityWith(PatchId patch, const Rgb& irradiance) const;

  const SceneInfo* scene_;
  const LoadedCell* loaded_;
};

}  // namespace enfilade
