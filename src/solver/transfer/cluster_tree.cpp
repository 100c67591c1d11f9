#include "solver/transfer/cluster_tree.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace enfilade {
namespace {

// Smaller leaves cost more memory than they save time.
constexpr size_t kLeafItems = 4;
constexpr float kTouching = 1e20F;  // 1/m2

// Which of the six axis directions a normal is closest to.
uint32_t DirectionOf(Vec3f n) {
  const Vec3f a = {std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  if (a.x >= a.y && a.x >= a.z) {
    return n.x < 0 ? 0 : 1;
  }
  if (a.y >= a.z) {
    return n.y < 0 ? 2 : 3;
  }
  return n.z < 0 ? 4 : 5;
}

// The largest dot product of a vector in one box with a vector in another.
float LargestDot(const Box& a, const Box& b) {
  float sum = 0;
  for (size_t i = 0; i < 3; ++i) {
    const float al = a.low[i];
    const float ah = a.high[i];
    const float bl = b.low[i];
    const float bh = b.high[i];
    sum += std::max(std::max(al * bl, al * bh), std::max(ah * bl, ah * bh));
  }
  return sum;
}

}  // namespace

// A leaf has at least kLeafItems / 2 items unless its items were split off by
// direction. There are few directions, so there are hardly more leaves than
// half the items.
size_t ClusterTree::MostClusters(size_t items) {
  constexpr size_t kForDirections = 12;
  return items + kForDirections;
}

struct ClusterTree::Entry {
  ClusterItem item;
  Vec3f center;
  uint32_t direction = 0;
};

ClusterTree::ClusterTree(std::span<const PatchGeometry> patches,
                         std::vector<ClusterItem> items)
    : items_(std::move(items)) {
  std::vector<Entry> entries;
  entries.reserve(items_.size());
  clusters_.reserve(MostClusters(items_.size()));
  for (const ClusterItem& item : items_) {
    const PatchGeometry& patch = patches[item.patch];
    const ElementFrame frame = FrameOfPath(patch.shape, item.path);
    entries.push_back({item,
                       PointOn(patch, frame, 1.0F / 3, 1.0F / 3),
                       DirectionOf(patch.normal)});
  }
  Cluster root;
  root.count = static_cast<uint32_t>(entries.size());
  clusters_.push_back(root);
  for (uint32_t node = 0; node < clusters_.size(); ++node) {
    Build(&entries, node);
  }
  std::transform(
      entries.begin(), entries.end(), items_.begin(), [](const Entry& e) {
        return e.item;
      });
  for (size_t i = clusters_.size(); i-- > 0;) {
    Cluster& c = clusters_[i];
    if (c.child != 0) {
      for (const uint32_t k : {c.child, c.child + 1}) {
        c.box.Add(clusters_[k].box);
        c.normals.Add(clusters_[k].normals);
        c.largest_area = std::max(c.largest_area, clusters_[k].largest_area);
      }
      continue;
    }
    for (uint32_t k = c.first; k < c.first + c.count; ++k) {
      const PatchGeometry& patch = patches[items_[k].patch];
      const ElementFrame frame = FrameOfPath(patch.shape, items_[k].path);
      const Corners corners = CornersOf(patch, frame);
      for (const Vec3f p : corners.View()) {
        c.box.Add(p);
      }
      c.normals.Add(patch.normal);
      c.largest_area = std::max(c.largest_area, AreaOf(patch, frame));
    }
  }
}

// Splits a node's entries: by direction if there is more than one, else at the
// median along the longest extent of the entries' centres.
void ClusterTree::Build(std::vector<Entry>* entries, uint32_t node) {
  const Cluster cluster = clusters_[node];
  if (cluster.count <= kLeafItems) {
    return;
  }
  const auto first = entries->begin() + cluster.first;
  const auto last = first + cluster.count;
  Box centers;
  for (auto e = first; e != last; ++e) {
    centers.Add(e->center);
  }
  const Vec3f extent = centers.Extent();
  size_t axis = extent.y > extent.x ? 1 : 0;
  axis = extent.z > extent[axis] ? 2 : axis;
  const auto key = [axis](const Entry& e) {
    return std::make_tuple(e.center[axis], e.item.patch, e.item.path);
  };
  const auto [fewest, most] =
      std::minmax_element(first, last, [](const Entry& a, const Entry& b) {
        return a.direction < b.direction;
      });
  const uint32_t split = (fewest->direction + most->direction + 1) / 2;
  auto middle = first + cluster.count / 2;
  if (fewest->direction != most->direction) {
    middle = std::stable_partition(
        first, last, [&](const Entry& e) { return e.direction < split; });
  } else {
    std::nth_element(first, middle, last, [&](const Entry& a, const Entry& b) {
      return key(a) < key(b);
    });
  }
  Cluster left;
  left.first = cluster.first;
  left.count = static_cast<uint32_t>(middle - first);
  Cluster right;
  right.first = left.first + left.count;
  right.count = cluster.count - left.count;
  clusters_[node].child = static_cast<uint32_t>(clusters_.size());
  clusters_.push_back(left);
  clusters_.push_back(right);
}

std::vector<float> ClusterTree::LargestOf(std::span<const float> values) const {
  std::vector<float> largest(clusters_.size());
  for (size_t i = clusters_.size(); i-- > 0;) {
    const Cluster& c = clusters_[i];
    if (c.child != 0) {
      largest[i] = std::max(largest[c.child], largest[c.child + 1]);
      continue;
    }
    for (uint32_t k = c.first; k < c.first + c.count; ++k) {
      largest[i] = std::max(largest[i], values[k]);
    }
  }
  return largest;
}

uint64_t ClusterTree::SizeBytes() const {
  return items_.capacity() * sizeof(ClusterItem) +
         clusters_.capacity() * sizeof(Cluster);
}

uint64_t ClusterTree::BytesFor(size_t items) {
  return items * sizeof(Entry) + HeldBytesFor(items);
}

uint64_t ClusterTree::HeldBytesFor(size_t items) {
  return items * sizeof(ClusterItem) + MostClusters(items) * sizeof(Cluster);
}

std::vector<ClusterItem> WholePatches(size_t count) {
  std::vector<ClusterItem> items(count);
  for (size_t i = 0; i < count; ++i) {
    items[i].patch = static_cast<uint32_t>(i);
  }
  return items;
}

ClusterBound BoundOf(const Cluster& receiver, const Cluster& source) {
  const Box forward = {source.box.low - receiver.box.high,
                       source.box.high - receiver.box.low};
  const Box backward = {receiver.box.low - source.box.high,
                        receiver.box.high - source.box.low};
  const float cos_x = LargestDot(receiver.normals, forward);
  const float cos_y = LargestDot(source.normals, backward);
  ClusterBound bound;
  if (cos_x <= 0 || cos_y <= 0) {
    bound.behind = true;
    bound.form_factor = 0;
    return bound;
  }
  float square = 0;
  for (size_t i = 0; i < 3; ++i) {
    const float gap =
        std::max(0.0F, std::max(forward.low[i], -forward.high[i]));
    square += gap * gap;
  }
  const float distance = std::sqrt(square);
  bound.per_area = kTouching;
  if (distance > 0) {
    bound.per_area = std::min(1.0F, cos_x / distance) *
                     std::min(1.0F, cos_y / distance) /
                     (static_cast<float>(kPi) * square);
    bound.form_factor = std::min(1.0F, bound.per_area * source.largest_area);
  }
  return bound;
}

}  // namespace enfilade
