#include "tools/scenes/furniture.h"

#include "base/photometry.h"

#include <cmath>
#include <optional>

#include "tools/scenes/floor_space.h"

namespace enfilade {

namespace {

constexpr double kDeskHeight = 0.74;

// Where a piece stands. The origin of the piece's frame is the middle of its
// plan, and the rear of the piece is at -y of that frame.
struct Place {
  double x = 0, y = 0;
  int quarter_turns = 0;  // counter-clockwise
};

class RoomFurnisher {
 public:
  RoomFurnisher(ObjWriter& out,
                const PlanSpace& room,
                double floor_z,
                const FurnitureMaterials& materials,
                Random random)
      : out_(out),
        room_(room),
        floor_z_(floor_z),
        materials_(materials),
        random_(random),
        space_(room, floor_z) {}

  void AddShelf() {
    const double width = Between(random_, 0.8, 1.3);
    const double depth = Between(random_, 0.28, 0.40);
    const std::optional<Place> place = FindPlace(width, depth, true);
    if (!place) {
      return;
    }
    Begin("shelf", PickFrom(materials_.woods));
    BuildShelf(At(*place), width, depth);
  }

  // A desk with a chair in front of it.
  void AddWorkplace() {
    const double width = Between(random_, 1.2, 1.8);
    const double desk_depth = Between(random_, 0.65, 0.85);
    const double depth = desk_depth + 0.75;
    const std::optional<Place> place =
        FindPlace(width, depth, random_.Next() < 0.5);
    if (!place) {
      return;
    }
    Begin("desk", PickFrom(materials_.woods));
    BuildDesk(At(*place), width, -depth / 2, -depth / 2 + desk_depth);
    Begin("chair", PickFrom(materials_.fabrics));
    const Point3 seat =
        At(*place).At({Between(random_, -0.2, 0.2), depth / 2 - 0.34, 0});
    AddChair(out_,
             Placement(seat, Turn(*place) + kPi + Between(random_, -0.4, 0.4)),
             ChairBuild::kStanding);
  }

  void AddLooseChair() {
    const double side = 2 * kChairRadius;
    const std::optional<Place> place = FindPlace(side, side, false);
    if (!place) {
      return;
    }
    Begin("chair", PickFrom(materials_.fabrics));
    AddChair(
        out_,
        Placement({place->x, place->y, floor_z_}, Between(random_, -kPi, kPi)),
        ChairBuild::kStanding);
  }

 private:
  MaterialId PickFrom(const std::vector<MaterialId>& materials) {
    return materials[random_.NextBelow(
        static_cast<uint32_t>(materials.size()))];
  }

  void Begin(const char* kind, MaterialId material) {
    out_.BeginObject(fmt::format("{}_{}{}", room_.name, kind, ++pieces_));
    out_.UseMaterial(material);
  }

  static double Turn(const Place& place) {
    return place.quarter_turns * kPi / 2;
  }

  [[nodiscard]] Placement At(const Place& place) const {
    return {{place.x, place.y, floor_z_}, Turn(place)};
  }

  // Tries random places and takes the first free one. If `at_wall`, the rear of
  // the piece stands at a wall. Returns nullopt if no place was free.
  std::optional<Place> FindPlace(double width, double depth, bool at_wall) {
    const Rect& free = space_.Free();
    for (int attempt = 0; attempt < kPlaceAttempts; ++attempt) {
      Place place;
      place.quarter_turns = static_cast<int>(random_.NextBelow(4));
      const bool sideways = place.quarter_turns % 2 != 0;
      const double half_x = (sideways ? depth : width) / 2;
      const double half_y = (sideways ? width : depth) / 2;
      place.x = Between(random_, free.u0 + half_x, free.u1 - half_x);
      place.y = Between(random_, free.v0 + half_y, free.v1 - half_y);
      if (at_wall) {
        MoveToWall(place, half_x, half_y);
      }
      if (space_.Take({place.x - half_x,
                       place.x + half_x,
                       place.y - half_y,
                       place.y + half_y})) {
        return place;
      }
    }
    return std::nullopt;
  }

