// Distinct id types, so that an index of one kind of thing cannot be passed for
// another. Index() gives the subscript into an array of such things.

#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

// A 32-bit index of the things named by Tag. Ids are dense and start at 0.
template <typename Tag>
struct Id {
  uint32_t value = 0;

  constexpr Id() = default;

  constexpr explicit Id(uint32_t v) : value(v) {}

  constexpr explicit Id(size_t v) : value(static_cast<uint32_t>(v)) {}

  [[nodiscard]] constexpr size_t Index() const { return value; }

  // clang-tidy 14 takes the defaulted operator's own zero for a null pointer.
  // NOLINTNEXTLINE(modernize-use-nullptr)
  friend constexpr auto operator<=>(Id, Id) = default;
};

using MaterialId = Id<struct MaterialTag>;
using ObjectId = Id<struct ObjectTag>;
using SpaceId = Id<struct SpaceTag>;      // a room as the input file names it
using FaceId = Id<struct FaceTag>;        // a cleaned polygon of the scene
using CellId = Id<struct CellTag>;        // a region of the partition
using PortalId = Id<struct PortalTag>;    // an opening between two cells
using PatchId = Id<struct PatchTag>;      // a patch within its cell
using ElementId = Id<struct ElementTag>;  // an element within its cell

// The ids 0 to count - 1.
template <typename SomeId>
std::vector<SomeId> FirstIds(size_t count) {
  std::vector<SomeId> ids;
  ids.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    ids.emplace_back(i);
  }
  return ids;
}

}  // namespace enfilade

template <typename Tag>
struct std::hash<enfilade::Id<Tag>> {
  size_t operator()(enfilade::Id<Tag> id) const noexcept {
    return std::hash<uint32_t>{}(id.value);
  }
};
