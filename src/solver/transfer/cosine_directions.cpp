#include "solver/transfer/cosine_directions.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

// Reduces t to an eighth of a turn on either side of the nearest quarter, and
// sums Taylor's series there. The error is below the first omitted term: (pi /
// 4)^13 / 13! = 7e-12 of the sine, (pi / 4)^14 / 14! of the cosine.
CirclePoint OnCircle(double t) {
  const int quarter = (static_cast<int>(8 * t) + 1) / 2;
  const double angle = 2 * kPi * (t - 0.25 * quarter);
  const double z = angle * angle;
  const double sine =
      angle * (1 + z * (-1.0 / 6 +
                        z * (1.0 / 120 +
                             z * (-1.0 / 5040 +
                                  z * (1.0 / 362880 - z * (1.0 / 39916800))))));
  const double cosine =
      1 + z * (-0.5 + z * (1.0 / 24 + z * (-1.0 / 720 +
                                           z * (1.0 / 40320 +
                                                z * (-1.0 / 3628800 +
                                                     z * (1.0 / 479001600))))));
  const bool is_odd = (quarter & 1) != 0;
  const double along = is_odd ? -sine : cosine;
  const double across = is_odd ? cosine : sine;
  const bool is_turned = (quarter & 2) != 0;
  return {is_turned ? -along : along, is_turned ? -across : across};
}

Vec3f CosineDirections::Draw(Random* random) const {
  const double r = std::sqrt(random->Next());
  const CirclePoint at = OnCircle(random->Next());
  const auto a = static_cast<float>(r * at.cosine);
  const auto b = static_cast<float>(r * at.sine);
  return axes_.x * a + axes_.y * b +
         axes_.z * std::sqrt(std::max(0.0F, 1 - a * a - b * b));
}

}  // namespace enfilade
