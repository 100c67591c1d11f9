// What the outputs know of a solved building: its tables, its patches by cell,
// closest hits, and the solution as a function of points. This interface lets
// tests run the estimators on fields and scenes that are known exactly.

#pragma once

#include "base/block_storage.h"
#include "base/photometry.h"
#include "partition/partition.h"
#include "partition/patch.h"
#include "scene/scene_store.h"
#include "solver/solution/solution.h"
#include "visibility/ray_tracer.h"

#include <functional>
#include <span>
#include <vector>

namespace enfilade {

struct BuildingView {
  const SceneInfo* scene = nullptr;
  const Partition* partition = nullptr;
  // The patches of a cell, read again at every call.
  std::function<CellPatches(CellId)> load_cell;
  // As RayTracer::Trace.
  std::function<void(std::span<const TraceRay>, std::span<TraceHit>)> trace;
  // As RayTracer::Parts. May be empty: 1.
  std::function<size_t()> trace_parts;
  // As Solution::Radiosity, Solution::Irradiance and
  // DisplaySolution::Radiosity.
  std::function<std::vector<Rgb>(std::span<const PatchPoint>)> radiosity;
  std::function<std::vector<Rgb>(std::span<const PatchPoint>)> irradiance;
  std::function<std::vector<Rgb>(std::span<const PatchPoint>)>
      display_radiosity;
  // As Solution::ForEachMean. May be empty; small bright spots are then easily
  // missed.
  std::function<void(CellId,
                     std::span<const PatchId>,
                     const std::function<void(const LeafMean&)>&)>
      for_each_mean;
};

// The patch coordinates of a point uniform over the patch's area, from two
// numbers uniform in [0, 1).
PatchPoint UniformPointOn(const Patch& patch, double s, double t);

}  // namespace enfilade
