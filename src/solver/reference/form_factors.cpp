#include "solver/reference/form_factors.h"

namespace enfilade {
namespace {

constexpr uint64_t kMonteCarloStream = 0x3c4a7;
// Bytes for one row: its rays, their hits, and the panels by their places.
constexpr uint64_t kIndexBytesPerPanel = 128;
constexpr uint64_t kTracedRowBytes =
    3 * kHemicubePixels * kHemicubePixels *
        (sizeof(PanelRay) + sizeof(TraceRay) + sizeof(TraceHit)) +
    kMostPanelReceivers * (kIndexBytesPerPanel + sizeof(float));

Vec3 ToDouble(Vec3f v) {
  return {v.x, v.y, v.z};
}

}  // namespace

FormFactors::FormFactors(const ReferenceScene& scene,
                         FormFactorOptions options,
                         const BlockStorage& store,
                         MemoryBudget& budget)
    : scene_(scene), options_(options) {
  if (options.AreTraced()) {
    charge_ = MemoryCharge(budget, kTracedRowBytes, "the rays of a panel");
    tracer_ = std::make_unique<RayTracer>(store, budget);
  }
}

float FormFactors::Exchange(const Panel& i, const Panel& j) const {
  const bool at_center = options_.projection == Projection::kCollocation;
  if (options_.kind == FormFactorKind::kExact && !at_center) {
    return scene_.Exchange(i, j);
  }
  if (options_.AreSymmetric() && ComesBefore(j, i)) {
    return Exchange(j, i);
  }
  if (!ReferenceScene::Face(i, j)) {
    return 0;
  }
  const float form_factor = Unoccluded(i, j);
  if (form_factor <= 0) {
    return 0;
  }
  return i.end.area * form_factor *
         (at_center ? scene_.ShareSeenFromCenter(i, j)
                    : scene_.VisibleShare(i, j));
}

float FormFactors::Unoccluded(const Panel& i, const Panel& j) const {
  switch (options_.kind) {
    case FormFactorKind::kPoint:
      return PointToPoint(i.end, j.end);
    case FormFactorKind::kPolygon:
      return CenterToPolygon(i.end, j.end);
    case FormFactorKind::kSwitch:
      return SwitchOver(i.end, j.end);
    default:
      return ExactFromCenter(i.end, j.end);
  }
}

std::vector<float> FormFactors::TraceRow(const Panel& i,
                                         const PanelIndex& panels) {
  const std::vector<PanelRay> rays = RaysOf(i);
  const Vec3 off = ToDouble(i.end.patch->normal) * kRayOffsetMetres;
  std::vector<TraceRay> traced(rays.size());
  for (size_t k = 0; k < rays.size(); ++k) {
    traced[k].origin = scene_.Origin() + (ToDouble(rays[k].from) + off);
    traced[k].direction = ToDouble(rays[k].direction);
  }
  std::vector<TraceHit> hits(rays.size());
  tracer_->Trace(traced, hits);
  rays_ += rays.size();
  std::vector<float> row(panels.End());
  for (size_t k = 0; k < hits.size(); ++k) {
    const TraceHit& hit = hits[k];
    if (!hit.hit || !hit.on_front) {
      continue;
    }
    const size_t patch = scene_.CellBegin(hit.cell.Index()) + hit.patch.Index();
    if (const auto number =
            panels.Find(static_cast<uint32_t>(patch), {hit.a, hit.b})) {
      row[*number] += rays[k].share * i.end.area;
    }
  }
  return row;
}

std::vector<PanelRay> FormFactors::RaysOf(const Panel& panel) const {
  if (options_.kind == FormFactorKind::kHemicube) {
    return HemicubeRays(panel.end);
  }
  const uint64_t key = MixKey(scene_.KeyOf(panel), kMonteCarloStream);
  return options_.projection == Projection::kCollocation
             ? CosineRaysFromCenter(panel.end, key)
             : CosineRays(panel.end, key);
}

}  // namespace enfilade
