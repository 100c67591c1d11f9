#include "tools/building_surfaces.h"

#include <algorithm>
#include <numeric>

namespace enfilade {
namespace {

Surface SurfaceAt(const SceneInfo& scene,
                  const Patch& patch,
                  const TraceRay& ray,
                  const TraceHit& hit) {
  const Material& material = scene.materials.at(patch.material.Index());
  Surface surface;
  surface.hit = true;
  surface.normal = PatchNormal(patch);
  surface.front = Dot(surface.normal, ray.direction) < 0;
  surface.position = PointOn(patch, hit.a, hit.b);
  surface.raised = patch.layer * kApartM;
  if (patch.reflects) {
    surface.reflectance = material.reflectance;
  }
  if (patch.emits) {
    surface.exitance = material.exitance;
  }
  return surface;
}

}  // namespace

SurfaceReader::SurfaceReader(const BuildingView& view,
                             MemoryBudget& budget,
                             uint64_t cache_bytes)
    : view_(&view),
      budget_(&budget),
      cache_bytes_(cache_bytes),
      charge_(budget, cache_bytes, "the surfaces that rays hit") {}

void SurfaceReader::EvictUntilFits(uint64_t bytes) {
  while (!entries_.empty() && held_bytes_ + bytes > cache_bytes_) {
    held_bytes_ -= entries_.back().bytes;
    by_cell_.erase(entries_.back().cell);
    entries_.pop_back();
  }
}

const std::vector<Patch>& SurfaceReader::Patches(CellId cell) {
  const auto found = by_cell_.find(cell);
  if (found != by_cell_.end()) {
    entries_.splice(entries_.begin(), entries_, found->second);
    return entries_.front().patches;
  }
  const uint64_t bytes =
      view_->partition->cells.at(cell.Index()).patches * sizeof(Patch);
  EvictUntilFits(bytes);
  Entry entry;
  entry.cell = cell;
  entry.bytes = bytes;
  if (bytes > cache_bytes_) {
    entry.excess =
        MemoryCharge(*budget_, bytes - cache_bytes_, "the patches of a cell");
  }
  entry.patches = view_->load_cell(cell).patches;
  held_bytes_ += bytes;
  entries_.push_front(std::move(entry));
  by_cell_[cell] = entries_.begin();
  return entries_.front().patches;
}

void SurfaceReader::Read(std::span<const TraceRay> rays,
                         std::span<const TraceHit> hits,
                         std::span<Surface> surfaces) {
  order_.resize(hits.size());
  std::iota(order_.begin(), order_.end(), 0U);
  std::stable_sort(
      order_.begin(), order_.end(), [&](uint32_t left, uint32_t right) {
        return hits[left].cell < hits[right].cell;
      });
  for (const uint32_t i : order_) {
    if (!hits[i].hit) {
      surfaces[i] = Surface{};
      continue;
    }
    const std::vector<Patch>& patches = Patches(hits[i].cell);
    const Patch& patch = patches.at(hits[i].patch.Index());
    surfaces[i] = SurfaceAt(*view_->scene, patch, rays[i], hits[i]);
  }
}

}  // namespace enfilade
