#include "tools/scenes/floorplan.h"

#include "base/error.h"
#include "base/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tools/scenes/furniture.h"
#include "tools/scenes/layout.h"
#include "tools/scenes/piece_furnisher.h"
#include "tools/scenes/shapes.h"

namespace enfilade {

namespace {

constexpr double kLampSide = 0.6;
constexpr double kTreadThickness = 0.05;
// A storey with more rooms would be about a mile long, which is no plausible
// building.
constexpr uint32_t kMostRoomsPerStorey = 1000;
constexpr uint32_t kMostStoreys = 200;
constexpr uint64_t kLooks = 0x6c6f6f6b73;  // random key of colours and lamps

struct Palette {
  std::vector<MaterialId> walls, floors, ceilings, lamps;
  FurnitureMaterials furniture;
  MaterialId facade, stone;
};

std::vector<MaterialId> Define(ObjWriter& out,
                               const std::string& kind,
                               const std::vector<Rgb>& reflectances) {
  std::vector<MaterialId> ids;
  ids.reserve(reflectances.size());
  for (const Rgb& reflectance : reflectances) {
    ids.push_back(out.DefineMaterial(
        {fmt::format("{}{}", kind, ids.size() + 1), reflectance, {}}));
  }
  return ids;
}

Palette DefinePalette(ObjWriter& out) {
  Palette p;
  p.walls = Define(out,
                   "wall",
                   {{0.82, 0.81, 0.78},
                    {0.75, 0.72, 0.62},
                    {0.62, 0.72, 0.75},
                    {0.72, 0.60, 0.52},
                    {0.60, 0.70, 0.55},
                    {0.78, 0.74, 0.50},
                    {0.55, 0.55, 0.60},
                    {0.70, 0.50, 0.45}});
  p.floors = Define(out,
                    "floor",
                    {{0.40, 0.30, 0.20},
                     {0.30, 0.30, 0.32},
                     {0.25, 0.20, 0.18},
                     {0.50, 0.48, 0.45},
                     {0.20, 0.25, 0.32},
                     {0.45, 0.38, 0.25}});
  p.ceilings = Define(out, "ceiling", {{0.85, 0.85, 0.84}, {0.80, 0.79, 0.75}});
  p.furniture.woods = Define(out,
                             "wood",
                             {{0.55, 0.40, 0.25},
                              {0.35, 0.22, 0.12},
                              {0.70, 0.60, 0.45},
                              {0.75, 0.75, 0.73},
                              {0.30, 0.30, 0.30}});
  p.furniture.fabrics = Define(out,
                               "fabric",
                               {{0.10, 0.10, 0.12},
                                {0.50, 0.12, 0.10},
                                {0.12, 0.20, 0.45},
                                {0.15, 0.35, 0.18},
                                {0.60, 0.42, 0.10}});
  p.facade = out.DefineMaterial({"facade", {0.45, 0.40, 0.36}, {}});
  p.stone = out.DefineMaterial({"stone", {0.55, 0.54, 0.52}, {}});
  const std::array<Rgb, 4> exitances = {
      {{45, 40, 33}, {42, 41, 38}, {38, 40, 43}, {36, 36, 34}}};
  for (const Rgb& exitance : exitances) {
    p.lamps.push_back(
        out.DefineMaterial({fmt::format("lamp{}", p.lamps.size() + 1),
                            {0.5, 0.5, 0.5},
                            exitance}));
  }
  return p;
}

// Writes the geometry of planned wings.
class Builder {
 public:
  Builder(const FloorplanOptions& options,
          std::vector<Piece> pieces,
          ObjWriter& out)
      : options_(options),
        pieces_(std::move(pieces)),
        out_(out),
        palette_(DefinePalette(out)) {}

  void Build() {
    ForEachWing(options_, [this](uint32_t storey, const WingPlan& plan) {
      storey_ = storey;
      floor_z_ = RoundToMillimetre(storey_ * kStoreyHeight);
      ceiling_z_ = RoundToMillimetre(floor_z_ + kClearHeight);
      BuildWing(plan);
    });
  }

 private:
  void BuildWing(const WingPlan& plan) {
    for (const PlanSpace& space : plan.spaces) {
      Random random(MixKey(MixKey(options_.seed, kLooks), ++spaces_));
      BuildShell(space, random);
      BuildOutside(space);
      if (space.use == SpaceUse::kStairs && storey_ + 1 < options_.storeys) {
        BuildStairs(space);
      }
      FurnishSpace(space, Random(random.NextBits()));
    }
    for (const PlanDoorway& door : plan.doorways) {
      out_.BeginObject(
          fmt::format("storey{}_doorway{}", storey_ + 1, ++doors_));
      out_.UseMaterial(palette_.stone);
      AddLining(out_, door.axis, door.from, door.to, door.opening);
    }
  }

