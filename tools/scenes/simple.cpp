#include "tools/scenes/simple.h"

#include "base/error.h"

#include "tools/scenes/shapes.h"

namespace enfilade {

namespace {

constexpr double kLightPower = 10;

Rgb Grey(double value) {
  return {value, value, value};
}

// Defines the material and begins an object of the same name that uses it.
void Begin(ObjWriter& out, const ObjMaterial& material) {
  out.BeginObject(material.name);
  out.UseMaterial(out.DefineMaterial(material));
}

void RequireReflectance(double reflectance, bool zero_allowed) {
  const bool above = zero_allowed ? reflectance >= 0 : reflectance > 0;
  if (!above || !(reflectance < 1)) {
    throw UsageError(fmt::format("--reflectance {}: must be {} 0 and below 1",
                                 reflectance,
                                 zero_allowed ? "at least" : "above"));
  }
}

}  // namespace

void WriteParallel(const ParallelOptions& options, ObjWriter& out) {
  if (!(options.separation > 0 && options.separation <= 100)) {
    throw UsageError(fmt::format(
        "--separation {}: must be above 0 (the squares would coincide) and at "
        "most 100",
        options.separation));
  }
  Begin(out, {"receiver", Grey(0.5), {}});
  AddRect(out, {Axis::kZ, 0, true}, {0, 1, 0, 1});
  Begin(out, {"emitter", {}, Grey(1)});
  AddRect(out, {Axis::kZ, options.separation, false}, {0, 1, 0, 1});
}

void WritePerpendicular(const PerpendicularOptions& options, ObjWriter& out) {
  if (!(options.separation >= 0 && options.separation <= 100)) {
    throw UsageError(fmt::format("--separation {}: must be from 0 to 100",
                                 options.separation));
  }
  Begin(out, {"receiver", Grey(0.5), {}});
  AddRect(out, {Axis::kZ, 0, true}, {0, 1, 0, 1});
  Begin(out, {"emitter", {}, Grey(1)});
  AddRect(out, {Axis::kX, -options.separation, true}, {0, 1, 0, 1});
}

void WriteBlocker(const BlockerOptions& options, ObjWriter& out) {
  if (!(options.height > 0 && options.height < 2)) {
    throw UsageError(fmt::format(
        "--height {}: the blocker must be above the receiver at 0 and below "
        "the light at 2",
        options.height));
  }
  Begin(out, {"receiver", Grey(0.5), {}});
  AddRect(out, {Axis::kZ, 0, true}, {-1, 1, -1, 1});
  Begin(out, {"blocker", {0.5, 0.25, 0.5}, {}, 1});
  AddRect(out, {Axis::kZ, options.height, true}, {-0.2, 0.2, -0.2, 0.2});
  Begin(out, {"light", {}, {5, 20, 50}});
  AddRect(out, {Axis::kZ, 2, false}, {-0.3, 0.3, -0.3, 0.3});
}

void WriteBox(const BoxOptions& options, ObjWriter& out) {
  RequireReflectance(options.reflectance, false);
  const double rho = options.reflectance;
  const Rect light = {0.75, 1.25, 0.75, 1.25};
  Begin(out, {"wall", Grey(rho), {}});
  AddRect(out, {Axis::kZ, 0, true}, {0, 2, 0, 2});
  AddPanel(out, {Axis::kZ, 2, false}, {0, 2, 0, 2}, {light});
  AddRect(out, {Axis::kY, 2, false}, {0, 2, 0, 2});
  Begin(out, {"left", {rho, rho * 0.4, rho * 0.4}, {}});
  AddRect(out, {Axis::kX, 0, true}, {0, 2, 0, 2});
  Begin(out, {"right", {rho * 0.4, rho * 0.4, rho}, {}});
  AddRect(out, {Axis::kX, 2, false}, {0, 2, 0, 2});
  Begin(out, {"light", {}, Grey(kLightPower / rho)});
  AddRect(out, {Axis::kZ, 2, false}, light);
}

void WriteTube(const TubeOptions& options, ObjWriter& out) {
  RequireReflectance(options.reflectance, true);
  Begin(out, {"tube", Grey(options.reflectance), {}});
  AddLining(out, Axis::kX, 0, 8, {0, 0.5, 0, 0.5});
  Begin(out, {"light", {}, Grey(kLightPower)});
  AddRect(out, {Axis::kX, 0, true}, {0, 0.5, 0, 0.5});
}

namespace {

void AddBulb(ObjWriter& out, Point3 center, double radius, uint32_t n) {
  const auto at = [&](uint32_t latitude, uint32_t longitude) {
    const double theta = kPi * latitude / n;
    const double phi = kPi * (longitude % (2 * n)) / n;
    return center + Vec3{std::sin(theta) * std::cos(phi),
                         std::sin(theta) * std::sin(phi),
                         std::cos(theta)} *
                        radius;
  };
  for (uint32_t i = 0; i < n; ++i) {
    for (uint32_t k = 0; k < 2 * n; ++k) {
      if (i > 0) {
        out.AddPolygon({at(i, k), at(i + 1, k), at(i, k + 1)});
      }
      if (i + 1 < n) {
        out.AddPolygon({at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)});
      }
    }
  }
}

}  // namespace

