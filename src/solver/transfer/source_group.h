// Groups of small patches that emit alike, such as the facets of a bulb. A
// group is a single source of a link: its radiosity is the mean over its
// patches, and the form factors and rays from a receiver's nodes to it go to
// the single patches (group_transfer.h). If that is too crude, the group is
// split in halves, and finally into its patches.
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

// A group of the members [first, first + count). Groups `child` and `child` + 1
// are its halves; a group whose child is 0 has none.
struct SourceGroup {
  Box box;
  float area = 0;  // m2, of all patches
  uint32_t first = 0;
  uint32_t count = 0;
  uint32_t child = 0;
};

// The groups of a cell.
class SourceGroups {
 public:
  SourceGroups() = default;

  // Groups emitting patches of one material: halves them in space until each
  // part is compact. A few patches form no group.
  explicit SourceGroups(std::span<const PatchGeometry> patches);

  // All groups, including halves.
  [[nodiscard]] std::span<const SourceGroup> All() const { return groups_; }

  // The indices of groups that are no other group's half. Each patch lies in at
  // most one of them.
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

  // An upper bound of SizeBytes() for a cell of so many patches.
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
  std::vector<bool> held_;         // per patch; empty without groups
};

// The mean, over a group's patches, of coefficients like CellTree::Sent(); and
// the RMS deviation from that mean over the group's area, in the channel that
// deviates most, W/m2.
struct GroupRadiosity {
  std::array<float, kRgbChannels> mean{};
  float spread = 0;
};

GroupRadiosity GroupRadiosityOf(const SourceGroups& groups,
                                const SourceGroup& group,
                                std::span<const PatchGeometry> patches,
                                const TreeShape& shape,
                                const CoefficientArray& radiosity);

}  // namespace enfilade
