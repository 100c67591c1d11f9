// Numbers for the planes of walls: those of one wall get one number.

#pragma once

#include "base/memory.h"
#include "partition/polygon.h"

#include <array>
#include <cstdint>
#include <map>

namespace enfilade {

// Planes of one group are parallel, and each lies less than a millimetre from
// the next: the first and the last of many may be farther apart. Which way a
// plane faces does not count. Takes memory by groups, however many planes.
class PlaneGroups {
 public:
  explicit PlaneGroups(MemoryBudget& budget);

  // `share`: of all planes, with this one. Throws DoesNotFitError.
  void Add(const Plane& plane, double share);

  // After all were added: in the order of normals, and then of places.
  void Number();

  // Of a plane that was added, after Number().
  [[nodiscard]] uint32_t Of(const Plane& plane) const;

 private:
  using Normal = std::array<int64_t, 3>;  // rounded

  struct Group {
    double high = 0;  // the greatest offset
    uint32_t number = 0;
  };

  using ByLow = std::map<double, Group>;  // by the least offset

  struct Key {
    Normal normal{};
    double offset = 0;
  };

  static Key KeyOf(const Plane& plane);

  std::map<Normal, ByLow> groups_;
  uint32_t count_ = 0;
  GrowingCharge charge_;
};

}  // namespace enfilade
