// Finds out whether a file has oblique walls whose coordinates were rounded.

#pragma once

#include "base/memory.h"
#include "scene/polygon_sink.h"
#include "scene/rounded_walls.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// Sees a file before it is read into the store: to how many decimals it writes
// its coordinates, and its walls.
class RoundingSurvey : public PolygonReceiver {
 public:
  // `metres_per_unit`: of the file's coordinates.
  RoundingSurvey(double metres_per_unit, MemoryBudget& budget);

  // Takes a vertex as the file has it.
  void See(Point3 in_file);

  // Whether what was seen is written so finely that Finish() gives nullopt.
  [[nodiscard]] bool IsFine() const;

  void Begin(MaterialId /*id*/,
             const Material& /*material*/,
             ObjectId /*object*/) override {}

  void Add(std::span<const Point3> polygon) override;

  void Flush() override {}

  // nullopt if coordinates are written finely, or so coarsely that nothing is
  // known of the walls, or if all walls stand along the axes, which rounding
  // leaves them.
  std::optional<RoundedWalls> Finish();

 private:
  static constexpr size_t kMostDecimals = 7;

  struct Wall {
    double area_m2 = 0;
    uint64_t number = 0;  // in the order of the file
    std::vector<Point3> polygon;
  };

  // Whether wall a is kept before wall b.
  static bool IsLarger(const Wall& a, const Wall& b);

  [[nodiscard]] std::optional<double> StepM() const;

  double metres_per_unit_;
  MemoryBudget* budget_;
  GrowingCharge charge_;
  uint64_t wall_bytes_ = 0;
  uint64_t coordinates_ = 0;
  // Those that are multiples of 1, 0.1, 0.01, ... units.
  std::array<uint64_t, kMostDecimals> multiples_{};
  std::vector<Wall> walls_;  // the largest, as a heap
  uint64_t polygons_ = 0;
};

}  // namespace enfilade
