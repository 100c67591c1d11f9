#include "tools/export/camera_choice.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "tools/building_surfaces.h"
#include "tools/export/render_tone.h"
#include "tools/verify/points.h"

namespace enfilade {
namespace {

constexpr uint64_t kCameraSeedDomain = 0x63616d6572610001ULL;
constexpr size_t kCellSamples = 16;  // points that tell how well lit a cell is
constexpr size_t kMostPending = 8192;  // evaluated together
constexpr size_t kBestCells = 6;       // tried with test pictures
constexpr int kTestWidth = 24;
constexpr int kTestHeight = 14;
constexpr double kEyeHeight = 1.6;  // m
constexpr double kCutHeight = 1.8;  // m above the floor
constexpr double kFloorBin = 0.25;  // m
constexpr double kFarthest = 15;    // m; a longer view counts no more

double Along(Vec3 v, UpAxis up) {
  return up == UpAxis::kY ? v.y : v.z;
}

double Along(Point3 p, UpAxis up) {
  return up == UpAxis::kY ? p.y : p.z;
}

// A point, the owner of the sum that it counts for, and its weight.
struct Weighted {
  PatchPoint point;
  size_t owner = 0;   // cell, or bin of height
  double weight = 0;  // m2
};

// Adds weight times luminous irradiance of each point to its owner's sum.
class LightSums {
 public:
  explicit LightSums(const BuildingView& view) : view_(view) {}

  void Add(const Weighted& w) {
    pending_.push_back(w);
    if (pending_.size() >= kMostPending) {
      Flush();
    }
  }

  void Flush() {
    std::vector<PatchPoint> points;
    points.reserve(pending_.size());
    for (const Weighted& w : pending_) {
      points.push_back(w.point);
    }
    const std::vector<Rgb> irradiance = view_.irradiance(points);
    for (size_t i = 0; i < pending_.size(); ++i) {
      sums_[pending_[i].owner] += pending_[i].weight * Luminance(irradiance[i]);
    }
    pending_.clear();
  }

  // By owner; owners without points are missing.
  [[nodiscard]] const std::map<size_t, double>& Sums() const { return sums_; }