void WriteBulbs(const BulbsOptions& options, ObjWriter& out) {
  if (options.slices < 2 || options.slices > 1000) {
    throw UsageError(
        fmt::format("--slices {}: must be from 2 to 1000", options.slices));
  }
  const Placement here(Point3{}, 0);
  Begin(out, {"wall", Grey(0.7), {}});
  const Rect plan = {0, 4, 0, 4};
  AddRect(out, {Axis::kZ, 0, true}, plan);
  AddRect(out, {Axis::kZ, 2.7, false}, plan);
  AddLining(out, Axis::kZ, 0, 2.7, plan);
  Begin(out, {"table", {0.4, 0.3, 0.2}, {}});
  AddBox(out, here, {{1.2, 1, 0.7}, {2.4, 2, 0.74}});
  for (const double x : {1.25, 2.3}) {
    for (const double y : {1.05, 1.9}) {
      AddBox(out, here, {{x, y, 0}, {x + 0.05, y + 0.05, 0.7}});
    }
  }
  Begin(out, {"bulb", {}, Grey(1000)});
  AddBulb(out, {1.5, 1.7, 2.2}, 0.03, options.slices);
  AddBulb(out, {3, 3, 2.2}, 0.03, options.slices);
}

namespace {

// Adds the sides of an upright tube. Both faces of a side reflect.
void AddTube(ObjWriter& out, Point3 low, double radius, double height) {
  constexpr int kSides = 8;
  const auto at = [&](int i, double z) {
    const double phi = 2 * kPi * (i % kSides) / kSides;
    return low + Vec3{radius * std::cos(phi), radius * std::sin(phi), z};
  };
  for (int i = 0; i < kSides; ++i) {
    out.AddPolygon({at(i, 0), at(i, height), at(i + 1, height), at(i + 1, 0)});
  }
}

}  // namespace

void WriteDownlights(const DownlightsOptions& options, ObjWriter& out) {
  if (options.count < 1 || options.count > 400) {
    throw UsageError(
        fmt::format("--count {}: must be from 1 to 400", options.count));
  }
  constexpr Rect kPlan = {0, 6, 0, 5};
  constexpr double kCeiling = 2.8;
  constexpr double kTubeHeight = 0.1;
  Begin(out, {"floor", Grey(0.3), {}});
  AddRect(out, {Axis::kZ, 0, true}, kPlan);
  Begin(out, {"ceiling", Grey(0.8), {}});
  AddRect(out, {Axis::kZ, kCeiling, false}, kPlan);
  Begin(out, {"wall", Grey(0.6), {}});
  AddLining(out, Axis::kZ, 0, kCeiling, kPlan);
  Begin(out, {"table", {0.4, 0.3, 0.2}, {}});
  AddBox(out, Placement(Point3{}, 0), {{2, 2, 0.72}, {3.5, 3, 0.75}});
  std::vector<Point3> places;
  const auto columns =
      static_cast<uint32_t>(std::ceil(std::sqrt(options.count)));
  const uint32_t rows = (options.count + columns - 1) / columns;
  for (uint32_t i = 0; i < options.count; ++i) {
    const uint32_t column = i % columns;
    const uint32_t row = i / columns;
    places.push_back({kPlan.Width() * (column + 0.5) / columns,
                      kPlan.Height() * (row + 0.5) / rows,
                      kCeiling - kTubeHeight});
  }
  Begin(out, {"tube", Grey(0.8), {}});
  for (const Point3 place : places) {
    AddTube(out, place, 0.05, kTubeHeight);
  }
  Begin(out, {"lamp", {}, Grey(3000)});
  for (const Point3 place : places) {
    AddBulb(out, place + Vec3{0, 0, kTubeHeight / 2}, 0.02, 2);
  }
}

}  // namespace enfilade
