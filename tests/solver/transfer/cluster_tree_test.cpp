// Clusters bound their items and every transfer between them.

#include "solver/transfer/cluster_tree.h"

#include "solver/transfer/form_factor.h"

#include <algorithm>
#include <set>

#include "tests/solver/test_cells.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::GeometryOf;
using test::kFloatRounding;
using test::RandomPatches;
using test::RandomPointOn;

// Whole patches and, of every third patch, two of its children instead.
std::vector<ClusterItem> MixedItems(size_t patches) {
  std::vector<ClusterItem> items;
  for (uint32_t i = 0; i < patches; ++i) {
    if (i % 3 == 0) {
      items.push_back({i, ChildPath(kRootPath, 1)});
      items.push_back({i, ChildPath(ChildPath(kRootPath, 2), 3)});
    } else {
      items.push_back({i, kRootPath});
    }
  }
  return items;
}

using ItemKey = std::pair<uint32_t, ElementPath>;

std::multiset<ItemKey> KeysOf(std::span<const ClusterItem> items) {
  std::multiset<ItemKey> keys;
  for (const ClusterItem& item : items) {
    keys.insert({item.patch, item.path});
  }
  return keys;
}

ElementFrame FrameOf(const std::vector<PatchGeometry>& patches,
                     const ClusterItem& item) {
  return FrameOfPath(patches[item.patch].shape, item.path);
}

bool Holds(const Box& box, Vec3f p) {
  return box.low.x <= p.x && p.x <= box.high.x && box.low.y <= p.y &&
         p.y <= box.high.y && box.low.z <= p.z && p.z <= box.high.z;
}

TEST(ClusterTree, ItemsAreThoseGivenInAnotherOrder) {
  for (const size_t count : {0U, 1U, 4U, 5U, 300U}) {
    const auto patches = GeometryOf(RandomPatches(11, count, 5, 1));
    const auto items = MixedItems(count);
    const ClusterTree tree(patches, items);
    EXPECT_EQ(KeysOf(tree.Items()), KeysOf(items)) << count;
  }
}

TEST(ClusterTree, ChildrenShareOutTheItemsOfTheirParent) {
  const auto patches = GeometryOf(RandomPatches(12, 300, 5, 1));
  const ClusterTree tree(patches, MixedItems(300));
  const auto clusters = tree.Clusters();
  for (uint32_t i = 0; i < clusters.size(); ++i) {
    const Cluster& c = clusters[i];
    if (c.child == 0) {
      continue;
    }
    ASSERT_GT(c.child, i);
    const Cluster& left = clusters[c.child];
    const Cluster& right = clusters[c.child + 1];
    EXPECT_EQ(left.first, c.first);
    EXPECT_EQ(right.first, left.first + left.count);
    EXPECT_EQ(left.count + right.count, c.count);
    EXPECT_GT(std::min(left.count, right.count), 0U);
  }
}

TEST(ClusterTree, BoxesNormalsAndAreasBoundTheirItems) {
  const auto patches = GeometryOf(RandomPatches(14, 300, 5, 1));
  const ClusterTree tree(patches, MixedItems(300));
  for (const Cluster& c : tree.Clusters()) {
    float largest = 0;
    for (uint32_t k = c.first; k < c.first + c.count; ++k) {
      const ClusterItem item = tree.Items()[k];
      const PatchGeometry& patch = patches[item.patch];
      const Corners corners = CornersOf(patch, FrameOf(patches, item));
      for (const Vec3f p : corners.View()) {
        EXPECT_TRUE(Holds(c.box, p));
      }
      EXPECT_TRUE(Holds(c.normals, patch.normal));
      largest = std::max(largest, AreaOf(patch, FrameOf(patches, item)));
    }
    EXPECT_EQ(c.largest_area, largest);
  }
}

TEST(ClusterTree, LargestOfIsTheMaximumOverEachNode) {
  const auto patches = GeometryOf(RandomPatches(15, 200, 5, 1));
  const ClusterTree tree(patches, MixedItems(200));
  Random random(16);
  std::vector<float> values(tree.Items().size());
  for (float& v : values) {
    v = static_cast<float>(random.Next());
  }
  const std::vector<float> largest = tree.LargestOf(values);
  ASSERT_EQ(largest.size(), tree.Clusters().size());
  for (size_t i = 0; i < largest.size(); ++i) {
    const Cluster& c = tree.Clusters()[i];
    EXPECT_EQ(largest[i],
              *std::max_element(values.begin() + c.first,
                                values.begin() + c.first + c.count));
  }
}

TEST(ClusterTree, SizeStaysWithinWhatIsReservedForIt) {
  for (const size_t count : {0U, 1U, 5U, 100U, 5000U}) {
    const auto patches = GeometryOf(RandomPatches(17, count, 5, 1));
    const ClusterTree tree(patches, WholePatches(count));
    EXPECT_LE(tree.SizeBytes(), ClusterTree::BytesFor(count)) << count;
  }
}

// ------------------------------------------------------------------ BoundOf

// What two clusters really exchange, by random points of their items.
struct Seen {
  double kernel = 0;       // largest cos cos / (pi r^2), 1/m2
  double form_factor = 0;  // largest of a point of the receiver to an item
};

double KernelBetween(Vec3f x, Vec3f nx, Vec3f y, Vec3f ny) {
  const Vec3 d = {static_cast<double>(y.x) - static_cast<double>(x.x),
                  static_cast<double>(y.y) - static_cast<double>(x.y),
                  static_cast<double>(y.z) - static_cast<double>(x.z)};
  const Vec3 a = {nx.x, nx.y, nx.z};
  const Vec3 b = {ny.x, ny.y, ny.z};
  const double square = Dot(d, d);
  return std::max(0.0, Dot(d, a)) * std::max(0.0, -Dot(d, b)) /
         (kPi * square * square);
}

