// Groups of patches that emit alike: which there are, and what they send.

#include "solver/transfer/source_group.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/solver/test_bulbs.h"
#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::Append;
using test::BoxPatches;
using test::Bulb;
using test::GeometryOf;
using test::kRoom;

std::vector<PatchGeometry> RoomWith(const std::vector<Patch>& lamps) {
  std::vector<Patch> patches = BoxPatches(kRoom, true);
  Append(patches, lamps);
  return GeometryOf(patches);
}

TEST(SourceGroups, ABulbIsOne) {
  const auto patches = RoomWith(Bulb({2, 2, 2}, 0.05, 6));
  const SourceGroups groups(patches);
  ASSERT_EQ(groups.Roots().size(), 1U);
  const SourceGroup& bulb = groups.All()[groups.Roots()[0]];
  EXPECT_EQ(bulb.count, patches.size() - 6);
  for (uint32_t i = 0; i < patches.size(); ++i) {
    EXPECT_EQ(groups.Holds(i), i >= 6);
  }
}

TEST(SourceGroups, BulbsApartAreTwo) {
  std::vector<Patch> lamps = Bulb({1, 2, 2}, 0.05, 4);
  Append(lamps, Bulb({3, 2, 2}, 0.05, 4));
  const SourceGroups groups(RoomWith(lamps));
  EXPECT_EQ(groups.Roots().size(), 2U);
}

TEST(SourceGroups, BulbsOfTwoMaterialsAreTwo) {
  std::vector<Patch> lamps = Bulb({2, 2, 2}, 0.05, 4);
  auto patches = RoomWith(lamps);
  for (size_t i = 6; i < patches.size(); i += 2) {
    patches[i].material = MaterialId(1U);
  }
  EXPECT_EQ(SourceGroups(patches).Roots().size(), 2U);
}

TEST(SourceGroups, FewPatchesAreNone) {
  std::vector<Patch> lamps = BoxPatches({{2, 2, 2}, {2.1, 2.1, 2.1}}, false);
  lamps.resize(3);
  for (Patch& p : lamps) {
    p.emits = true;
  }
  EXPECT_TRUE(SourceGroups(RoomWith(lamps)).All().empty());
}

// A room that glows is not lit by lamps.
TEST(SourceGroups, GlowingRoomsHaveNone) {
  std::vector<Patch> patches = BoxPatches(kRoom, true);
  Append(patches, Bulb({2, 2, 2}, 0.5, 4));
  for (Patch& p : patches) {
    p.emits = true;
  }
  EXPECT_TRUE(SourceGroups(GeometryOf(patches)).All().empty());
}

TEST(SourceGroups, HalvesShareWhatTheirGroupHas) {
  std::vector<Patch> lamps = Bulb({1, 2, 2}, 0.05, 6);
  Append(lamps, Bulb({3, 2, 2}, 0.02, 4));
  const auto patches = RoomWith(lamps);
  const SourceGroups groups(patches);
  size_t halved = 0;
  for (const SourceGroup& group : groups.All()) {
    if (group.child == 0) {
      continue;
    }
    const SourceGroup& a = groups.All()[group.child];
    const SourceGroup& b = groups.All()[group.child + 1];
    EXPECT_EQ(a.first, group.first);
    EXPECT_EQ(b.first, a.first + a.count);
    EXPECT_EQ(a.count + b.count, group.count);
    EXPECT_NEAR(a.area + b.area, group.area, 1e-5F * group.area);
    ++halved;
  }
  EXPECT_GT(halved, 10U);
  EXPECT_LE(groups.SizeBytes(), SourceGroups::BytesFor(patches.size()));
}

TEST(SourceGroups, SendTheMeanOfTheirPatches) {
  const auto patches = RoomWith(Bulb({2, 2, 2}, 0.05, 4));
  const SourceGroups groups(patches);
  const SourceGroup& bulb = groups.All()[groups.Roots()[0]];
  const Basis basis(2);
  CellTree tree({&basis, kRgbChannels}, patches);
  double flux = 0;
  double squared = 0;
  for (const uint32_t i : groups.PatchesOf(bulb)) {
    const float b = 100 + static_cast<float>(i % 7);
    for (size_t g = 0; g < basis.On(patches[i].shape).NodeCount(); ++g) {
      tree.Sent()[ElementId(i)][g] = b;  // the first channel
    }
    const auto area = static_cast<double>(patches[i].area);
    flux += area * static_cast<double>(b);
    squared += area * static_cast<double>(b * b);
  }
  const GroupRadiosity seen =
      GroupRadiosityOf(groups, bulb, patches, tree.Shape(), tree.Sent());
  const auto area = static_cast<double>(bulb.area);
  const double mean = flux / area;
  EXPECT_NEAR(static_cast<double>(seen.mean[0]), mean, 1e-4 * mean);
  EXPECT_EQ(seen.mean[1], 0);
  EXPECT_NEAR(static_cast<double>(seen.spread),
              std::sqrt(squared / area - mean * mean),
              1e-2);
}

}  // namespace
}  // namespace enfilade
