// Rays never contradict a proof that a shaft is empty, and easy proofs are
// found.

#include "solver/transfer/shaft.h"

#include "partition/polygon.h"
#include "solver/elements/element_tree.h"
#include "solver/transfer/blockers.h"
#include "solver/transfer/form_factor.h"
#include "solver/transfer/transfer_sample.h"

#include <memory>

#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::Append;
using test::BoxPatches;
using test::GeometryOf;
using test::RandomPatches;
using test::RandomPointOn;

// Segments that leave their surfaces at a smaller angle may hit these very
// surfaces (visibility/occlusion.cpp).
constexpr float kSteep = 1.0F / 25;

// Blockers, as rays and as shafts see them.
class BlockerModel {
 public:
  explicit BlockerModel(const std::vector<Patch>& patches)
      : budget_(1ULL << 30),
        device_(budget_, Point3{}),
        geometry_(GeometryOf(patches)),
        shaft_(geometry_) {
    CellPatches cell;
    cell.bounds = {{-100, -100, -100}, {100, 100, 100}};
    cell.patches = patches;
    ray_blockers_ = device_.Build(cell);
  }

  [[nodiscard]] const std::vector<PatchGeometry>& Patches() const {
    return geometry_;
  }

  [[nodiscard]] bool Proves(const PatchGeometry& r,
                            ElementFrame rf,
                            const PatchGeometry& s,
                            ElementFrame sf) const {
    return shaft_.LeaveEmpty(Shaft(EndsOf(r, rf, s, sf)));
  }

  // How many of 16 random segments between points that face each other are
  // blocked.
  [[nodiscard]] int BlockedOf16(const TransferEnd& r,
                                const TransferEnd& s,
                                Random& random) const {
    SegmentPacket packet{};
    for (int i = 0; i < 16; ++i) {
      const PointPair points = {RandomPointOn(*r.patch, r.frame, random),
                                RandomPointOn(*s.patch, s.frame, random)};
      const Vec3f d = points.y - points.x;
      const float least = kSteep * Length(d);
      if (Dot(d, r.patch->normal) > least && -Dot(d, s.patch->normal) > least) {
        AddSegment(points, &packet);
      }
    }
    const RayBlockers* const blockers[] = {ray_blockers_.get()};
    return packet.count == 0 ? 0
                             : __builtin_popcount(Occluded(blockers, packet));
  }

 private:
  MemoryBudget budget_;
  OcclusionDevice device_;
  std::vector<PatchGeometry> geometry_;
  ShaftBlockers shaft_;
  std::shared_ptr<const RayBlockers> ray_blockers_;
};

ElementFrame RandomElement(PatchShape shape, Random& random) {
  ElementPath path = kRootPath;
  for (uint32_t level = random.NextBelow(4); level > 0; --level) {
    path = ChildPath(path, random.NextBelow(kChildren));
  }
  return FrameOfPath(shape, path);
}

struct Tally {
  int proofs = 0;
  int blocked_pairs = 0;
};

// Checks elements of the given ends against the blockers: no ray may contradict
// a proof.
Tally ExpectNoContradiction(const BlockerModel& scenery,
                            const std::vector<PatchGeometry>& ends,
                            int pairs,
                            uint64_t seed) {
  Random random(seed);
  Tally tally;
  const auto count = static_cast<uint32_t>(ends.size());
  for (int i = 0; i < pairs; ++i) {
    const PatchGeometry& rp = ends[random.NextBelow(count)];
    const PatchGeometry& sp = ends[random.NextBelow(count)];
    const TransferEnd r = MakeTransferEnd(rp, RandomElement(rp.shape, random));
    const TransferEnd s = MakeTransferEnd(sp, RandomElement(sp.shape, random));
    const int blocked = scenery.BlockedOf16(r, s, random);
    const bool proven = scenery.Proves(rp, r.frame, sp, s.frame);
    if (proven) {
      EXPECT_EQ(blocked, 0) << "seed " << seed << ", pair " << i;
    }
    tally.proofs += proven ? 1 : 0;
    tally.blocked_pairs += blocked > 0 ? 1 : 0;
  }
  return tally;
}