  void FurnishSpace(const PlanSpace& space, Random random) {
    if (pieces_.empty()) {
      Furnish(out_,
              space,
              floor_z_,
              options_.furniture,
              palette_.furniture,
              random);
    } else {
      FurnishWithPieces(
          out_, space, floor_z_, pieces_, options_.pieces_per_room, random);
    }
  }

  MaterialId PickFrom(const std::vector<MaterialId>& materials,
                      Random& random) const {
    return materials[random.NextBelow(static_cast<uint32_t>(materials.size()))];
  }

  // The plane of one wall of `rect`. Its front looks into `rect` if `inwards`,
  // otherwise out of it.
  static AxisPlane WallPlane(Side side, const Rect& rect, bool inwards) {
    switch (side) {
      case Side::kWest:
        return {Axis::kX, rect.u0, inwards};
      case Side::kEast:
        return {Axis::kX, rect.u1, !inwards};
      case Side::kSouth:
        return {Axis::kY, rect.v0, inwards};
      case Side::kNorth:
        break;
    }
    return {Axis::kY, rect.v1, !inwards};
  }

  // Floor, walls and ceiling with its lamps, seen from inside.
  void BuildShell(const PlanSpace& space, Random& random) {
    const Rect box = space.Box();
    out_.BeginObject(space.name + "_floor");
    out_.UseMaterial(PickFrom(palette_.floors, random));
    const AxisPlane floor = {Axis::kZ, floor_z_, true};
    if (space.floor_hole) {
      AddPanel(out_, floor, box, {*space.floor_hole});
    } else {
      AddRect(out_, floor, box);
    }
    out_.BeginObject(space.name + "_walls");
    const MaterialId paint = PickFrom(palette_.walls, random);
    const MaterialId accent = PickFrom(palette_.walls, random);
    for (const Side side : kSides) {
      out_.UseMaterial(side == Side::kEast ? accent : paint);
      const bool along_y = side == Side::kWest || side == Side::kEast;
      const Rect wall = {along_y ? box.v0 : box.u0,
                         along_y ? box.v1 : box.u1,
                         floor_z_,
                         ceiling_z_};
      AddPanel(out_, WallPlane(side, box, true), wall, space.Wall(side).holes);
    }
    BuildCeiling(space, box, random);
  }

  void BuildCeiling(const PlanSpace& space, Rect box, Random& random) {
    const AxisPlane ceiling = {Axis::kZ, ceiling_z_, false};
    out_.BeginObject(space.name + "_ceiling");
    const MaterialId paint = PickFrom(palette_.ceilings, random);
    out_.UseMaterial(paint);
    if (space.ceiling_hole) {
      const double cut = RoundToMillimetre(space.ceiling_hole->u1 + 0.1);
      AddPanel(
          out_, ceiling, {box.u0, cut, box.v0, box.v1}, {*space.ceiling_hole});
      AddLining(out_,
                Axis::kZ,
                ceiling_z_,
                RoundToMillimetre(ceiling_z_ + kSlab),
                *space.ceiling_hole);
      box.u0 = cut;
    }
    const std::vector<std::vector<Rect>> rows = LampRows(space, box, random);
    double v = box.v0;
    for (size_t i = 0; i < rows.size(); ++i) {
      const double next =
          i + 1 == rows.size()
              ? box.v1
              : RoundToMillimetre((rows[i][0].v1 + rows[i + 1][0].v0) / 2);
      AddPanel(out_, ceiling, {box.u0, box.u1, v, next}, rows[i]);
      v = next;
    }
    out_.BeginObject(space.name + "_lamps");
    out_.UseMaterial(PickFrom(palette_.lamps, random));
    for (const std::vector<Rect>& row : rows) {
      for (const Rect& lamp : row) {
        AddRect(out_, ceiling, lamp);
      }
    }
  }

  // The rows of luminaire panels that are set into the ceiling on a grid: about
  // one panel per 5 m2 of an office and per 8 m2 of any other space.
  static std::vector<std::vector<Rect>> LampRows(const PlanSpace& space,
                                                 const Rect& box,
                                                 Random& random) {
    const double per_lamp = (space.use == SpaceUse::kOffice ? 5.0 : 8.0) *
                            (0.8 + 0.4 * random.Next());
    const double pitch = std::sqrt(per_lamp);
    const auto along = [pitch](double length) {
      const auto fits = static_cast<int>(length / (kLampSide + 0.2));
      return std::clamp(static_cast<int>(std::round(length / pitch)), 1, fits);
    };
    const int columns = along(box.Width());
    const int rows = along(box.Height());
    std::vector<std::vector<Rect>> lamps(static_cast<size_t>(rows));
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        const double u0 = RoundToMillimetre(
            box.u0 + (c + 0.5) * box.Width() / columns - kLampSide / 2);
        const double v0 = RoundToMillimetre(
            box.v0 + (r + 0.5) * box.Height() / rows - kLampSide / 2);
        lamps[static_cast<size_t>(r)].push_back(
            {u0,
             RoundToMillimetre(u0 + kLampSide),
             v0,
             RoundToMillimetre(v0 + kLampSide)});
      }
    }
    return lamps;
  }

