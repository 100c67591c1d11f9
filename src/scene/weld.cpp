#include "scene/weld.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace enfilade {
namespace {

// Grid cells are this many tolerances wide, so that few points are near the
// border of their cell.
constexpr double kCellTolerances = 64;
constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

}  // namespace

uint64_t Welder::Key(int64_t x, int64_t y, int64_t z) const {
  return MixKey(MixKey(static_cast<uint64_t>(x), static_cast<uint64_t>(y)),
                static_cast<uint64_t>(z));
}

std::optional<uint32_t> Welder::FirstNear(uint64_t key, Point3 p) const {
  std::optional<uint32_t> found;
  const auto [first, last] = grid_.equal_range(key);
  for (auto it = first; it != last; ++it) {
    if (Length(vertices_[it->second] - p) <= tolerance_ &&
        (!found || it->second < *found)) {
      found = it->second;
    }
  }
  return found;
}

uint32_t Welder::Vertex(Point3 p) {
  const double scale = 1.0 / (kCellTolerances * tolerance_);
  const auto cell = [&](double value) {
    return static_cast<int64_t>(std::floor(value * scale));
  };
  const double t = tolerance_;
  uint32_t found = kNone;
  for (int64_t x = cell(p.x - t); x <= cell(p.x + t); ++x) {
    for (int64_t y = cell(p.y - t); y <= cell(p.y + t); ++y) {
      for (int64_t z = cell(p.z - t); z <= cell(p.z + t); ++z) {
        found = std::min(found, FirstNear(Key(x, y, z), p).value_or(kNone));
      }
    }
  }
  if (found == kNone) {
    found = static_cast<uint32_t>(vertices_.size());
    vertices_.push_back(p);
    grid_.emplace(Key(cell(p.x), cell(p.y), cell(p.z)), found);
  }
  return found;
}

}  // namespace enfilade