TEST(Shaft, ProofsHoldBetweenTheBlockersThemselves) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const BlockerModel scenery(RandomPatches(seed, 60, 4, 0.5));
    const Tally tally =
        ExpectNoContradiction(scenery, scenery.Patches(), 2000, seed);
    EXPECT_GT(tally.proofs, 100);
    EXPECT_GT(tally.blocked_pairs, 20);
  }
}

TEST(Shaft, ProofsHoldBetweenOthersThroughTheBlockers) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const BlockerModel scenery(RandomPatches(100 + seed, 200, 4, 0.3));
    const auto ends = GeometryOf(RandomPatches(200 + seed, 100, 4, 0.3));
    const Tally tally = ExpectNoContradiction(scenery, ends, 2000, seed);
    EXPECT_GT(tally.proofs, 100);
    EXPECT_GT(tally.blocked_pairs, 20);
  }
}

// A room with boxes that stand on its floor and against its walls: patches
// share edges and planes, as real ones do.
std::vector<Patch> RoomWithBoxes(uint64_t seed) {
  Random random(seed);
  std::vector<Patch> patches = BoxPatches({{0, 0, 0}, {4, 4, 3}}, true);
  for (int i = 0; i < 8; ++i) {
    const Point3 low = {3.2 * random.Next(), 3.2 * random.Next(), 0};
    const Vec3 size = {0.2 + 0.6 * random.Next(),
                       0.2 + 0.6 * random.Next(),
                       0.1 + random.Next()};
    Append(patches, BoxPatches({low, low + size}, false));
  }
  return patches;
}

TEST(Shaft, ProofsHoldInFurnishedRooms) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const BlockerModel scenery(RoomWithBoxes(seed));
    const Tally tally =
        ExpectNoContradiction(scenery, scenery.Patches(), 2000, seed);
    EXPECT_GT(tally.proofs, 100);
    EXPECT_GT(tally.blocked_pairs, 20);
  }
}

TEST(Shaft, EveryShaftInABareRoomIsEmpty) {
  const BlockerModel room(BoxPatches(test::kRoom, true));
  for (const PatchGeometry& r : room.Patches()) {
    for (const PatchGeometry& s : room.Patches()) {
      EXPECT_TRUE(room.Proves(r, {}, s, {}));
    }
  }
}

TEST(Shaft, NothingBlocksWithoutBlockers) {
  const BlockerModel nothing({});
  const auto ends = GeometryOf(RandomPatches(3, 2, 2, 1));
  EXPECT_TRUE(nothing.Proves(ends[0], {}, ends[1], {}));
}

TEST(Shaft, WhatStandsBetweenOrBesideIsToldApart) {
  const auto ends =
      GeometryOf({test::Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                  test::Rectangle({0, 0, 2}, {0, 1, 0}, {1, 0, 0})});
  const auto proves = [&](Point3 corner) {
    const BlockerModel blocker(
        {test::Rectangle(corner, {0.2, 0, 0}, {0, 0.2, 0})});
    return blocker.Proves(ends[0], {}, ends[1], {});
  };
  EXPECT_FALSE(proves({0.4, 0.4, 1}));
  EXPECT_TRUE(proves({1.4, 0.4, 1}));    // beside
  EXPECT_TRUE(proves({0.4, 0.4, 2.5}));  // above the source
  EXPECT_TRUE(proves({0.4, 0.4, -1}));   // below the receiver
}

// The blocker stands within the box around both ends, beside the hull.
TEST(Shaft, WhatStandsBesideTheDiagonalIsNotBetween) {
  const auto ends =
      GeometryOf({test::Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                  test::Rectangle({9, 0, 5}, {0, 0, 1}, {0, 1, 0})});
  const auto proves = [&](Point3 corner) {
    const BlockerModel blocker(
        BoxPatches({corner, corner + Vec3{0.5, 1, 0.5}}, false));
    return blocker.Proves(ends[0], {}, ends[1], {});
  };
  EXPECT_FALSE(proves({4, 0, 2.5}));
  EXPECT_TRUE(proves({7, 0, 1}));
  EXPECT_TRUE(proves({1, 0, 4}));
}

