#include "scene/rounding_survey.h"

#include "base/planar_polygon.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

// Rounding to less than this matters to nothing; of more, too much is lost.
constexpr double kLeastStepM = 2e-5;
constexpr double kMostStepM = 2e-3;
// The share of coordinates that must be multiples of a step, and after how many
// it shows that they are not.
constexpr double kMultiples = 0.999;
constexpr uint64_t kCoordinatesToTell = 30'000;
// The largest walls are kept, if they are at least this large.
constexpr size_t kMostWalls = 8192;
constexpr size_t kMostCorners = 64;
constexpr double kLeastWallM2 = 0.25;

}  // namespace

RoundingSurvey::RoundingSurvey(double metres_per_unit, MemoryBudget& budget)
    : metres_per_unit_(metres_per_unit),
      budget_(&budget),
      charge_(budget, "the walls whose coordinates are rounded") {}

void RoundingSurvey::See(Point3 in_file) {
  coordinates_ += 3;
  for (size_t axis = 0; axis < 3; ++axis) {
    double steps = std::abs(in_file[axis]);
    for (uint64_t& multiples : multiples_) {
      // Decimal fractions are not exact in binary.
      const double off = std::abs(steps - std::round(steps));
      multiples += off <= 1e-12 * steps + 1e-6 ? 1 : 0;
      steps *= 10;
    }
  }
}

bool RoundingSurvey::IsLarger(const Wall& a, const Wall& b) {
  return std::pair(a.area_m2, b.number) > std::pair(b.area_m2, a.number);
}

void RoundingSurvey::Add(std::span<const Point3> polygon) {
  const uint64_t number = polygons_++;
  const double area_m2 = Length(AreaVector(polygon));
  if (polygon.size() > kMostCorners || !(area_m2 >= kLeastWallM2)) {
    return;
  }
  const bool is_full = walls_.size() == kMostWalls;
  if (is_full && area_m2 <= walls_.front().area_m2) {
    return;
  }
  const auto bytes_of = [](std::span<const Point3> corners) {
    constexpr uint64_t kGrowth = 2;  // of the vector of walls
    return kGrowth * sizeof(Wall) + AllocatedBytes(corners.size_bytes());
  };
  if (is_full) {
    std::pop_heap(walls_.begin(), walls_.end(), IsLarger);
    wall_bytes_ -= bytes_of(walls_.back().polygon);
    walls_.pop_back();
  }
  wall_bytes_ += bytes_of(polygon);
  charge_.GrowTo(wall_bytes_);
  walls_.push_back({area_m2, number, {polygon.begin(), polygon.end()}});
  std::push_heap(walls_.begin(), walls_.end(), IsLarger);
}

bool RoundingSurvey::IsFine() const {
  return coordinates_ > kCoordinatesToTell && !StepM();
}

std::optional<double> RoundingSurvey::StepM() const {
  double step_m = metres_per_unit_;
  for (const uint64_t multiples : multiples_) {
    if (static_cast<double>(multiples) >=
        kMultiples * static_cast<double>(coordinates_)) {
      return step_m >= kLeastStepM && step_m <= kMostStepM
                 ? std::optional(step_m)
                 : std::nullopt;
    }
    step_m /= 10;
  }
  return std::nullopt;
}

std::optional<RoundedWalls> RoundingSurvey::Finish() {
  const std::optional<double> step_m = StepM();
  if (!step_m) {
    return std::nullopt;
  }
  std::sort_heap(walls_.begin(), walls_.end(), IsLarger);
  const bool has_oblique =
      std::any_of(walls_.begin(), walls_.end(), [](const Wall& wall) {
        return !RoundedWalls::IsAlongAxis(Normalize(AreaVector(wall.polygon)));
      });
  if (!has_oblique) {
    return std::nullopt;
  }
  std::vector<std::vector<Point3>> polygons;
  polygons.reserve(walls_.size());
  for (Wall& wall : walls_) {
    polygons.push_back(std::move(wall.polygon));
  }
  return RoundedWalls(polygons, *step_m, *budget_);
}

}  // namespace enfilade
