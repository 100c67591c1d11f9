#include "tools/scenes/layout.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

namespace {

constexpr uint32_t kRoomsPerWing = 16;
constexpr double kRoomTile =
    4.2;  // mean length of an office along its corridor
constexpr double kDoorHeight = 2.1;
constexpr double kPassageHeight = 2.5;
constexpr double kStairWidth = 2.6;
constexpr double kStairLength = 7.4;
constexpr double kSill = 0.9;
constexpr double kWindowHead = 2.3;

enum class Purpose : uint64_t { kOutline = 1, kWing = 2, kSpine = 3 };

Random RandomFor(const FloorplanOptions& options,
                 Purpose purpose,
                 uint64_t a,
                 uint64_t b = 0) {
  const uint64_t key = MixKey(options.seed, static_cast<uint64_t>(purpose));
  return Random(MixKey(MixKey(key, a), b));
}

double FloorZ(uint32_t storey) {
  return RoundToMillimetre(storey * kStoreyHeight);
}

// The items in one part when `count` items are distributed over `parts` parts
// as evenly as possible; the first parts get the remainder.
uint32_t Share(uint32_t count, uint32_t parts, uint32_t part) {
  return count / parts + (part < count % parts ? 1 : 0);
}

// Builds the plan of one wing, space by space.
class WingPlanner {
 public:
  WingPlanner(const FloorplanOptions& options,
              uint32_t storey,
              const WingOutline& outline)
      : options_(options),
        outline_(outline),
        storey_(storey),
        floor_z_(FloorZ(storey)),
        random_(RandomFor(options, Purpose::kWing, storey, outline.wing)) {}

  WingPlan Plan() {
    const size_t spine = AddSpine();
    AddWing(spine);
    for (PlanSpace& space : plan_.spaces) {
      AddWindows(space);
    }
    return std::move(plan_);
  }

 private:
  size_t Add(SpaceUse use, const char* kind, const Rect& tile) {
    PlanSpace space;
    space.name = fmt::format("storey{}_wing{}_{}{}",
                             storey_ + 1,
                             outline_.wing + 1,
                             kind,
                             plan_.spaces.size() + 1);
    space.use = use;
    space.tile = tile;
    plan_.spaces.push_back(std::move(space));
    return plan_.spaces.size() - 1;
  }

  size_t AddRoom(SpaceUse use, const Rect& tile) {
    ++plan_.rooms;
    return Add(use, use == SpaceUse::kHall ? "hall" : "office", tile);
  }

  void MakeOuter(size_t space, Side side) {
    PlanSpace& s = plan_.spaces[space];
    const bool along_y = side == Side::kWest || side == Side::kEast;
    s.Wall(side).facade.push_back(along_y ? Span1{s.tile.v0, s.tile.v1}
                                          : Span1{s.tile.u0, s.tile.u1});
  }

  // Adds a doorway between `a` and the space `b` east (kX) or north (kY) of it:
  // a hole in the wall, `size.x` wide, `size.z` high and centred at `center`.
  void Connect(size_t a, size_t b, Axis axis, double center, Vec3 size) {
    PlanSpace& first = plan_.spaces[a];
    PlanSpace& second = plan_.spaces[b];
    const Rect opening = {RoundToMillimetre(center - size.x / 2),
                          RoundToMillimetre(center + size.x / 2),
                          floor_z_,
                          RoundToMillimetre(floor_z_ + size.z)};
    const bool x = axis == Axis::kX;
    first.Wall(x ? Side::kEast : Side::kNorth).holes.push_back(opening);
    second.Wall(x ? Side::kWest : Side::kSouth).holes.push_back(opening);
    plan_.doorways.push_back({axis,
                              x ? first.Box().u1 : first.Box().v1,
                              x ? second.Box().u0 : second.Box().v0,
                              opening});
  }