 private:
  const BuildingView& view_;
  std::vector<Weighted> pending_;
  std::map<size_t, double> sums_;
};

// The cells that receive most light, the best first.
std::vector<CellId> BestLitCells(const BuildingView& view) {
  LightSums light(view);
  for (size_t c = 0; c < view.partition->cells.size(); ++c) {
    const CellPatches cell = view.load_cell(CellId(c));
    if (cell.patches.empty()) {
      continue;
    }
    Random random(MixKey(kCameraSeedDomain, c));
    for (size_t k = 0; k < kCellSamples; ++k) {
      const size_t p =
          random.NextBelow(static_cast<uint32_t>(cell.patches.size()));
      const Patch& patch = cell.patches[p];
      const double s = random.Next();
      Weighted w;
      w.point = UniformPointOn(patch, s, random.Next());
      w.point.cell = CellId(c);
      w.point.patch = PatchId(p);
      w.owner = c;
      w.weight = PatchArea(patch) * static_cast<double>(cell.patches.size()) /
                 kCellSamples;
      if (Reflects(patch, view.scene->materials)) {
        light.Add(w);
      }
    }
  }
  light.Flush();
  std::vector<std::pair<double, CellId>> ranked;
  for (const auto& [cell, sum] : light.Sums()) {
    ranked.emplace_back(-sum, CellId(cell));
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<CellId> best;
  for (size_t i = 0; i < std::min(kBestCells, ranked.size()); ++i) {
    best.push_back(ranked[i].second);
  }
  return best;
}

// Where the plan is cut: above the floor level that receives most light.
double ChooseCut(const BuildingView& view, UpAxis up) {
  LightSums light(view);
  const double bottom = Along(view.scene->bounds.low, up);
  for (size_t c = 0; c < view.partition->cells.size(); ++c) {
    const CellPatches cell = view.load_cell(CellId(c));
    for (size_t p = 0; p < cell.patches.size(); ++p) {
      const Patch& patch = cell.patches[p];
      if (Along(PatchNormal(patch), up) < 0.99 ||
          !Reflects(patch, view.scene->materials)) {
        continue;
      }
      Weighted w;
      w.point = {CellId(c), PatchId(p), 0.25, 0.25};
      w.weight = PatchArea(patch);
      const double height = Along(PointOn(patch, 0.25, 0.25), up) - bottom;
      w.owner = static_cast<size_t>(std::max(0.0, height) / kFloorBin);
      light.Add(w);
    }
  }
  light.Flush();
  double best = 0;
  double floor = bottom;
  for (const auto& [bin, sum] : light.Sums()) {
    if (sum > best) {
      best = sum;
      floor = bottom + static_cast<double>(bin) * kFloorBin;
    }
  }
  return floor + kCutHeight;
}

// Rays of a coarse picture, in the order of rows.
std::vector<TraceRay> TestRays(const Camera& camera) {
  std::vector<TraceRay> rays;
  for (int row = 0; row < kTestHeight; ++row) {
    for (int column = 0; column < kTestWidth; ++column) {
      const double x = (2 * column + 1.0) / kTestWidth - 1;
      const double y = 1 - (2 * row + 1.0) / kTestHeight;
      TraceRay ray;
      ray.origin = camera.origin + camera.origin_x * x + camera.origin_y * y;
      ray.direction =
          camera.direction + camera.direction_x * x + camera.direction_y * y;
      rays.push_back(ray);
    }
  }
  return rays;
}

// The score of a test picture: high if much lit surface is seen far away, low
// if backs, the void or something right before the lens is seen.
double TestPicture(const BuildingView& view,
                   SurfaceReader& surfaces,
                   const Camera& camera) {
  const std::vector<TraceRay> rays = TestRays(camera);
  std::vector<TraceHit> hits(rays.size());
  view.trace(rays, hits);
  std::vector<Surface> seen(rays.size());
  surfaces.Read(rays, hits, seen);
  std::vector<PatchPoint> points;
  std::vector<double> worth;
  double score = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!seen[i].front) {
      score -= seen[i].hit ? 3 : 0.5;
      continue;
    }
    const double distance = Length(seen[i].position - rays[i].origin);
    points.push_back({hits[i].cell, hits[i].patch, hits[i].a, hits[i].b});
    worth.push_back(distance < 0.5 ? -1
                                   : std::sqrt(std::min(distance, kFarthest)));
  }
  const std::vector<Rgb> radiosity = view.radiosity(points);
  for (size_t i = 0; i < points.size(); ++i) {
    const bool lit = Luminance(radiosity[i]) > 0;
    score += worth[i] < 0 || lit ? worth[i] : 0;
  }
  return score;
}

// Points near the four corners of a box, at eye height above its bottom.
std::vector<Point3> EyesIn(const Box3& box, UpAxis up) {
  const Vec3 extent = box.Extent();
  const double height = Along(extent, up);
  const double eye = std::min(kEyeHeight, 0.6 * height);
  std::vector<Point3> eyes;
  for (int corner = 0; corner < 4; ++corner) {
    const auto place = [&](double low, double size, bool high) {
      const double inset = std::min(0.6, 0.2 * size);
      return high ? low + size - inset : low + inset;
    };
    const double x = place(box.low.x, extent.x, corner % 2 != 0);
    eyes.push_back(up == UpAxis::kY
                       ? Point3{x,
                                box.low.y + eye,
                                place(box.low.z, extent.z, corner / 2 != 0)}
                       : Point3{x,
                                place(box.low.y, extent.y, corner / 2 != 0),
                                box.low.z + eye});
  }
  return eyes;
}

// Nudges a target that lies straight above or below the eye.
Camera LookAt(Point3 eye,
              Point3 target,
              UpAxis up,
              const CameraOptions& options,
              double aspect) {
  const Vec3 direction = Normalize(target - eye);
  if (std::abs(Along(direction, up)) > 0.9999) {
    target = target + Vec3{0.02, 0, 0} * Length(target - eye);
  }
  return PerspectiveCamera(
      eye, target, UpVector(up), options.vertical_fov_degrees, aspect);
}

Camera ChooseView(const BuildingView& view,
                  const CameraOptions& options,
                  UpAxis up,
                  double aspect,
                  MemoryBudget& budget) {
  SurfaceReader surfaces(view, budget, budget.FreeBytes() / 16);
  const Box3& bounds = view.scene->bounds;
  const Point3 middle = options.target.value_or(bounds.Center());
  Camera best = LookAt(middle - Vec3{0.5, 0.5, 0}, middle, up, options, aspect);
  double best_score = TestPicture(view, surfaces, best);
  for (const CellId cell : BestLitCells(view)) {
    const Box3& box = view.partition->cells[cell.Index()].bounds;
    const std::vector<Point3> eyes = EyesIn(box, up);
    for (size_t i = 0; i < eyes.size(); ++i) {
      // The opposite corner, a little below the eye.
      const Vec3 down = UpVector(up) * (0.2 * Along(box.Extent(), up));
      const Point3 target = options.target.value_or(eyes[3 - i] - down);
      if (IsOnePoint(eyes[i], target)) {
        continue;
      }
      const Camera camera = LookAt(eyes[i], target, up, options, aspect);
      const double score = TestPicture(view, surfaces, camera);
      if (score > best_score) {
        best_score = score;
        best = camera;
      }
    }
  }
  return best;
}

}  // namespace

UpAxis ChooseUpAxis(const SceneInfo& scene, UpAxis up) {
  if (up != UpAxis::kAutomatic) {
    return up;
  }
  return scene.y_is_up ? UpAxis::kY : UpAxis::kZ;
}

Camera ChooseCamera(const BuildingView& view,
                    const CameraOptions& options,
                    double aspect,
                    MemoryBudget& budget) {
  const UpAxis up = ChooseUpAxis(*view.scene, options.up);
  if (options.view == CameraView::kPlan) {
    const double cut =
        options.plan_cut_m ? *options.plan_cut_m : ChooseCut(view, up);
    return PlanCamera(view.scene->bounds, up, cut, aspect);
  }
  if (options.eye) {
    Point3 target = options.target.value_or(view.scene->bounds.Center());
    if (IsOnePoint(*options.eye, target)) {
      target = target + Vec3{1, 0, 0};
    }
    return LookAt(*options.eye, target, up, options, aspect);
  }
  return ChooseView(view, options, up, aspect, budget);
}

}  // namespace enfilade
