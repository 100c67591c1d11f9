#include "scene/plan_index.h"

#include "base/planar_polygon.h"
#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace enfilade {
namespace {

constexpr double kCellMetres = 2.0;
constexpr double kLeastLevelAreaM2 = 0.05;
constexpr double kLeastWallHeightMetres = 0.3;
constexpr double kLeastWallLengthMetres = 0.05;
constexpr double kUpright = 0.2;
constexpr uint64_t kBytesPerFace = 200;  // includes its places in the index
constexpr uint64_t kFacesPerCharge = 4096;
// A level face is placed in cells so large that they are no more than this.
constexpr double kMostPlaces = 16;
// A wall with more places in the index gets its own charge.
constexpr double kManyPlaces = 64;
constexpr double kBytesPerPlace = 80;
constexpr std::string_view kPurpose = "finding places for default luminaires";

double Side(Point2 a, Point2 b, Point2 p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

bool SegmentsCross(Point2 a, Point2 b, Point2 c, Point2 d) {
  return Side(a, b, c) * Side(a, b, d) <= 0 &&
         Side(c, d, a) * Side(c, d, b) <= 0;
}

// Whether the segment meets the box, by clipping (Liang and Barsky).
bool SegmentMeetsBox(Point2 a, Point2 b, Point2 low, Point2 high) {
  double t0 = 0;
  double t1 = 1;
  const auto clip = [&](double from, double delta, double lo, double hi) {
    if (delta == 0) {
      return from >= lo && from <= hi;
    }
    const auto [enter, leave] =
        std::minmax({(lo - from) / delta, (hi - from) / delta});
    t0 = std::max(t0, enter);
    t1 = std::min(t1, leave);
    return t0 <= t1;
  };
  return clip(a.x, b.x - a.x, low.x, high.x) &&
         clip(a.y, b.y - a.y, low.y, high.y);
}

}  // namespace

bool LevelFace::Covers(Point2 p) const {
  for (size_t i = 0; i < outline.size(); ++i) {
    if (Side(outline[i], outline[(i + 1) % outline.size()], p) < 0) {
      return false;
    }
  }
  return true;
}

int64_t PlanIndex::Cell(double value, double size) {
  return static_cast<int64_t>(std::floor(value / size));
}

uint64_t PlanIndex::Key(int64_t x, int64_t y) {
  return MixKey(static_cast<uint64_t>(x), static_cast<uint64_t>(y));
}

Point3 PlanIndex::ToWorld(Point2 p, double z) const {
  return up_ == 2 ? Point3{p.x, p.y, z} : Point3{p.y, z, p.x};
}

void PlanIndex::Add(std::span<const Point3> polygon,
                    std::optional<SpaceId> front,
                    std::optional<SpaceId> back) {
  const Vec3 area = AreaVector(polygon);
  const Vec3 normal = Normalize(area);
  const double level = normal[up_];
  if (std::abs(level) >= least_level_) {
    if (Length(area) >= kLeastLevelAreaM2) {
      AddLevel(polygon, normal, level < 0 ? front : back);
    }
  } else if (std::abs(level) < kUpright) {
    AddWall(polygon);
  }
  if ((levels_.size() + walls_.size()) / kFacesPerCharge >= charges_.size()) {
    charges_.emplace_back(*budget_, kFacesPerCharge * kBytesPerFace, kPurpose);
  }
}

void PlanIndex::LevelsOfSize::AppendIn(Point2 low,
                                       Point2 high,
                                       double size,
                                       std::vector<uint32_t>& found) const {
  for (int64_t x = Cell(low.x, size); x <= Cell(high.x, size); ++x) {
    for (int64_t y = Cell(low.y, size); y <= Cell(high.y, size); ++y) {
      const auto it = at.find(Key(x, y));
      if (it != at.end()) {
        found.insert(found.end(), it->second.begin(), it->second.end());
      }
    }
  }
}

std::vector<uint32_t> PlanIndex::LevelsIn(Point2 low, Point2 high) const {
  std::vector<uint32_t> found;
  for (const auto& [size, of_size] : levels_by_size_) {
    const double cells =
        ((high.x - low.x) / size + 2) * ((high.y - low.y) / size + 2);
    if (cells > static_cast<double>(of_size.all.size())) {
      found.insert(found.end(), of_size.all.begin(), of_size.all.end());
    } else {
      of_size.AppendIn(low, high, size, found);
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

void PlanIndex::AddLevel(std::span<const Point3> polygon,
                         Vec3 normal,
                         std::optional<SpaceId> below) {
  const size_t ax = (up_ + 1) % 3;
  const size_t ay = (up_ + 2) % 3;
  LevelFace face;
  face.below = below;
  face.slope = {-normal[ax] / normal[up_], -normal[ay] / normal[up_]};
  face.base = polygon[0][up_] - face.slope.x * polygon[0][ax] -
              face.slope.y * polygon[0][ay];
  Point2 low{polygon[0][ax], polygon[0][ay]};
  Point2 high = low;
  for (const Point3 p : polygon) {
    const Point2 q{p[ax], p[ay]};
    face.outline.push_back(q);
    low = {std::min(low.x, q.x), std::min(low.y, q.y)};
    high = {std::max(high.x, q.x), std::max(high.y, q.y)};
  }
  if (normal[up_] < 0) {
    std::reverse(face.outline.begin(), face.outline.end());
  }
  const auto index = static_cast<uint32_t>(levels_.size());
  double size = kCellMetres;
  while (((high.x - low.x) / size + 1) * ((high.y - low.y) / size + 1) >
         kMostPlaces) {
    size *= 2;
  }
  LevelsOfSize& of_size = levels_by_size_[size];
  of_size.all.push_back(index);
  for (int64_t x = Cell(low.x, size); x <= Cell(high.x, size); ++x) {
    for (int64_t y = Cell(low.y, size); y <= Cell(high.y, size); ++y) {
      of_size.at[Key(x, y)].push_back(index);
    }
  }
  levels_.push_back(std::move(face));
}

void PlanIndex::AddWall(std::span<const Point3> polygon) {
  const size_t ax = (up_ + 1) % 3;
  const size_t ay = (up_ + 2) % 3;
  const auto plan = [&](Point3 p) { return Point2{p[ax], p[ay]}; };
  const auto apart = [](Point2 a, Point2 b) {
    return std::hypot(b.x - a.x, b.y - a.y);
  };
  // About the two corners farthest apart in plan: the corner farthest from the
  // first one, and then the corner farthest from that corner.
  WallLine wall{
      plan(polygon[0]), plan(polygon[0]), polygon[0][up_], polygon[0][up_]};
  for (const Point3 p : polygon) {
    wall.low = std::min(wall.low, p[up_]);
    wall.high = std::max(wall.high, p[up_]);
    if (apart(wall.from, plan(p)) > apart(wall.from, wall.to)) {
      wall.to = plan(p);
    }
  }
  for (const Point3 p : polygon) {
    if (apart(wall.to, plan(p)) > apart(wall.from, wall.to)) {
      wall.from = plan(p);
    }
  }
  if (wall.high - wall.low < kLeastWallHeightMetres ||
      apart(wall.from, wall.to) < kLeastWallLengthMetres) {
    return;
  }
  PlaceWall(wall, static_cast<uint32_t>(walls_.size()));
  walls_.push_back(wall);
}

// Goes through the columns of cells that the wall crosses, and in each through
// the few cells that it may meet there.
void PlanIndex::PlaceWall(const WallLine& wall, uint32_t index) {
  const auto [from, to] = std::minmax(
      wall.from, wall.to, [](Point2 a, Point2 b) { return a.x < b.x; });
  const double places =
      (to.x - from.x + std::abs(to.y - from.y)) / kCellMetres + 1;
  if (places > kManyPlaces) {
    charges_of_long_.emplace_back(
        *budget_, static_cast<uint64_t>(places * kBytesPerPlace), kPurpose);
  }
  const double rise = to.x > from.x ? (to.y - from.y) / (to.x - from.x) : 0;
  for (int64_t x = Cell(from.x, kCellMetres); x <= Cell(to.x, kCellMetres);
       ++x) {
    const double cx = static_cast<double>(x) * kCellMetres;
    const bool is_first = x == Cell(from.x, kCellMetres);
    const bool is_last = x == Cell(to.x, kCellMetres);
    const double enter = is_first ? from.y : from.y + rise * (cx - from.x);
    const double leave =
        is_last ? to.y : from.y + rise * (cx + kCellMetres - from.x);
    const auto [low, high] =
        std::minmax({Cell(enter, kCellMetres), Cell(leave, kCellMetres)});
    // One cell more at each end, for rounding.
    for (int64_t y = low - 1; y <= high + 1; ++y) {
      const double cy = static_cast<double>(y) * kCellMetres;
      if (SegmentMeetsBox(wall.from,
                          wall.to,
                          {cx, cy},
                          {cx + kCellMetres, cy + kCellMetres})) {
        walls_at_[Key(x, y)].push_back(index);
      }
    }
  }
}

template <typename Visit>
bool PlanIndex::AnyWall(Point2 low, Point2 high, const Visit& visit) const {
  for (int64_t x = Cell(low.x, kCellMetres); x <= Cell(high.x, kCellMetres);
       ++x) {
    for (int64_t y = Cell(low.y, kCellMetres); y <= Cell(high.y, kCellMetres);
         ++y) {
      const auto it = walls_at_.find(Key(x, y));
      if (it != walls_at_.end() &&
          std::any_of(it->second.begin(), it->second.end(), [&](uint32_t i) {
            return visit(walls_[i]);
          })) {
        return true;
      }
    }
  }
  return false;
}

bool PlanIndex::WallInBox(Point2 low,
                          Point2 high,
                          double z_low,
                          double z_high) const {
  return AnyWall(low, high, [&](const WallLine& wall) {
    return wall.low < z_high && wall.high > z_low &&
           SegmentMeetsBox(wall.from, wall.to, low, high);
  });
}

bool PlanIndex::WallBetween(Point2 a, Point2 b, double z) const {
  const Point2 low{std::min(a.x, b.x), std::min(a.y, b.y)};
  const Point2 high{std::max(a.x, b.x), std::max(a.y, b.y)};
  return AnyWall(low, high, [&](const WallLine& wall) {
    return wall.low < z && wall.high > z &&
           SegmentsCross(a, b, wall.from, wall.to);
  });
}

}  // namespace enfilade
