#include "solver/transfer/source_group.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// Fewer patches gain nothing from being a group.
constexpr size_t kLeastGroupPatches = 4;
// If a larger share of a cell's area emits, the emitters are not lamps.
constexpr float kMostEmitting = 0.1F;
// The largest allowed ratio of the squared diagonal of a group's box to the
// group's area; a ball has 1, a disc 2.5.
constexpr float kMostSpread = 4;

bool IsCompact(const SourceGroup& group) {
  const Vec3f diagonal = group.box.Extent();
  return group.count <= kMostGroupPatches &&
         Dot(diagonal, diagonal) <= kMostSpread * group.area;
}

}  // namespace

struct SourceGroups::Entry {
  uint32_t patch = 0;
  Vec3f center;

  static SourceGroup GroupOf(std::span<const PatchGeometry> patches,
                             std::span<const Entry> entries);
  static size_t Halve(std::span<Entry> entries);
};

SourceGroup SourceGroups::Entry::GroupOf(std::span<const PatchGeometry> patches,
                                         std::span<const Entry> entries) {
  SourceGroup group;
  for (const Entry& e : entries) {
    const PatchGeometry& patch = patches[e.patch];
    const Corners corners = CornersOf(patch, {});
    for (const Vec3f p : corners.View()) {
      group.box.Add(p);
    }
    group.area += patch.area;
  }
  group.count = static_cast<uint32_t>(entries.size());
  return group;
}

// Halves the space of the centres at the middle of its longest extent. Returns
// the number of entries in the first half; 0 if all centres coincide.
size_t SourceGroups::Entry::Halve(std::span<Entry> entries) {
  Box centers;
  for (const Entry& e : entries) {
    centers.Add(e.center);
  }
  const Vec3f extent = centers.Extent();
  size_t axis = extent.y > extent.x ? 1 : 0;
  axis = extent.z > extent[axis] ? 2 : axis;
  const float middle = 0.5F * (centers.low[axis] + centers.high[axis]);
  const auto second = std::stable_partition(
      entries.begin(), entries.end(), [&](const Entry& e) {
        return e.center[axis] < middle;
      });
  const auto count = static_cast<size_t>(second - entries.begin());
  return count == entries.size() ? 0 : count;
}

SourceGroups::SourceGroups(std::span<const PatchGeometry> patches) {
  std::vector<Entry> entries;
  float emitting = 0;
  float all_area = 0;
  for (size_t i = 0; i < patches.size(); ++i) {
    all_area += patches[i].area;
    if (patches[i].emits) {
      emitting += patches[i].area;
      entries.push_back({static_cast<uint32_t>(i),
                         PointOn(patches[i], {}, 1.0F / 3, 1.0F / 3)});
    }
  }
  if (emitting > kMostEmitting * all_area) {
    return;
  }
  const auto material_of = [&](const Entry& e) {
    return patches[e.patch].material.value;
  };
  std::stable_sort(
      entries.begin(), entries.end(), [&](const Entry& a, const Entry& b) {
        return material_of(a) < material_of(b);
      });
  const std::span<Entry> all(entries);
  for (size_t first = 0; first < all.size();) {
    size_t last = first;
    while (last < all.size() &&
           material_of(all[last]) == material_of(all[first])) {
      ++last;
    }
    AddGroups(patches, all.subspan(first, last - first));
    first = last;
  }
  groups_.shrink_to_fit();
  roots_.shrink_to_fit();
  members_.shrink_to_fit();
  if (!members_.empty()) {
    held_.resize(patches.size());
    for (const uint32_t patch : members_) {
      held_[patch] = true;
    }
  }
}

void SourceGroups::AddGroups(std::span<const PatchGeometry> patches,
                             std::span<Entry> entries) {
  if (entries.size() < kLeastGroupPatches) {
    return;
  }
  SourceGroup group = Entry::GroupOf(patches, entries);
  if (IsCompact(group)) {
    group.first = static_cast<uint32_t>(members_.size());
    roots_.push_back(static_cast<uint32_t>(groups_.size()));
    groups_.push_back(group);
    AddHalves(patches, entries, roots_.back());
    for (const Entry& e : entries) {
      members_.push_back(e.patch);
    }
  } else if (const size_t half = Entry::Halve(entries); half != 0) {
    AddGroups(patches, entries.first(half));
    AddGroups(patches, entries.subspan(half));
  }
}

void SourceGroups::AddHalves(std::span<const PatchGeometry> patches,
                             std::span<Entry> entries,
                             uint32_t group) {
  const size_t half = Entry::Halve(entries);
  if (half < kLeastGroupPatches / 2 ||
      entries.size() - half < kLeastGroupPatches / 2) {
    return;
  }
  const auto child = static_cast<uint32_t>(groups_.size());
  groups_[group].child = child;
  uint32_t first = groups_[group].first;
  for (const auto part : {entries.first(half), entries.subspan(half)}) {
    SourceGroup g = Entry::GroupOf(patches, part);
    g.first = first;
    first += g.count;
    groups_.push_back(g);
  }
  AddHalves(patches, entries.first(half), child);
  AddHalves(patches, entries.subspan(half), child + 1);
}

uint64_t SourceGroups::SizeBytes() const {
  return groups_.capacity() * sizeof(SourceGroup) +
         (roots_.capacity() + members_.capacity()) * sizeof(uint32_t) +
         held_.capacity() / 8;
}

uint64_t SourceGroups::BytesFor(size_t patches) {
  // Each half has at least two patches, so there are fewer groups than patches.
  return patches * (sizeof(SourceGroup) + sizeof(uint32_t)) +
         patches / kLeastGroupPatches * sizeof(uint32_t) + patches / 8 + 8;
}

GroupRadiosity GroupRadiosityOf(const SourceGroups& groups,
                                const SourceGroup& group,
                                std::span<const PatchGeometry> patches,
                                const TreeShape& shape,
                                const CoefficientArray& radiosity) {
  ENFILADE_CHECK(
      shape.channels <= kRgbChannels, "groups of {} channels", shape.channels);
  GroupRadiosity result;
  std::array<double, kRgbChannels> squares{};
  for (const uint32_t i : groups.PatchesOf(group)) {
    const float share = patches[i].area / group.area;
    const ShapeBasis& basis = shape.basis->On(patches[i].shape);
    const auto all = radiosity[ElementId(i)];
    for (size_t c = 0; c < shape.channels; ++c) {
      double mean = 0;
      double square = 0;
      for (size_t g = 0; g < basis.NodeCount(); ++g) {
        const auto b = static_cast<double>(all[c * shape.NodeStride() + g]);
        mean += basis.Weight(g) * b;
        square += basis.Weight(g) * b * b;
      }
      result.mean[c] += share * static_cast<float>(mean);
      squares[c] += static_cast<double>(share) * square;
    }
  }
  for (size_t c = 0; c < shape.channels; ++c) {
    const auto mean = static_cast<double>(result.mean[c]);
    result.spread = std::max(
        result.spread,
        static_cast<float>(std::sqrt(std::max(0.0, squares[c] - mean * mean))));
  }
  return result;
}

}  // namespace enfilade
