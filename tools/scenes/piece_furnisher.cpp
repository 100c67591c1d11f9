#include "tools/scenes/piece_furnisher.h"

#include "base/error.h"
#include "base/photometry.h"

#include <cmath>
#include <optional>
#include <utility>

#include "tools/scenes/floor_space.h"

namespace enfilade {

namespace {

constexpr uint32_t kDrawsPerPiece = 4;  // limit; then the room counts as full
constexpr double kUnderCeiling = 0.05;
constexpr double kAtWallShare = 0.6;
constexpr double kRoundingGap = 0.001;  // allows for rounding to millimetres

// Half the extents of the bounding rectangle of a turned piece, metres.
struct HalfPlan {
  double x = 0, y = 0;
};

HalfPlan HalfPlanOf(const Piece& piece, uint32_t degrees) {
  const double angle = degrees * kPi / 180;
  const double c = std::abs(std::cos(angle));
  const double s = std::abs(std::sin(angle));
  return {(c * piece.width + s * piece.depth) / 2,
          (s * piece.width + c * piece.depth) / 2};
}

struct PiecePlace {
  double x = 0, y = 0;
  uint32_t degrees = 0;  // counter-clockwise
};

class PiecePlacer {
 public:
  PiecePlacer(const PlanSpace& room, double floor_z, Random& random)
      : random_(random), space_(room, floor_z) {}

  std::optional<PiecePlace> Place(const Piece& piece) {
    const bool at_wall = random_.Next() < kAtWallShare;
    for (int attempt = 0; attempt < kPlaceAttempts; ++attempt) {
      PiecePlace place;
      place.degrees =
          at_wall ? 90 * random_.NextBelow(4) : random_.NextBelow(360);
      const HalfPlan half = HalfPlanOf(piece, place.degrees);
      const Rect& free = space_.Free();
      place.x = Between(random_, free.u0 + half.x, free.u1 - half.x);
      place.y = Between(random_, free.v0 + half.y, free.v1 - half.y);
      if (at_wall) {
        MoveToWall(place, half);
      }
      if (space_.Take({place.x - half.x,
                       place.x + half.x,
                       place.y - half.y,
                       place.y + half.y})) {
        return place;
      }
    }
    return std::nullopt;
  }

 private:
  // After 0, 1, 2, 3 quarter turns the rear (-y) looks south, east, north and
  // west.
  void MoveToWall(PiecePlace& place, HalfPlan half) const {
    const Rect& free = space_.Free();
    switch (place.degrees / 90) {
      case 0:
        place.y = RoundToMillimetre(free.v0 + half.y + kRoundingGap);
        break;
      case 1:
        place.x = RoundToMillimetre(free.u1 - half.x - kRoundingGap);
        break;
      case 2:
        place.y = RoundToMillimetre(free.v1 - half.y - kRoundingGap);
        break;
      default:
        place.x = RoundToMillimetre(free.u0 + half.x + kRoundingGap);
        break;
    }
  }

  Random& random_;
  FloorSpace space_;
};

// Whether the piece fits into the empty room with or without a quarter turn.
bool Fits(const Piece& piece, const PlanSpace& room) {
  const Rect free = FloorSpace(room, 0).Free();
  const double w = piece.width + 2 * kRoundingGap;
  const double d = piece.depth + 2 * kRoundingGap;
  return piece.height <= kClearHeight - kUnderCeiling &&
         ((w <= free.Width() && d <= free.Height()) ||
          (d <= free.Width() && w <= free.Height()));
}

}  // namespace

std::vector<Piece> FittingPieces(const FloorplanOptions& options,
                                 std::vector<Piece> pieces) {
  std::vector<bool> fits(pieces.size(), false);
  ForEachWing(options, [&](uint32_t, const WingPlan& plan) {
    for (const PlanSpace& space : plan.spaces) {
      if (space.use != SpaceUse::kOffice && space.use != SpaceUse::kHall) {
        continue;
      }
      for (size_t i = 0; i < pieces.size(); ++i) {
        fits[i] = fits[i] || Fits(pieces[i], space);
      }
    }
  });
  std::vector<Piece> fitting;
  for (size_t i = 0; i < pieces.size(); ++i) {
    if (fits[i]) {
      fitting.push_back(std::move(pieces[i]));
    } else if (options.note) {
      options.note(fmt::format(
          "{} ({:.2f} x {:.2f} x {:.2f} m) is larger than any room and was "
          "left out",
          pieces[i].name,
          pieces[i].width,
          pieces[i].depth,
          pieces[i].height));
    }
  }
  if (fitting.empty()) {
    throw InputError(fmt::format(
        "{}: every piece is larger than any room; is their unit {}? see "
        "--piece-unit",
        options.pieces.folder.string(),
        options.pieces.metres_per_unit > 0 ? "right"
                                           : "metres or centimetres"));
  }
  return fitting;
}

void FurnishWithPieces(ObjWriter& out,
                       const PlanSpace& room,
                       double floor_z,
                       const std::vector<Piece>& pieces,
                       uint32_t count,
                       Random random) {
  if (room.use != SpaceUse::kHall && room.use != SpaceUse::kOffice) {
    return;
  }
  PiecePlacer placer(room, floor_z, random);
  uint32_t placed = 0;
  const uint64_t draws = uint64_t{count} * kDrawsPerPiece;
  for (uint64_t draw = 0; draw < draws && placed < count; ++draw) {
    const Piece& piece =
        pieces[random.NextBelow(static_cast<uint32_t>(pieces.size()))];
    const std::optional<PiecePlace> place = placer.Place(piece);
    if (!place) {
      continue;
    }
    out.BeginObject(fmt::format("{}_{}-{}", room.name, piece.name, ++placed));
    out.AddInstance({piece.file,
                     {place->x, place->y, floor_z},
                     static_cast<double>(place->degrees),
                     piece.polygons});
  }
}

}  // namespace enfilade
