// Groups of small patches that emit alike, such as the facets of a bulb. As the
// source of a link a group counts as one: its radiosity is the mean over its
// patches, and what a receiver's nodes get of it is summed over the patches and
// seen by rays to them (group_transfer.h). Where that is too rough, a group is
// split in halves, and in the end into its patches.
// docs/decisions/source-groups.md.

#pragma once

#include "solver/elements/coefficient_array.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

inline constexpr size_t kMostGroupPatches = 128;

// Members [first, first + count), halved by the groups child and child + 1, or
// not halved where child is 0.
struct SourceGroup {
  Box box;
  float area = 0;  // m2, of all
  uint32_t first = 0;
  uint32_t count = 0;
  uint32_t child = 0;
};

// The groups of a cell.
class SourceGroups {
 public:
  SourceGroups() = default;

  // Groups patches that emit, of one material: halved in space until what is
  // left is compact. A few patches are no group.
  explicit SourceGroups(std::span<const PatchGeometry> patches);

  // With their halves.
  [[nodiscard]] std::span<const SourceGroup> All() const { return groups_; }

  // Those that are nobody's half. Each patch lies in one at most.
  [[nodiscard]] std::span<const uint32_t> Roots() const { return roots_; }

  // The patches of a group.
  [[nodiscard]] std::span<const uint32_t> PatchesOf(
      const SourceGroup& group) const {
    return std::span(members_).subspan(group.first, group.count);
  }

  // Whether a patch lies in a group.
  [[nodiscard]] bool Holds(uint32_t patch) const {
    return !held_.empty() && held_[patch];
  }

  [[nodiscard]] uint64_t SizeBytes() const;

  // An upper bound of what SizeBytes() of a cell of so many patches will be.
  static uint64_t BytesFor(size_t patches);

 private:
  struct Entry;

  void AddGroups(std::span<const PatchGeometry> patches,
                 std::span<Entry> entries);
  void AddHalves(std::span<const PatchGeometry> patches,
                 std::span<Entry> entries,
                 uint32_t group);

  std::vector<SourceGroup> groups_;
  std::vector<uint32_t> roots_;
  std::vector<uint32_t> members_;  // of all roots
  std::vector<bool> held_;         // per patch, unless there are none
};

// The mean over a group's patches of an array of coefficients like
// CellTree::Sent(), and the RMS over its area of what they deviate from it, of
// the channel that deviates most, W/m2.
struct GroupRadiosity {
  std::array<float, kRgbChannels> mean{};
  float spread = 0;
};

GroupRadiosity RadiosityOf(const SourceGroups& groups,
                           const SourceGroup& group,
                           std::span<const PatchGeometry> patches,
                           const TreeShape& shape,
                           const CoefficientArray& radiosity);

}  // namespace enfilade