  // Adds the segment of the spine along this wing, its stairs, and the link to
  // the next wing's segment.
  size_t AddSpine() {
    const WingOutline& o = outline_;
    const size_t spine =
        Add(SpaceUse::kCorridor, "spine", {o.spine_x0, o.spine_x1, o.y0, o.y1});
    if (o.wing == 0) {
      MakeOuter(spine, Side::kSouth);
    } else {
      plan_.spaces[spine].Wall(Side::kSouth).holes.push_back(SpinePassage());
    }
    if (o.has_stairs) {
      AddStairs(spine);
    } else {
      MakeOuter(spine, Side::kWest);
    }
    if (o.wing + 1 == o.wings) {
      MakeOuter(spine, Side::kNorth);
    } else {
      AddLink(spine);
    }
    return spine;
  }

  void AddStairs(size_t spine) {
    const WingOutline& o = outline_;
    const double y0 = RoundToMillimetre((o.y0 + o.y1 - kStairLength) / 2);
    const double y1 = RoundToMillimetre(y0 + kStairLength);
    const double x0 = RoundToMillimetre(o.spine_x0 - kStairWidth);
    const size_t stairs =
        Add(SpaceUse::kStairs, "stairs", {x0, o.spine_x0, y0, y1});
    for (const Side side : {Side::kWest, Side::kSouth, Side::kNorth}) {
      MakeOuter(stairs, side);
    }
    plan_.spaces[spine].Wall(Side::kWest).facade = {{o.y0, y0}, {y1, o.y1}};
    const StairRun run = RunOfStairs(plan_.spaces[stairs].Box());
    if (storey_ > 0) {
      plan_.spaces[stairs].floor_hole = run.opening;
    }
    if (storey_ + 1 < options_.storeys) {
      plan_.spaces[stairs].ceiling_hole = run.opening;
    }
    Connect(stairs, spine, Axis::kX, y0 + 1.0, {1.0, 0, kDoorHeight});
  }

  // Adds the corridor past the courtyard to the next wing. The doorway at its
  // far end leads into the next wing's spine, which has the same hole in its
  // south wall.
  void AddLink(size_t spine) {
    const WingOutline& o = outline_;
    const size_t link = Add(
        SpaceUse::kCorridor, "link", {o.spine_x0, o.spine_x1, o.y1, o.link_y1});
    MakeOuter(link, Side::kWest);
    MakeOuter(link, Side::kEast);
    const Rect passage = SpinePassage();
    Connect(spine,
            link,
            Axis::kY,
            (passage.u0 + passage.u1) / 2,
            {passage.Width(), 0, kPassageHeight});
    plan_.spaces[link].Wall(Side::kNorth).holes.push_back(passage);
    plan_.doorways.push_back({Axis::kY,
                              plan_.spaces[link].Box().v1,
                              RoundToMillimetre(o.link_y1 + kInnerWall / 2),
                              passage});
  }

  // The hole that joins segments of the spine.
  [[nodiscard]] Rect SpinePassage() const {
    const double margin = kOuterWall + 0.15;
    return {RoundToMillimetre(outline_.spine_x0 + margin),
            RoundToMillimetre(outline_.spine_x1 - margin),
            floor_z_,
            RoundToMillimetre(floor_z_ + kPassageHeight)};
  }

  void AddWing(size_t spine) {
    const WingOutline& o = outline_;
    const uint32_t rooms = RoomsInWing(options_, storey_, o.wing);
    const double middle = (o.corridor_y0 + o.corridor_y1) / 2;
    if (rooms == 1) {
      const size_t hall =
          AddRoom(SpaceUse::kHall, {o.spine_x1, o.end_x, o.y0, o.y1});
      MakeEndOuter(hall);
      Connect(spine, hall, Axis::kX, middle, {1.6, 0, kDoorHeight});
      return;
    }
    const bool hall =
        o.may_have_hall && rooms >= 3 && (storey_ == 0 || random_.Next() < 0.7);
    const double rooms_x1 =
        hall ? RoundToMillimetre(o.end_x - o.hall_length) : o.end_x;
    const size_t corridor =
        Add(SpaceUse::kCorridor,
            "corridor",
            {o.spine_x1, rooms_x1, o.corridor_y0, o.corridor_y1});
    Connect(spine, corridor, Axis::kX, middle, {1.4, 0, kPassageHeight});
    const uint32_t offices = rooms - (hall ? 1 : 0);
    AddRow(corridor, Side::kSouth, (offices + 1) / 2, hall);
    AddRow(corridor, Side::kNorth, offices / 2, hall);
    if (hall) {
      const size_t end =
          AddRoom(SpaceUse::kHall, {rooms_x1, o.end_x, o.y0, o.y1});
      MakeEndOuter(end);
      Connect(corridor, end, Axis::kX, middle, {1.4, 0, kDoorHeight});
    } else {
      MakeOuter(corridor, Side::kEast);
    }
  }

