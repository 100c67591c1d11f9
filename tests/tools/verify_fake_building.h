// A building made by hand: a few patches, brute-force closest hits in double
// precision and a solution given as a formula.

#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tools/building_view.h"

namespace enfilade {

class FakeBuilding {
 public:
  using Field = std::function<Rgb(const Patch&, Point3)>;

  FakeBuilding() {
    view_.scene = &scene_;
    view_.partition = &partition_;
    view_.load_cell = [this](CellId cell) { return cells_.at(cell.Index()); };
    view_.trace = [this](std::span<const TraceRay> rays,
                         std::span<TraceHit> hits) {
      for (size_t i = 0; i < rays.size(); ++i) {
        hits[i] = Closest(rays[i]);
      }
    };
    view_.radiosity = [this](std::span<const PatchPoint> points) {
      return Evaluate(points, radiosity_);
    };
    view_.display_radiosity = view_.radiosity;
    view_.irradiance = [this](std::span<const PatchPoint> points) {
      return Evaluate(points, irradiance_);
    };
    AddCell();
  }

  ~FakeBuilding() = default;
  FakeBuilding(const FakeBuilding&) = delete;
  FakeBuilding& operator=(const FakeBuilding&) = delete;

  [[nodiscard]] const BuildingView& View() const { return view_; }

  void SetRadiosity(Field field) { radiosity_ = std::move(field); }

  void SetIrradiance(Field field) { irradiance_ = std::move(field); }

  // As if import had moved vertices by up to so far, m.
  void SetGreatestMove(double metres) { scene_.greatest_move_m = metres; }

  // Patches are added to the last cell.
  void AddCell() {
    cells_.emplace_back();
    partition_.cells.emplace_back();
  }

  MaterialId AddMaterial(Rgb reflectance, Rgb exitance) {
    Material m;
    m.name = "m" + std::to_string(scene_.materials.size());
    m.reflectance = reflectance;
    m.exitance = exitance;
    scene_.materials.push_back(m);
    return MaterialId(scene_.materials.size() - 1);
  }

  void Add(Point3 origin,
           Vec3 u,
           Vec3 v,
           MaterialId material,
           PatchShape shape = PatchShape::kParallelogram) {
    Patch p;
    p.origin = origin;
    p.u = u;
    p.v = v;
    p.material = material;
    p.shape = shape;
    p.emits = Emits(scene_.materials[material.Index()]);
    cells_.back().patches.push_back(p);
    CellInfo& info = partition_.cells.back();
    ++info.patches;
    info.area_m2 += PatchArea(p);
    for (const Point3 corner : {origin, origin + u, origin + v}) {
      info.bounds.Include(corner);
      scene_.bounds.Include(corner);
    }
    cells_.back().bounds = info.bounds;
  }

  // Puts the last patch that many layers in front of where it was added.
  void Raise(uint8_t layers) {
    Patch& p = cells_.back().patches.back();
    p.layer = layers;
    p.origin = p.origin + PatchNormal(p) * (layers * kApartM);
  }

  // A closed box from (0,0,0) to `size`, seen from inside: floor, ceiling and
  // four walls.
  void AddRoom(Vec3 size, MaterialId walls) {
    const Vec3 x{size.x, 0, 0};
    const Vec3 y{0, size.y, 0};
    const Vec3 z{0, 0, size.z};
    const Point3 o;
    Add(o, x, y, walls);
    Add(o + z, y, x, walls);
    Add(o, y, z, walls);
    Add(o + x, z, y, walls);
    Add(o, z, x, walls);
    Add(o + y, x, z, walls);
  }

 private:
  [[nodiscard]] TraceHit Closest(const TraceRay& ray) const {
    TraceHit best;
    best.distance = ray.max_distance;
    for (size_t c = 0; c < cells_.size(); ++c) {
      for (size_t p = 0; p < cells_[c].patches.size(); ++p) {
        const Patch& patch = cells_[c].patches[p];
        const Vec3 n = Cross(patch.u, patch.v);
        const double slope = Dot(n, ray.direction);
        const double t = Dot(n, patch.origin - ray.origin) / slope;
        if (slope == 0 || t <= 0 || t >= best.distance) {
          continue;
        }
        const Vec3 d = (ray.origin + ray.direction * t) - patch.origin;
        const double a = Dot(Cross(d, patch.v), n) / Dot(n, n);
        const double b = Dot(Cross(patch.u, d), n) / Dot(n, n);
        const double most = patch.shape == PatchShape::kTriangle ? 1 - a : 1.0;
        if (a >= 0 && b >= 0 && a <= 1 && b <= most) {
          best = {true, t, CellId(c), PatchId(p), a, b};
        }
      }
    }
    return best;
  }

  [[nodiscard]] std::vector<Rgb> Evaluate(std::span<const PatchPoint> points,
                                          const Field& field) const {
    std::vector<Rgb> values;
    for (const PatchPoint& point : points) {
      const Patch& patch =
          cells_.at(point.cell.Index()).patches.at(point.patch.Index());
      values.push_back(field(patch, PointOn(patch, point.a, point.b)));
    }
    return values;
  }

  SceneInfo scene_;
  Partition partition_;
  std::vector<CellPatches> cells_;
  Field radiosity_;
  Field irradiance_;
  BuildingView view_;
};

// Irradiance at x from a polygon of exitance 1 that x sees wholly: half the sum
// over its edges of the angle an edge subtends times the component along the
// normal of the unit normal of the edge's plane with x, over pi (Lambert).
// Positive if the polygon is counter-clockwise seen from x.
inline double PolygonIrradiance(Point3 x,
                                Vec3 normal,
                                const std::vector<Point3>& polygon) {
  double sum = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 a = Normalize(polygon[i] - x);
    const Vec3 b = Normalize(polygon[(i + 1) % polygon.size()] - x);
    const Vec3 edge = Cross(a, b);
    const double sine = Length(edge);
    if (sine > 0) {
      sum += std::atan2(sine, Dot(a, b)) * Dot(edge, normal) / sine;
    }
  }
  return sum / (2 * std::numbers::pi) * -1;
}

}  // namespace enfilade
