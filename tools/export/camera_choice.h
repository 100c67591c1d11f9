// Chooses a camera that shows a solution well where the user leaves it open.

#pragma once

#include "base/memory.h"
#include "scene/scene_store.h"

#include "tools/building_view.h"
#include "tools/export/camera.h"

namespace enfilade {

// `up` itself or, if automatic, the axis that import took for up.
UpAxis ChooseUpAxis(const SceneInfo& scene, UpAxis up);

inline Vec3 UpVector(UpAxis up) {
  return up == UpAxis::kY ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
}

// Fills in what the options leave open. Needs the view's tracer, radiosity and
// irradiance. Deterministic.
Camera ChooseCamera(const BuildingView& view,
                    const CameraOptions& options,
                    double aspect,
                    MemoryBudget& budget);

}  // namespace enfilade
