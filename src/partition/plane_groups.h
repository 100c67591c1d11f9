// Numbers the planes of walls so that all planes of one wall get one number.

#pragma once

#include "base/memory.h"
#include "partition/polygon.h"

#include <array>
#include <cstdint>
#include <map>

namespace enfilade {

// The planes of a group are parallel up to rounding, and each lies less than a
// millimetre from the next; the first and the last of many may be farther
// apart. The side a plane faces does not count. The memory grows with the
// number of groups, not of planes.
class PlaneGroups {
 public:
  // Offsets are measured from `center`, which should be within the scene. From
  // a far origin, as that of map coordinates, the rounding of a normal would
  // move the planes of one wall apart.
  PlaneGroups(Point3 center, MemoryBudget& budget);

  // `share` is the share of all planes that were added so far, this one
  // included. Throws DoesNotFitError.
  void Add(const Plane& plane, double share);

  // Numbers the groups by normal, then by offset. To be called after all planes
  // were added.
  void Number();

  // The group number of a plane that was added. To be called after Number().
  [[nodiscard]] uint32_t Of(const Plane& plane) const;

 private:
  using Normal = std::array<int64_t, 3>;  // rounded

  struct Group {
    double high = 0;  // the greatest offset from the center
    uint32_t number = 0;
  };

  using ByLow = std::map<double, Group>;  // by the least offset

  struct Key {
    Normal normal{};
    double offset = 0;
  };

  [[nodiscard]] Key KeyOf(const Plane& plane) const;

  Vec3 center_;
  std::map<Normal, ByLow> groups_;
  uint32_t count_ = 0;
  GrowingCharge charge_;
};

}  // namespace enfilade