  void MakeEndOuter(size_t space) {
    for (const Side side : {Side::kEast, Side::kSouth, Side::kNorth}) {
      MakeOuter(space, side);
    }
  }

  // Adds a row of offices on one side of the corridor. A door joins two
  // neighbours with probability 0.2.
  void AddRow(size_t corridor, Side side, uint32_t count, bool hall) {
    const bool south = side == Side::kSouth;
    const Rect way = plan_.spaces[corridor].tile;
    const double v0 = south ? outline_.y0 : outline_.corridor_y1;
    const double v1 = south ? outline_.corridor_y0 : outline_.y1;
    const std::vector<double> cuts = Cuts(way.u0, way.u1, count);
    for (uint32_t i = 0; i < count; ++i) {
      const size_t room =
          AddRoom(SpaceUse::kOffice, {cuts[i], cuts[i + 1], v0, v1});
      MakeOuter(room, side);
      const double margin = 1.0;
      const double door =
          Between(random_, cuts[i] + margin, cuts[i + 1] - margin);
      const Vec3 size = {0.9, 0, kDoorHeight};
      if (south) {
        Connect(room, corridor, Axis::kY, door, size);
      } else {
        Connect(corridor, room, Axis::kY, door, size);
      }
      if (i > 0 && random_.Next() < 0.2) {
        Connect(room - 1, room, Axis::kX, (v0 + v1) / 2, size);
      }
      if (i + 1 == count && !hall) {
        MakeOuter(room, Side::kEast);
      }
    }
  }

  // The count + 1 ends of `count` unequal intervals that make up [low, high].
  std::vector<double> Cuts(double low, double high, uint32_t count) {
    std::vector<double> cuts = {low};
    double sum = 0;
    for (uint32_t i = 0; i < count; ++i) {
      sum += 0.75 + 0.5 * random_.Next();
      cuts.push_back(sum);
    }
    for (uint32_t i = 1; i <= count; ++i) {
      cuts[i] = RoundToMillimetre(low + (high - low) * cuts[i] / sum);
    }
    cuts[count] = high;
    return cuts;
  }

  void AddWindows(PlanSpace& space) {
    for (const Side side : kSides) {
      PlanWall& wall = space.Wall(side);
      for (const Span1 part : wall.facade) {
        AddWindows(wall, part);
      }
    }
  }

  // Divides the part of the wall into equal bays with a window in each.
  void AddWindows(PlanWall& wall, Span1 part) {
    const double low = part.low + 0.5;
    const double length = part.high - part.low - 1.0;
    const auto count =
        static_cast<uint32_t>(length / Between(random_, 1.8, 2.4));
    if (length < 1.2) {
      return;
    }
    const uint32_t bays = std::max(1U, count);
    const double bay = length / bays;
    const double width = std::min(Between(random_, 0.9, 1.6), 0.75 * bay);
    for (uint32_t i = 0; i < bays; ++i) {
      const double center = low + (i + 0.5) * bay;
      wall.windows.push_back({RoundToMillimetre(center - width / 2),
                              RoundToMillimetre(center + width / 2),
                              RoundToMillimetre(floor_z_ + kSill),
                              RoundToMillimetre(floor_z_ + kWindowHead)});
      wall.holes.push_back(wall.windows.back());
    }
  }

  const FloorplanOptions& options_;
  const WingOutline& outline_;
  uint32_t storey_;
  double floor_z_;
  Random random_;
  WingPlan plan_;
};

}  // namespace