  // Builds the space's part of the facade with the reveals of its windows, and
  // of the roof and the building's underside.
  void BuildOutside(const PlanSpace& space) {
    const bool top = storey_ + 1 == options_.storeys;
    const double z0 = RoundToMillimetre(floor_z_ - kSlab);
    const double z1 = RoundToMillimetre(ceiling_z_ + (top ? kSlab : 0));
    out_.BeginObject(space.name + "_outside");
    out_.UseMaterial(palette_.facade);
    for (const Side side : kSides) {
      const PlanWall& wall = space.Wall(side);
      const AxisPlane outer = WallPlane(side, space.tile, false);
      const AxisPlane inner = WallPlane(side, space.Box(), true);
      for (const Span1 part : wall.facade) {
        std::vector<Rect> windows;
        std::copy_if(wall.windows.begin(),
                     wall.windows.end(),
                     std::back_inserter(windows),
                     [&](const Rect& w) {
                       return w.u0 >= part.low && w.u1 <= part.high;
                     });
        AddPanel(out_, outer, {part.low, part.high, z0, z1}, windows);
      }
      for (const Rect& window : wall.windows) {
        AddLining(out_,
                  outer.axis,
                  std::min(outer.at, inner.at),
                  std::max(outer.at, inner.at),
                  window);
      }
    }
    if (top) {
      AddRect(out_, {Axis::kZ, z1, true}, space.tile);
    }
    if (storey_ == 0) {
      AddRect(out_, {Axis::kZ, z0, false}, space.tile);
    }
  }

  // Builds separate treads without risers; the last tread is one step below the
  // upper floor.
  void BuildStairs(const PlanSpace& space) {
    const StairRun run = RunOfStairs(space.Box());
    out_.BeginObject(space.name + "_flight");
    out_.UseMaterial(palette_.stone);
    const double rise = kStoreyHeight / kStairRisers;
    for (uint32_t i = 0; i + 1 < kStairRisers; ++i) {
      const double y = run.start_y + i * kStairGoing;
      const double z = floor_z_ + (i + 1) * rise;
      AddBox(out_,
             Placement({0, 0, 0}, 0),
             {{run.x0, y, z - kTreadThickness},
              {run.x1, y + kStairGoing - 0.01, z}});
    }
  }

  const FloorplanOptions& options_;
  std::vector<Piece> pieces_;  // empty: desks, chairs and shelves instead
  ObjWriter& out_;
  Palette palette_;
  uint32_t storey_ = 0;
  double floor_z_ = 0;
  double ceiling_z_ = 0;
  uint64_t spaces_ = 0;
  uint64_t doors_ = 0;
};

void Validate(const FloorplanOptions& options) {
  if (options.storeys < 1 || options.storeys > kMostStoreys) {
    throw UsageError(fmt::format(
        "--storeys {}: must be from 1 to {}", options.storeys, kMostStoreys));
  }
  if (options.rooms < options.storeys || options.rooms > 10'000'000) {
    throw UsageError(
        fmt::format("--rooms {}: must be at least one per storey ({}) and at "
                    "most 10000000",
                    options.rooms,
                    options.storeys));
  }
  if (!(options.furniture >= 0 && options.furniture <= 1)) {
    throw UsageError(
        fmt::format("--furniture {}: must be from 0 to 1", options.furniture));
  }
  if (options.pieces_per_room > 1000) {
    throw UsageError(fmt::format("--pieces-per-room {}: must be at most 1000",
                                 options.pieces_per_room));
  }
}

}  // namespace

uint32_t UsualStoreys(uint32_t rooms) {
  const uint32_t storeys =
      rooms / kMostRoomsPerStorey + (rooms % kMostRoomsPerStorey > 0 ? 1 : 0);
  return std::clamp(storeys, 1U, kMostStoreys);
}

void WriteFloorplan(const FloorplanOptions& options, ObjWriter& out) {
  Validate(options);
  std::vector<Piece> pieces;
  if (!options.pieces.folder.empty()) {
    pieces = FittingPieces(
        options, CopyPieces(options.pieces, out.Path(), options.note));
  }
  Builder(options, std::move(pieces), out).Build();
}

}  // namespace enfilade
