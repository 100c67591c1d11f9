// The walls inside a region of the tree, in lists that may be larger than
// memory.

#pragma once

#include "partition/polygon.h"
#include "partition/scratch_list.h"

#include <cstdint>
#include <functional>

namespace enfilade {

// The part of a wall inside a region.
struct WallFragment {
  Polygon polygon;
  Plane plane;               // of the whole wall
  uint32_t plane_group = 0;  // see PlaneGroups
};

// Fragments in their order. The shelf must outlive it.
class FragmentList {
 public:
  using Visitor = std::function<void(const WallFragment&)>;

  explicit FragmentList(ScratchShelf& shelf) : list_(shelf) {}

  [[nodiscard]] uint64_t Size() const { return size_; }

  void Add(const WallFragment& fragment);

  // What is visited lasts as long as the call.
  void Visit(const Visitor& visit) const;

  // Visits all, and lets go of each part of the list when it was visited.
  void Consume(const Visitor& visit);

 private:
  uint64_t size_ = 0;
  ScratchList list_;
};

}  // namespace enfilade
