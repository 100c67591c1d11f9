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

// A list of fragments that keeps their order. The shelf must outlive it.
class FragmentList {
 public:
  using Visitor = std::function<void(const WallFragment&)>;

  explicit FragmentList(ScratchShelf& shelf) : list_(shelf) {}

  [[nodiscard]] uint64_t Size() const { return size_; }

  void Add(const WallFragment& fragment);

  // A visited fragment is valid only during the call of `visit`.
  void Visit(const Visitor& visit) const;

  // Visits all fragments and frees each part of the list once it was visited.
  void Consume(const Visitor& visit);

 private:
  uint64_t size_ = 0;
  ScratchList list_;
};

}  // namespace enfilade