double RoundToMillimetre(double value) {
  return std::round(value * 1000) / 1000;
}

double Between(Random& random, double low, double high) {
  return RoundToMillimetre(low + (high - low) * random.Next());
}

Rect PlanSpace::Box() const {
  const auto inset = [this](Side side) {
    return Wall(side).facade.empty() ? kInnerWall / 2 : kOuterWall;
  };
  return {RoundToMillimetre(tile.u0 + inset(Side::kWest)),
          RoundToMillimetre(tile.u1 - inset(Side::kEast)),
          RoundToMillimetre(tile.v0 + inset(Side::kSouth)),
          RoundToMillimetre(tile.v1 - inset(Side::kNorth))};
}

uint32_t WingCount(const FloorplanOptions& options) {
  const uint32_t fullest = Share(options.rooms, options.storeys, 0);
  return (fullest + kRoomsPerWing - 1) / kRoomsPerWing;
}

uint32_t RoomsInWing(const FloorplanOptions& options,
                     uint32_t storey,
                     uint32_t wing) {
  return Share(
      Share(options.rooms, options.storeys, storey), WingCount(options), wing);
}

WingOutline OutlineOfWing(const FloorplanOptions& options,
                          uint32_t wing,
                          double y0) {
  Random random = RandomFor(options, Purpose::kOutline, wing);
  Random spine = RandomFor(options, Purpose::kSpine, 0);
  const uint32_t rooms = RoomsInWing(options, 0, wing);
  WingOutline o;
  o.wing = wing;
  o.wings = WingCount(options);
  o.has_stairs = options.storeys > 1 && wing % 2 == 0;
  o.may_have_hall = rooms >= 5 && (wing == 0 || random.Next() < 0.6);
  o.hall_length = o.may_have_hall ? Between(random, 7, 10) : 0;
  const uint32_t offices = rooms - (o.may_have_hall ? 1 : 0);
  const double offices_length = std::max(1U, (offices + 1) / 2) * kRoomTile;
  o.spine_x1 = Between(spine, 2.7, 3.3);
  o.end_x = RoundToMillimetre(o.spine_x1 + offices_length + o.hall_length +
                              Between(random, -0.3, 0.5));
  o.y0 = y0;
  o.corridor_y0 = RoundToMillimetre(y0 + Between(random, 4.4, 6.0));
  o.corridor_y1 = RoundToMillimetre(o.corridor_y0 + Between(random, 2.1, 2.7));
  o.y1 = RoundToMillimetre(o.corridor_y1 + Between(random, 4.4, 6.0));
  o.link_y1 = wing + 1 == o.wings
                  ? o.y1
                  : RoundToMillimetre(o.y1 + Between(random, 7, 10));
  return o;
}

WingPlan PlanWing(const FloorplanOptions& options,
                  uint32_t storey,
                  const WingOutline& outline) {
  return WingPlanner(options, storey, outline).Plan();
}

void ForEachWing(
    const FloorplanOptions& options,
    const std::function<void(uint32_t storey, const WingPlan&)>& visit) {
  for (uint32_t storey = 0; storey < options.storeys; ++storey) {
    double y = 0;
    for (uint32_t wing = 0; wing < WingCount(options); ++wing) {
      const WingOutline outline = OutlineOfWing(options, wing, y);
      visit(storey, PlanWing(options, storey, outline));
      y = outline.link_y1;
    }
  }
}

StairRun RunOfStairs(const Rect& box) {
  StairRun run;
  run.x0 = RoundToMillimetre(box.u0 + 0.02);
  run.x1 = RoundToMillimetre(box.u0 + 1.0);
  run.start_y = RoundToMillimetre(box.v0 + 0.9);
  const double going = (kStairRisers - 1) * kStairGoing;
  run.opening = {RoundToMillimetre(box.u0 + 0.01),
                 RoundToMillimetre(box.u0 + 1.05),
                 RoundToMillimetre(run.start_y + 1.0),
                 RoundToMillimetre(run.start_y + going)};
  return run;
}

}  // namespace enfilade
