#include "solver/transfer/box_hull.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

BoxHull::BoxHull(const Box& a, const Box& b) : bounds_(a) {
  bounds_.Add(b);
  AddSlanted(a, b, 0, 1);
  AddSlanted(a, b, 1, 2);
  AddSlanted(a, b, 2, 0);
}

// Adds what is beyond the slanted faces along the third axis. The line through
// like corners of both rectangles is an edge of the hull if its normal points
// away from both, to the side on which these corners lie along either axis.
void BoxHull::AddSlanted(const Box& a, const Box& b, size_t x, size_t y) {
  for (size_t corner = 0; corner < 4; ++corner) {
    const bool high_x = (corner & 1) != 0;
    const bool high_y = (corner & 2) != 0;
    const float ax = high_x ? a.high[x] : a.low[x];
    const float ay = high_y ? a.high[y] : a.low[y];
    const float bx = high_x ? b.high[x] : b.low[x];
    const float by = high_y ? b.high[y] : b.low[y];
    const bool rises = (by > ay) == (bx > ax);
    if (bx == ax || by == ay || rises == (high_x == high_y)) {
      continue;
    }
    std::array<float, 3> normal{};
    normal[x] = std::abs(by - ay) * (high_x ? 1.0F : -1.0F);
    normal[y] = std::abs(bx - ax) * (high_y ? 1.0F : -1.0F);
    outside_[count_++] =
        HalfSpaceBeyond({normal[0], normal[1], normal[2]},
                        std::max(normal[x] * ax + normal[y] * ay,
                                 normal[x] * bx + normal[y] * by),
                        bounds_);
  }
}

bool BoxHull::Overlaps(const Box& box) const {
  BoxOctet boxes;
  boxes.Set(0, box);
  return (Overlapping(boxes) & 1) != 0;
}

uint32_t BoxHull::Overlapping(const BoxOctet& boxes) const {
  const uint32_t bits = boxes.Overlapping(bounds_);
  return bits == 0 ? 0 : bits & ~boxes.WithinAny(Outside());
}

}  // namespace enfilade