// One side of an exchange.
struct Side {
  const std::vector<PatchGeometry>& patches;
  const ClusterTree& tree;
};

Seen SampleTransfers(
    Side r, const Cluster& receiver, Side s, const Cluster& source, int tries) {
  Random random(MixKey(receiver.first, source.first));
  Seen seen;
  for (int i = 0; i < tries; ++i) {
    const ClusterItem ri =
        r.tree.Items()[receiver.first + random.NextBelow(receiver.count)];
    const ClusterItem si =
        s.tree.Items()[source.first + random.NextBelow(source.count)];
    const PatchGeometry& rp = r.patches[ri.patch];
    const PatchGeometry& sp = s.patches[si.patch];
    const ElementFrame sf = FrameOf(s.patches, si);
    const Vec3f x = RandomPointOn(rp, FrameOf(r.patches, ri), random);
    const Vec3f y = RandomPointOn(sp, sf, random);
    seen.kernel =
        std::max(seen.kernel, KernelBetween(x, rp.normal, y, sp.normal));
    const Corners corners = CornersOf(sp, sf);
    if (Dot(x - corners.points[0], sp.normal) > 0) {
      seen.form_factor = std::max(
          seen.form_factor,
          static_cast<double>(PointToPolygon(x, rp.normal, corners.View())));
    }
  }
  return seen;
}

// Compares all pairs of nodes of two trees; returns how many were `behind`.
size_t ExpectBoundsHold(Side r, Side s) {
  size_t behind = 0;
  for (const Cluster& receiver : r.tree.Clusters()) {
    for (const Cluster& source : s.tree.Clusters()) {
      const ClusterBound bound = BoundOf(receiver, source);
      const Seen seen = SampleTransfers(r, receiver, s, source, 40);
      if (bound.behind) {
        EXPECT_EQ(seen.kernel, 0);
        EXPECT_LE(seen.form_factor, kFloatRounding);
        ++behind;
        continue;
      }
      EXPECT_LE(seen.kernel,
                static_cast<double>(bound.per_area) * (1 + kFloatRounding));
      EXPECT_LE(seen.form_factor,
                static_cast<double>(bound.form_factor) + kFloatRounding);
      EXPECT_LE(seen.form_factor,
                static_cast<double>(bound.per_area * source.largest_area) *
                        (1 + kFloatRounding) +
                    kFloatRounding);
    }
  }
  return behind;
}

TEST(BoundOf, IsNeverBelowATransferBetweenScatteredPatches) {
  for (uint64_t seed = 0; seed < 4; ++seed) {
    const auto a = GeometryOf(RandomPatches(20 + seed, 24, 2, 0.7));
    auto moved = RandomPatches(30 + seed, 24, 2, 0.7);
    for (Patch& p : moved) {
      p.origin = p.origin + Vec3{static_cast<double>(seed), 0.5, 0};
    }
    const auto b = GeometryOf(moved);
    const ClusterTree at(a, MixedItems(a.size()));
    const ClusterTree bt(b, MixedItems(b.size()));
    ExpectBoundsHold({a, at}, {b, bt});
  }
}

// Small patches in the plane z = height, facing up or down.
std::vector<PatchGeometry> Tiles(double height, bool up) {
  std::vector<Patch> patches;
  for (int i = 0; i < 36; ++i) {
    Patch p;
    p.origin = {0.5 * (i % 6), 0.5 * (i / 6), height};
    p.u = up ? Vec3{0.5, 0, 0} : Vec3{0, 0.5, 0};
    p.v = up ? Vec3{0, 0.5, 0} : Vec3{0.5, 0, 0};
    patches.push_back(p);
  }
  return GeometryOf(patches);
}

TEST(BoundOf, IsNeverBelowATransferBetweenFloorAndCeiling) {
  const auto floor = Tiles(0, true);
  const auto ceiling = Tiles(0.6, false);
  const ClusterTree floors(floor, WholePatches(floor.size()));
  const ClusterTree ceilings(ceiling, WholePatches(ceiling.size()));
  EXPECT_EQ(ExpectBoundsHold({floor, floors}, {ceiling, ceilings}), 0U);
}

TEST(BoundOf, KnowsWhatLiesBehind) {
  const auto floor = Tiles(0, true);
  const auto upwards = Tiles(1, true);
  const auto downwards = Tiles(-1, false);
  const ClusterTree f(floor, WholePatches(floor.size()));
  const ClusterTree u(upwards, WholePatches(upwards.size()));
  const ClusterTree d(downwards, WholePatches(downwards.size()));
  EXPECT_TRUE(BoundOf(f.Clusters()[0], f.Clusters()[0]).behind);  // coplanar
  EXPECT_TRUE(BoundOf(f.Clusters()[0], u.Clusters()[0]).behind);  // its back
  EXPECT_TRUE(BoundOf(u.Clusters()[0], f.Clusters()[0]).behind);
  EXPECT_TRUE(BoundOf(f.Clusters()[0], d.Clusters()[0]).behind);
}

TEST(BoundOf, FallsWithTheSquareOfTheDistance) {
  const auto floor = Tiles(0, true);
  const ClusterTree f(floor, WholePatches(floor.size()));
  float last = 0;
  for (const double height : {20.0, 40.0, 80.0}) {
    const auto ceiling = Tiles(height, false);
    const ClusterTree c(ceiling, WholePatches(ceiling.size()));
    const float bound = BoundOf(f.Clusters()[0], c.Clusters()[0]).per_area;
    if (last > 0) {
      EXPECT_NEAR(last / bound, 4, 1e-3);
    }
    last = bound;
  }
}

}  // namespace
}  // namespace enfilade
