// Welding: points closer than a tolerance become one vertex.

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace enfilade {

class Welder {
 public:
  explicit Welder(double tolerance) : tolerance_(tolerance) {}

  // The index of the first vertex within the tolerance of p, or of a new one.
  uint32_t Vertex(Point3 p);

  [[nodiscard]] const std::vector<Point3>& Vertices() const {
    return vertices_;
  }

 private:
  [[nodiscard]] uint64_t Key(int64_t x, int64_t y, int64_t z) const;
  // The first vertex within the tolerance of p in the grid cell with this key.
  [[nodiscard]] std::optional<uint32_t> FirstNear(uint64_t key, Point3 p) const;

  double tolerance_;
  std::vector<Point3> vertices_;
  std::unordered_multimap<uint64_t, uint32_t> grid_;
};

}  // namespace enfilade
