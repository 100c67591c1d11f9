// Decides where the audit's rays start and in which direction they go. Internal
// to src/visibility.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/vec.h"
#include "partition/patch.h"
#include "visibility/ray_tracer.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace enfilade {

// How many rays start in a cell that has patches.
struct CellShare {
  CellId cell;
  Box3 bounds = {};
  double area_m2 = 0;  // of its patches
  uint64_t rays = 0;
};

// Distributes half of the rays by area and half evenly over all cells that have
// patches. Ascending by cell.
std::vector<CellShare> ShareRays(const BlockStorage& store, uint64_t rays);

// Draws the rays of one cell. Each ray is a function of the cell and the ray's
// number. The rays start evenly distributed on the fronts of the cell's
// patches. Even numbers have cosine-distributed directions, odd numbers uniform
// ones, which find what is seen at a grazing angle.
class AuditRays {
 public:
  AuditRays(CellId cell, const CellPatches& content);

  [[nodiscard]] TraceRay Draw(uint64_t number) const;

 private:
  CellId cell_;
  const std::vector<Patch>* patches_;
  std::vector<double> area_until_;  // m2
};

constexpr size_t kRaysBeside = 4;

// Rays beside `ray`, in the same direction and starting on the same patch.
std::array<TraceRay, kRaysBeside> RaysBeside(const TraceRay& ray);

}  // namespace enfilade
