// Where the audit's rays start, and where they go. Internal to src/visibility.

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

// Half of the rays by area, half of them alike to all cells. Ascending.
std::vector<CellShare> ShareRays(const BlockStorage& store, uint64_t rays);

// Draws the rays of one cell, each a function of the cell and its number. They
// start evenly on the fronts of its patches; every other one is as likely in
// each direction, for what is seen at a grazing angle, those between are by the
// cosine.
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

// Rays in the same direction that start on the same patch.
std::array<TraceRay, kRaysBeside> RaysBeside(const TraceRay& ray);

}  // namespace enfilade