TEST(Shaft, PartsOfAWallSeePastABoxThatHidesTheRest) {
  std::vector<Patch> patches = BoxPatches({{0, 0, 0}, {4, 4, 3}}, true);
  Append(patches, BoxPatches({{1, 1, 1}, {1.5, 1.5, 2}}, false));
  const BlockerModel room(patches);
  const PatchGeometry& floor = room.Patches()[0];
  const PatchGeometry& ceiling = room.Patches()[1];
  EXPECT_FALSE(room.Proves(floor, {}, ceiling, {}));
  const ElementFrame far = {0.5F, 0.5F, 0.5F};  // the quarter off the box
  EXPECT_TRUE(room.Proves(floor, far, ceiling, far));
}

// A wall lies a tenth of a millimetre behind an opening, like the wall of a
// bathroom above its tiles. The wall is too near for rays to tell it from a
// surface in the opening, but all of the wall's light comes through the
// opening.
TEST(Shaft, AnOpeningJustBeforeAWallLetsLightThrough) {
  const auto opening =
      GeometryOf({test::Rectangle({0, 0, 0}, {0, 1, 0}, {0, 0, 1})});
  const auto wall_at = [](double x) {
    return GeometryOf({test::Rectangle({x, 0, 0}, {0, 1, 0}, {0, 0, 1}),
                       test::Rectangle({2, 0, 0}, {0, 0, 1}, {0, 1, 0})});
  };
  const ShaftBlockers portals(opening, BlockerKind::kPortals);
  const ShaftBlockers surfaces(opening);
  const auto let_through = [&](const ShaftBlockers& by, double x) {
    const auto ends = wall_at(x);
    return !by.LeaveEmpty(Shaft(EndsOf(ends[0], {}, ends[1], {}))) &&
           !by.LeaveEmpty(Shaft(EndsOf(ends[1], {}, ends[0], {})));
  };
  EXPECT_TRUE(let_through(portals, -1));
  EXPECT_TRUE(let_through(portals, -1e-4));
  EXPECT_TRUE(let_through(portals, -4e-5));
  EXPECT_TRUE(let_through(portals, 0));  // it cannot be told on which side
  EXPECT_FALSE(let_through(portals, 1e-3));
  EXPECT_FALSE(let_through(surfaces, -9e-5));
}

// A floor is a little folded in two halves. The opening in the plane of one
// half closes a wedge over the other half; where the halves meet, the wedge is
// thinner than any rounding. All light of the elements there comes through the
// opening.
TEST(Shaft, AnOpeningOverAThinWedgeLetsLightThrough) {
  const auto opening =
      GeometryOf({test::Rectangle({0, 0, 0}, {10, 0, 0}, {0, 10, 0})});
  const auto ends =
      GeometryOf({test::Rectangle({0, 0, 0}, {10, 0, -1e-4}, {0, 10, 0}),
                  test::Rectangle({0, 0, 3}, {0, 10, 0}, {10, 0, 0})});
  const ShaftBlockers portals(opening, BlockerKind::kPortals);
  for (float scale = 1; scale > 0.01F; scale /= 2) {
    const Shaft shaft(EndsOf(ends[0], {0, 0, scale}, ends[1], {}));
    EXPECT_FALSE(portals.LeaveEmpty(shaft)) << scale;
  }
}

// A floor a little in front of an opening counts as lying in the opening's
// plane: the floor's cell is below, and all its light comes through the
// opening.
TEST(Shaft, AnElementThatSticksOutOfAnOpeningIsLitThroughIt) {
  const auto opening =
      GeometryOf({test::Rectangle({0, 0, 0}, {10, 0, 0}, {0, 10, 0})});
  const ShaftBlockers portals(opening, BlockerKind::kPortals);
  Blockers between;
  between.gates = {&portals};
  const auto is_lit = [&](double height) {
    const auto ends =
        GeometryOf({test::Rectangle({2, 2, height}, {1, 0, 0}, {0, 1, 0}),
                    test::Rectangle({0, 0, 3}, {0, 10, 0}, {10, 0, 0})});
    return !between.Separate(EndsOf(ends[0], {}, ends[1], {})) &&
           !between.Separate(EndsOf(ends[1], {}, ends[0], {}));
  };
  EXPECT_TRUE(is_lit(-kOnPlaneM));
  EXPECT_TRUE(is_lit(0));
  EXPECT_TRUE(is_lit(kOnPlaneM));
  EXPECT_FALSE(is_lit(2 * kOnPlaneM));  // it is another cell's floor then
}