  // After 0, 1, 2, 3 quarter turns the rear (-y) looks south, east, north and
  // west.
  void MoveToWall(Place& place, double half_x, double half_y) const {
    const Rect& free = space_.Free();
    switch (place.quarter_turns) {
      case 0:
        place.y = free.v0 + half_y;
        break;
      case 1:
        place.x = free.u1 - half_x;
        break;
      case 2:
        place.y = free.v1 - half_y;
        break;
      default:
        place.x = free.u0 + half_x;
        break;
    }
  }

  // Builds two sides, a back between them and boards. Faces that would lie on
  // another part are left out.
  void BuildShelf(const Placement& at, double width, double depth) {
    constexpr double kBoard = 0.02;
    const double height = Between(random_, 1.2, 2.2);
    const double x = width / 2;
    const double y = depth / 2;
    for (const double x0 : {-x, x - kBoard}) {
      AddBox(out_,
             at,
             {{x0, -y, 0}, {x0 + kBoard, y, height}},
             kSideFaces | kTopFace);
    }
    const double inner = x - kBoard;
    AddBox(out_,
           at,
           {{-inner, -y, 0}, {inner, -y + kBoard, height}},
           kSouthFace | kNorthFace | kTopFace);
    const uint32_t boards = 3 + random_.NextBelow(4);
    for (uint32_t i = 0; i < boards; ++i) {
      const double z = 0.06 + i * (height - 0.12) / boards;
      AddBox(out_,
             at,
             {{-inner, -y + kBoard, z}, {inner, y, z + kBoard}},
             kNorthFace | kTopFace | kBottomFace);
    }
  }

  // Builds a board on four legs, or on two panels with a screen between them.
  void BuildDesk(const Placement& at, double width, double y0, double y1) {
    constexpr double kBoard = 0.03;
    const double x = width / 2;
    const double under = kDeskHeight - kBoard;
    AddBox(out_, at, {{-x, y0, under}, {x, y1, kDeskHeight}});
    constexpr double kInset = 0.03;
    if (random_.Next() < 0.5) {
      constexpr double kLeg = 0.06;
      for (const double lx : {-x + kInset, x - kInset - kLeg}) {
        for (const double ly : {y0 + kInset, y1 - kInset - kLeg}) {
          AddBox(out_,
                 at,
                 {{lx, ly, 0}, {lx + kLeg, ly + kLeg, under}},
                 kSideFaces);
        }
      }
      return;
    }
    for (const double lx : {-x + kInset, x - kInset - kBoard}) {
      AddBox(out_,
             at,
             {{lx, y0 + kInset, 0}, {lx + kBoard, y1 - kInset, under}},
             kSideFaces);
    }
    const double inner = x - kInset - kBoard;
    AddBox(out_,
           at,
           {{-inner, y0 + 0.1, 0.3}, {inner, y0 + 0.1 + kBoard, under}},
           kSouthFace | kNorthFace | kBottomFace);
  }

  ObjWriter& out_;
  const PlanSpace& room_;
  double floor_z_;
  const FurnitureMaterials& materials_;
  Random random_;
  FloorSpace space_;
  int pieces_ = 0;
};

int CountOf(double mean, Random& random) {
  return static_cast<int>(std::floor(mean + random.Next()));
}

}  // namespace

void Furnish(ObjWriter& out,
             const PlanSpace& room,
             double floor_z,
             double density,
             const FurnitureMaterials& materials,
             Random random) {
  const bool hall = room.use == SpaceUse::kHall;
  if (density <= 0 || (!hall && room.use != SpaceUse::kOffice)) {
    return;
  }
  const Rect box = room.Box();
  const double area = density * box.Width() * box.Height();
  const int shelves = CountOf(area / (hall ? 20 : 8), random);
  const int workplaces = CountOf(area / (hall ? 15 : 6), random);
  const int chairs = CountOf(area / (hall ? 8 : 20), random);
  RoomFurnisher furnisher(out, room, floor_z, materials, random);
  for (int i = 0; i < workplaces; ++i) {
    furnisher.AddWorkplace();
  }
  for (int i = 0; i < shelves; ++i) {
    furnisher.AddShelf();
  }
  for (int i = 0; i < chairs; ++i) {
    furnisher.AddLooseChair();
  }
}

}  // namespace enfilade
