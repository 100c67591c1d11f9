#include "tools/scenes/chairs.h"

#include "base/error.h"
#include "base/photometry.h"
#include "base/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "tools/scenes/shapes.h"

namespace enfilade {

namespace {

constexpr double kPitch = 1.0;       // floor per chair along x and y, metres
constexpr double kRoomHeight = 3.0;  // where the height does not grow, metres
constexpr double kHeightOverSide = 0.75;
constexpr double kLowestRoom = 1.4;      // keeps the light above the chairs
constexpr double kLightOverSide = 0.25;  // edge of the light over floor edge
constexpr double kLightExitance = 20;
constexpr double kMaxTurn = 0.6;     // radians
constexpr double kClearance = 0.02;  // least distance kept, metres
constexpr uint32_t kUnscaledCount = 36;
constexpr uint32_t kMaxCount = 4'000'000;

// A grid of cells on the floor of a room.
struct Room {
  uint32_t columns = 1, rows = 1;
  double width = 0, depth = 0, height = 0;
};

uint32_t CeilSqrt(uint32_t n) {
  uint32_t root = 0;
  while (uint64_t{root} * root < n) {
    ++root;
  }
  return root;
}

// A room whose grid of at least `count` cells is as square as can be; a cell
// has the edge kPitch.
Room GrownRoom(uint32_t count) {
  Room room;
  room.columns = std::max(1U, CeilSqrt(count));
  room.rows = std::max(1U, (count + room.columns - 1) / room.columns);
  room.width = room.columns * kPitch;
  room.depth = room.rows * kPitch;
  room.height = std::max(kLowestRoom,
                         kHeightOverSide * std::sqrt(room.width * room.depth));
  return room;
}

Room RoomFor(const ChairsOptions& options) {
  Room room = GrownRoom(options.count);
  if (options.scaling == ChairScaling::kHorizontal) {
    room.height = kRoomHeight;
  } else if (options.scaling == ChairScaling::kNone) {
    const Room fixed = GrownRoom(kUnscaledCount);
    room.width = fixed.width;
    room.depth = fixed.depth;
    room.height = fixed.height;
  }
  return room;
}

void RequireChairCount(uint32_t count, uint32_t least) {
  if (count < least || count > kMaxCount) {
    throw UsageError(fmt::format(
        "--count {}: must be from {} to {}", count, least, kMaxCount));
  }
}

// How the chairs of a room fit the cells of its grid. `scale` is below 1 if a
// cell is too small for a chair of full size; `play` is the distance by which a
// chair may move along x and y without leaving its cell, metres.
struct ChairFit {
  double scale = 1;
  double play = 0;
};

ChairFit FitChairs(const Room& room) {
  const double needed = 2 * (kChairRadius + kClearance);
  const double cell =
      std::min(room.width / room.columns, room.depth / room.rows);
  ChairFit fit;
  fit.scale = std::min(1.0, cell / needed);
  fit.play = (cell - fit.scale * needed) / 2;
  return fit;
}

void AddChairs(ObjWriter& out,
               const Room& room,
               uint32_t count,
               uint64_t seed,
               ChairBuild build,
               std::span<const MaterialId> materials) {
  const ChairFit fit = FitChairs(room);
  for (uint32_t i = 0; i < count; ++i) {
    Random random(MixKey(seed, i));
    const uint32_t column = i % room.columns;
    const uint32_t row = i / room.columns;
    const double dx = (2 * random.Next() - 1) * fit.play;
    const double dy = (2 * random.Next() - 1) * fit.play;
    const double turn = (2 * random.Next() - 1) * kMaxTurn;
    const Point3 origin = {(column + 0.5) * room.width / room.columns + dx,
                           (row + 0.5) * room.depth / room.rows + dy,
                           0};
    out.BeginObject(fmt::format("chair{}", i + 1));
    out.UseMaterial(
        materials[random.NextBelow(static_cast<uint32_t>(materials.size()))]);
    AddChair(out, Placement(origin, turn, fit.scale), build);
  }
}

void AddOpenRoom(ObjWriter& out, const Room& room) {
  const Rect back = {0, room.width, 0, room.height};
  const Rect side = {0, room.depth, 0, room.height};
  out.BeginObject("floor");
  out.UseMaterial(out.DefineMaterial({"floor", {0.5, 0.45, 0.4}, {}}));
  AddRect(out, {Axis::kZ, 0, true}, {0, room.width, 0, room.depth});
  const MaterialId wall = out.DefineMaterial({"wall", {0.7, 0.7, 0.65}, {}});
  out.UseMaterial(wall);
  out.BeginObject("wall_back");
  AddRect(out, {Axis::kY, room.depth, false}, back);
  out.BeginObject("wall_left");
  AddRect(out, {Axis::kX, 0, true}, side);
  out.BeginObject("wall_right");
  AddRect(out, {Axis::kX, room.width, false}, side);
}

// Adds lights on a grid over the room; their total area does not depend on
// their number.
void AddOverheadLights(ObjWriter& out, const Room& room, uint32_t count) {
  const uint32_t columns = CeilSqrt(count);
  const uint32_t rows = (count + columns - 1) / columns;
  const double side = kLightOverSide * std::min(room.width, room.depth) /
                      std::sqrt(static_cast<double>(count));
  out.UseMaterial(out.DefineMaterial(
      {"light", {}, {kLightExitance, kLightExitance, kLightExitance}}));
  for (uint32_t i = 0; i < count; ++i) {
    const double x = (i % columns + 0.5) * room.width / columns;
    const uint32_t row = i / columns;
    const double y = (row + 0.5) * room.depth / rows;
    out.BeginObject(fmt::format("light{}", i + 1));
    AddRect(out,
            {Axis::kZ, room.height, false},
            {x - side / 2, x + side / 2, y - side / 2, y + side / 2});
  }
}

void WriteRoomOfChairs(const ChairsOptions& options,
                       uint32_t lights,
                       ObjWriter& out) {
  const Room room = RoomFor(options);
  AddOpenRoom(out, room);
  AddOverheadLights(out, room, lights);
  const std::array<MaterialId, 4> fabrics = {
      out.DefineMaterial({"chair_oak", {0.55, 0.4, 0.25}, {}}),
      out.DefineMaterial({"chair_red", {0.6, 0.15, 0.1}, {}}),
      out.DefineMaterial({"chair_blue", {0.15, 0.25, 0.55}, {}}),
      out.DefineMaterial({"chair_green", {0.2, 0.45, 0.2}, {}})};
  AddChairs(
      out, room, options.count, options.seed, ChairBuild::kStanding, fabrics);
}

}  // namespace

void WriteChairs(const ChairsOptions& options, ObjWriter& out) {
  RequireChairCount(options.count, 1);
  WriteRoomOfChairs(options, 1, out);
}

void WriteLights(const LightsOptions& options, ObjWriter& out) {
  if (options.lights < 1 || options.lights > 10'000) {
    throw UsageError(
        fmt::format("--lights {}: must be from 1 to 10000", options.lights));
  }
  WriteRoomOfChairs(
      {12, ChairScaling::kBoth, options.seed}, options.lights, out);
}

void WriteFurnace(const FurnaceOptions& options, ObjWriter& out) {
  RequireChairCount(options.count, 0);
  const double rho = options.reflectance;
  const double e = options.emission;
  if (!(rho >= 0 && rho < 1)) {
    throw UsageError(
        fmt::format("--reflectance {}: must be at least 0 and below 1", rho));
  }
  if (!(e > 0 && std::isfinite(e))) {
    throw UsageError(fmt::format("--emission {}: must be above 0", e));
  }
  Room room = GrownRoom(std::max(options.count, 9U));
  room.height = kRoomHeight;
  const MaterialId white =
      out.DefineMaterial({"furnace", {rho, rho, rho}, {e, e, e}});
  out.BeginObject("room");
  out.UseMaterial(white);
  const Rect plan = {0, room.width, 0, room.depth};
  AddRect(out, {Axis::kZ, 0, true}, plan);
  AddRect(out, {Axis::kZ, room.height, false}, plan);
  AddLining(out, Axis::kZ, 0, room.height, plan);
  AddChairs(
      out, room, options.count, options.seed, ChairBuild::kClosed, {&white, 1});
}

}  // namespace enfilade
