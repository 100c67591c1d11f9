// The building in plan: an index of large level and upright faces by their
// place.
//
// Notation: a plan point has coordinates (x, y) along two world axes such that
// x, y, up is right-handed; z is the height.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"
#include "scene/polygon_cut.h"

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace enfilade {

// A face that lamps can hang from or people can stand on.
struct LevelFace {
  std::vector<Point2> outline;  // counter-clockwise, convex
  Point2 slope;                 // height = base + slope . point
  double base = 0;
  std::optional<SpaceId> below;  // the Space under it, if known

  [[nodiscard]] double HeightAt(Point2 p) const {
    return base + slope.x * p.x + slope.y * p.y;
  }

  [[nodiscard]] bool Covers(Point2 p) const;
};

// An upright face as seen from above.
struct WallLine {
  Point2 from, to;
  double low = 0, high = 0;
};

class PlanIndex {
 public:
  // `up` is 1 for y, 2 for z. Level faces have an area of at least 0.05 m2 (a
  // tile of a ceiling) and a unit normal whose up component is at least
  // `least_level` in magnitude.
  PlanIndex(size_t up, double least_level, MemoryBudget& budget)
      : up_(up), least_level_(least_level), budget_(&budget) {}

  // Adds the polygon to the index if it is large, and level or upright.
  void Add(std::span<const Point3> polygon,
           std::optional<SpaceId> front,
           std::optional<SpaceId> back);

  [[nodiscard]] const std::vector<LevelFace>& Levels() const { return levels_; }

  // Calls visit(face) for every level face over or under p.
  template <typename Visit>
  void ForLevelsAt(Point2 p, const Visit& visit) const {
    for (const auto& [size, of_size] : levels_by_size_) {
      const auto it = of_size.at.find(Key(Cell(p.x, size), Cell(p.y, size)));
      if (it == of_size.at.end()) {
        continue;
      }
      for (const uint32_t i : it->second) {
        if (levels_[i].Covers(p)) {
          visit(levels_[i]);
        }
      }
    }
  }

  // The level faces that may meet the box from `low` to `high`, in order. Takes
  // time as there are cells of the index in the box, and no more than as there
  // are faces.
  [[nodiscard]] std::vector<uint32_t> LevelsIn(Point2 low, Point2 high) const;

  // Whether a wall at these heights meets the box from `low` to `high`.
  [[nodiscard]] bool WallInBox(Point2 low,
                               Point2 high,
                               double z_low,
                               double z_high) const;

  // Whether a wall at this height stands between the two points.
  [[nodiscard]] bool WallBetween(Point2 a, Point2 b, double z) const;

  [[nodiscard]] Point3 ToWorld(Point2 p, double z) const;

 private:
  // The faces in each cell of a square grid.
  using Grid = std::unordered_map<uint64_t, std::vector<uint32_t>>;

  struct LevelsOfSize {
    Grid at;
    std::vector<uint32_t> all;

    // Adds those in the cells of this size that the box meets.
    void AppendIn(Point2 low,
                  Point2 high,
                  double size,
                  std::vector<uint32_t>& found) const;
  };

  static int64_t Cell(double value, double size);
  static uint64_t Key(int64_t x, int64_t y);

  void AddLevel(std::span<const Point3> polygon,
                Vec3 normal,
                std::optional<SpaceId> below);
  void AddWall(std::span<const Point3> polygon);
  void PlaceWall(const WallLine& wall, uint32_t index);

  template <typename Visit>
  bool AnyWall(Point2 low, Point2 high, const Visit& visit) const;

  size_t up_;
  double least_level_;
  MemoryBudget* budget_;
  std::vector<MemoryCharge> charges_;
  std::vector<MemoryCharge> charges_of_long_;
  std::vector<LevelFace> levels_;
  std::vector<WallLine> walls_;
  // By the size of the cells: each face is in few cells, however large it is.
  std::map<double, LevelsOfSize> levels_by_size_;
  Grid walls_at_;
};

}  // namespace enfilade