// A wall in the plane of a door beside it gets nothing through the door.
TEST(Shaft, AnOpeningBesideAWallLetsNothingThrough) {
  const auto opening =
      GeometryOf({test::Rectangle({0, 0, 0}, {0, 1, 0}, {0, 0, 1})});
  const auto ends =
      GeometryOf({test::Rectangle({0, 1.1, 0}, {0, 1, 0}, {0, 0, 1}),
                  test::Rectangle({2, -1, 0}, {0, 0, 1}, {0, 3, 0})});
  const ShaftBlockers portals(opening, BlockerKind::kPortals);
  EXPECT_TRUE(portals.LeaveEmpty(Shaft(EndsOf(ends[0], {}, ends[1], {}))));
  EXPECT_TRUE(portals.LeaveEmpty(Shaft(EndsOf(ends[1], {}, ends[0], {}))));
}

// A patch that lay in another surface was moved in front of that surface, and
// so may stand beyond an opening in front of both.
TEST(Shaft, WhatWasPutBeforeAnOpeningIsLitThroughIt) {
  const auto opening =
      GeometryOf({test::Rectangle({0, 0, 0}, {0, 1, 0}, {0, 0, 1})});
  const ShaftBlockers portals(opening, BlockerKind::kPortals);
  Patch picture =
      test::Rectangle({-1e-4 + kApartM, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const auto lamp =
      GeometryOf({test::Rectangle({2, 0, 0}, {0, 0, 1}, {0, 1, 0})});
  const auto is_lit = [&] {
    const auto own = GeometryOf({picture});
    Box box;
    box.Add(lamp[0].origin);
    box.Add(lamp[0].origin + lamp[0].u + lamp[0].v);
    Blockers between;
    between.gates = {&portals};
    const bool by_group = !between.Separate(EndsOf(own[0], {}, box));
    EXPECT_EQ(by_group, !between.Separate(EndsOf(own[0], {}, lamp[0], {})));
    EXPECT_EQ(by_group, !between.Separate(EndsOf(lamp[0], {}, own[0], {})));
    return by_group;
  };
  EXPECT_FALSE(is_lit());
  picture.layer = 1;
  EXPECT_TRUE(is_lit());
}

// All shadows are added up, however the blockers are grouped; so are those of
// triangles, which are kept with a corner repeated.
TEST(ShaftBlockers, AddUpAllShadows) {
  Random random(11);
  const auto blockers = GeometryOf(RandomPatches(12, 300, 4, 0.3));
  const ShaftBlockers shaft(blockers);
  int several = 0;
  for (int i = 0; i < 200; ++i) {
    const auto ends = GeometryOf({test::RandomPatch(random, 4, 1)});
    const TransferEnd receiver = MakeTransferEnd(ends[0], {});
    const CastShadow shadow(receiver, receiver.center + ends[0].normal * 2.0F);
    uint64_t fronts = 0;
    uint64_t backs = 0;
    int casting = 0;
    for (const PatchGeometry& blocker : blockers) {
      const Corners corners = CornersOf(blocker, {});
      const uint32_t share = shadow.ShareOf(corners.View());
      Box box;
      for (const Vec3f p : corners.View()) {
        box.Add(p);
      }
      EXPECT_TRUE(share == 0 || !shadow.Misses(box));
      (shadow.IsLit(blocker.origin, blocker.normal) ? fronts : backs) += share;
      casting += share > 0 ? 1 : 0;
    }
    const ShadowSum sum = shaft.SumOfShadows(shadow, UINT64_MAX);
    // A repeated corner may round a share down by one.
    EXPECT_NEAR(static_cast<double>(sum.of_fronts),
                static_cast<double>(fronts),
                casting);
    EXPECT_NEAR(
        static_cast<double>(sum.of_backs), static_cast<double>(backs), casting);
    several += casting > 1 ? 1 : 0;
    const uint64_t enough = sum.Larger() / 2;
    EXPECT_GE(shaft.SumOfShadows(shadow, enough).Larger(), enough);
  }
  EXPECT_GT(several, 50);
}

}  // namespace
}  // namespace enfilade
