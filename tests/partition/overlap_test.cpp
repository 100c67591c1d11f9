// Where patches lie in one another and face the same way, one of them is kept.

#include "partition/overlap.h"

#include "base/error.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "base/random.h"
#include "partition/overlap_pairs.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "tests/cpu_time.h"
#include "tests/memory_peak.h"
#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::Built;
using testing::kUp;
using testing::SceneBuilder;
using testing::Separate;

Patch Rectangle(uint32_t face, Point3 origin, Vec3 u, Vec3 v) {
  Patch p;
  p.origin = origin;
  p.u = u;
  p.v = v;
  p.face = FaceId(face);
  p.material = MaterialId(face);
  return p;
}

Patch Turned(Patch p) {
  std::swap(p.u, p.v);
  p.is_back = !p.is_back;
  return p;
}

// Faces of surfaces of these sizes, of no solid.
std::vector<FaceFacts> Faces(const std::vector<float>& surfaces_m2) {
  std::vector<FaceFacts> faces;
  for (const float area : surfaces_m2) {
    faces.push_back({area, 0});
  }
  return faces;
}

// The coordinates of a point in the plane of a patch, in units of its edges.
std::pair<double, double> Within(const Patch& patch, Point3 p) {
  const Vec3 d = p - patch.origin;
  const double uu = Dot(patch.u, patch.u);
  const double uv = Dot(patch.u, patch.v);
  const double vv = Dot(patch.v, patch.v);
  const double det = uu * vv - uv * uv;
  const double du = Dot(d, patch.u);
  const double dv = Dot(d, patch.v);
  return {(vv * du - uv * dv) / det, (uu * dv - uv * du) / det};
}

bool Covers(const Patch& patch, Point3 p, Vec3 facing) {
  if (Dot(PatchNormal(patch), facing) < 0.99 ||
      std::abs(Dot(p - patch.origin, PatchNormal(patch))) > 10 * kApartM) {
    return false;
  }
  const auto [s, t] = Within(patch, p);
  const bool inside = s >= 0 && t >= 0;
  return inside &&
         (patch.shape == PatchShape::kTriangle ? s + t <= 1 : s <= 1 && t <= 1);
}

// Whether the point is so near to the rim of a patch that rounding decides.
bool IsNearRim(const Patch& patch, Point3 p) {
  const auto [s, t] = Within(patch, p);
  const double size = std::min(Length(patch.u), Length(patch.v));
  const double margin = 1e-3 / size;
  const auto near = [&](double x) { return std::abs(x) < margin; };
  return near(s) || near(t) ||
         (patch.shape == PatchShape::kTriangle ? near(1 - s - t)
                                               : near(1 - s) || near(1 - t));
}

std::vector<const Patch*> Covering(const std::vector<Patch>& patches,
                                   Point3 p,
                                   Vec3 facing) {
  std::vector<const Patch*> found;
  for (const Patch& patch : patches) {
    if (Covers(patch, p, facing)) {
      found.push_back(&patch);
    }
  }
  return found;
}

// How far a patch was moved out of the plane z = 0.
double Height(const Patch& patch) {
  return Dot(patch.origin - Point3{}, kUp);
}

// The covering patch that is seen from far out along `facing`.
const Patch* Seen(const std::vector<const Patch*>& covering, Vec3 facing) {
  const auto height = [&](const Patch* p) {
    return Dot(p->origin - Point3{}, facing);
  };
  const auto it = std::max_element(
      covering.begin(), covering.end(), [&](const Patch* a, const Patch* b) {
        return height(a) < height(b);
      });
  return it == covering.end() ? nullptr : *it;
}

TEST(Overlap, PairsOfManyInOnePlaceAreNotHeldAtOnce) {
#ifndef ENFILADE_JEMALLOC
  GTEST_SKIP() << "sanitizers keep what is freed";
#endif
  constexpr size_t kCount = 2000;  // 80 MB of pairs
  std::vector<Patch> patches;
  for (uint32_t i = 0; i < kCount; ++i) {
    patches.push_back(Rectangle(i, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  }
  const uint64_t before = BeginPeak();
  EXPECT_EQ(Separate(patches).dropped, kCount - 1);
  EXPECT_EQ(patches.size(), 1U);
  EXPECT_LT(PeakResidentBytes() - before, 16U << 20);
}

TEST(Overlap, ManyInOnePlaceAreNotComparedEachWithEach) {
  constexpr uint32_t kCount = 1000;
  std::vector<Patch> many;
  for (uint32_t i = 0; i < kCount; ++i) {
    many.push_back(Rectangle(i, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  }
  const double separating = CpuSecondsOf([&] {
    std::vector<Patch> patches = many;
    EXPECT_EQ(Separate(patches).dropped, kCount - 1);
  });
  const double comparing = CpuSecondsOf([&] {
    for (uint32_t i = 0; i < kCount; ++i) {
      for (uint32_t k = 0; k < i; ++k) {
        EXPECT_TRUE(PairOf(i, k, many));
      }
    }
  });
  EXPECT_LT(separating, comparing);
}

TEST(Overlap, PiecesOfManyInOnePlaceAreCharged) {
  // Each patch leaves a rim of every patch behind it.
  std::vector<Patch> patches;
  for (uint32_t i = 0; i < 300; ++i) {
    const double at = 1e-3 * i;
    patches.push_back(Rectangle(i, {at, at, 0}, {1, 0, 0}, {0, 1, 0}));
  }
  MemoryBudget budget(1U << 16);
  EXPECT_THROW(SeparateOverlaps(patches, testing::FactsOf(patches), budget),
               DoesNotFitError);
  EXPECT_EQ(patches.size(), 300U);
}

TEST(Overlap, WhatDoesNotOverlapIsUntouched) {
  // A floor of tiles, a ceiling a millimetre above, and the floor's backs.
  std::vector<Patch> patches;
  for (uint32_t i = 0; i < 5; ++i) {
    const double x = i;
    patches.push_back(Rectangle(i, {x, 0, 0}, {1, 0, 0}, {0, 1, 0}));
    patches.push_back(Turned(patches.back()));
    patches.push_back(Rectangle(i + 5, {x, 0, 1e-3}, {1, 0, 0}, {0, 1, 0}));
  }
  const std::vector<Patch> before = patches;
  const OverlapCounts counts = Separate(patches);
  EXPECT_EQ(counts.dropped + counts.moved, 0U);
  ASSERT_EQ(patches.size(), before.size());
  for (size_t i = 0; i < patches.size(); ++i) {
    EXPECT_EQ(patches[i].origin, before[i].origin);
    EXPECT_EQ(patches[i].face, before[i].face);
  }
}

TEST(Overlap, WhatIsThereTwiceIsKeptOnce) {
  std::vector<Patch> patches = {
      Rectangle(1, {0, 0, 0}, {2, 0, 0}, {0, 3, 0}),
      Rectangle(2, {0, 0, 1e-5}, {2, 0, 0}, {0, 3, 0})};
  const OverlapCounts counts = Separate(patches);
  EXPECT_EQ(counts.dropped, 1U);
  EXPECT_NEAR(counts.area_m2, 6, 1e-9);
  ASSERT_EQ(patches.size(), 1U);
  EXPECT_EQ(patches[0].face, FaceId(1U));
}

// Walls whose corners are slightly off: rays from the wall behind would end at
// the back of the dropped patch or at that of the other one.
TEST(Overlap, OfWhatIsThereTwiceTheOneInFrontIsSeen) {
  for (const double rise : {1.5e-4, -1.5e-4}) {
    std::vector<Patch> patches = {
        Rectangle(1, {0, 0, 0}, {4, 0, 0}, {0, 3, 0}),
        Rectangle(2, {1, 1, rise}, {1, 0, 0}, {0, 1, 0})};
    patches[1].material = patches[0].material;
    Separate(patches);
    const Patch* seen = Seen(Covering(patches, {1.5, 1.5, 0}, kUp), kUp);
    ASSERT_NE(seen, nullptr);
    EXPECT_EQ(seen->face, FaceId(rise > 0 ? 2U : 1U));
    EXPECT_GE(Height(*seen), rise);
  }
}

TEST(Overlap, WallsOfOneMaterialAreCutToFit) {
  std::vector<Patch> patches = {Rectangle(1, {0, 0, 0}, {4, 0, 0}, {0, 3, 0}),
                                Rectangle(2, {3, 0, 0}, {2, 0, 0}, {0, 3, 0})};
  patches[1].material = patches[0].material;
  const OverlapCounts counts = Separate(patches);
  EXPECT_NEAR(counts.area_m2, 3, 1e-9);
  EXPECT_EQ(counts.moved, 0U);
  double area = 0;
  for (const Patch& p : patches) {
    area += PatchArea(p);
    EXPECT_EQ(Height(p), 0);
  }
  EXPECT_NEAR(area, 15, 1e-9);
}

// A picture hangs on the wall, or the back of a cupboard lies in the wall. The
// back is seen from inside the cupboard; otherwise the wall's light would get
// into the cupboard.
TEST(Overlap, TheSmallerIsSeen) {
  const Patch wall = Rectangle(1, {0, 0, 0}, {4, 0, 0}, {0, 3, 0});
  for (const bool is_back : {false, true}) {
    Patch small = Rectangle(2, {1, 1, 0}, {1, 0, 0}, {0, 1, 0});
    small.is_back = is_back;
    std::vector<Patch> patches = {small, wall};
    const OverlapCounts counts = Separate(patches);
    EXPECT_EQ(counts.moved, 1U);
    ASSERT_EQ(patches.size(), 2U);
    EXPECT_NEAR(Height(patches[0]), kApartM, 1e-12);
    EXPECT_EQ(patches[0].layer, 1);
    EXPECT_EQ(Height(patches[1]), 0);
    EXPECT_EQ(patches[1].layer, 0);
  }
}

// A face of several patches is compared as a whole: a smaller one that covers
// one of them is no duplicate.
TEST(Overlap, TheSmallerIsSeenOnALargerFaceOfManyPatches) {
  std::vector<Patch> patches = {
      Rectangle(0, {0, 0, 0}, {3, 0, 0}, {0, 3, 0}),
      Rectangle(0, {3, 0, 0}, {3, 0, 0}, {0, 3, 0}),
      Rectangle(1, {0, 0, 0}, {3.5, 0, 0}, {0, 3, 0}),
  };
  Separate(patches);
  for (const double x : {0.5, 2.5, 3.25, 4.5}) {
    const auto covering = Covering(patches, {x, 1.5, 0}, kUp);
    ASSERT_FALSE(covering.empty()) << x;
    EXPECT_EQ(Seen(covering, kUp)->face, FaceId(x < 3.5 ? 1U : 0U)) << x;
  }
}

// A floor of slabs, each an object of its own, and a carpet that is larger than
// any of them.
TEST(Overlap, SlabsThatTouchAreOneSurface) {
  std::vector<Patch> patches;
  for (uint32_t i = 0; i < 6; ++i) {
    patches.push_back(
        Rectangle(i, {2.0 * (i % 3), 2.0 * (i / 3), 0}, {2, 0, 0}, {0, 2, 0}));
    patches.back().material = MaterialId(0U);
  }
  patches.push_back(Rectangle(9, {0.5, 0.5, 0}, {5, 0, 0}, {0, 3, 0}));
  Separate(patches);
  for (const double x : {0.7, 2.5, 5.3}) {
    for (const double y : {0.7, 2.5}) {
      const auto covering = Covering(patches, {x, y, 0}, kUp);
      ASSERT_FALSE(covering.empty()) << x << " " << y;
      EXPECT_EQ(Seen(covering, kUp)->face, FaceId(9U)) << x << " " << y;
    }
  }
}

// Slabs of 8 m2 that are there twice: by their area they lie before a sheet
// that is 12 m2 large elsewhere, and by twice that area they would lie behind
// it.
TEST(Overlap, ASurfaceThatIsThereTwiceCountsOnce) {
  std::vector<Patch> patches;
  for (uint32_t i = 0; i < 4; ++i) {
    patches.push_back(
        Rectangle(i, {2.0 * (i % 2), 0, 0}, {2, 0, 0}, {0, 2, 0}));
    patches.back().material = MaterialId(0U);
  }
  patches.push_back(Rectangle(4, {0, 0, 0}, {4, 0, 0}, {0, 2, 0}));
  MemoryBudget budget(uint64_t{1} << 30);
  SeparateOverlaps(patches, Faces({4, 4, 4, 4, 12}), budget);
  EXPECT_EQ(Seen(Covering(patches, {1, 1, 0}, kUp), kUp)->material,
            MaterialId(0U));
}

// A sheet of 0.1 mm, a box of two faces and narrow sides: the inside of either
// face looks the way that the outside of the other does. It was put before that
// outside, and the sheet was dark.
TEST(Overlap, TheInsideOfASheetGoes) {
  for (const bool on_floor : {false, true}) {
    constexpr double kThin = 1e-4;
    Patch top = Rectangle(0, {0, 0, kThin}, {1, 0, 0}, {0, 1, 0});
    Patch bottom = Turned(Rectangle(1, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
    bottom.is_back = false;
    top.material = bottom.material = MaterialId(0U);
    std::vector<Patch> patches = {top, Turned(top), bottom, Turned(bottom)};
    patches[1].is_enclosed = patches[3].is_enclosed = true;
    std::vector<FaceFacts> faces = {{1, 7}, {1, 7}};
    if (on_floor) {
      patches.push_back(Rectangle(2, {-1, -1, 0}, {3, 0, 0}, {0, 3, 0}));
      faces.push_back({9, 0});
    }
    MemoryBudget budget(uint64_t{1} << 30);
    SeparateOverlaps(patches, faces, budget);
    EXPECT_TRUE(std::none_of(patches.begin(),
                             patches.end(),
                             [](const Patch& p) { return p.is_enclosed; }));
    const Patch* const seen = Seen(Covering(patches, {0.5, 0.5, 0}, kUp), kUp);
    ASSERT_NE(seen, nullptr);
    EXPECT_EQ(seen->face, FaceId(0U));
    const Patch* const below =
        Seen(Covering(patches, {0.5, 0.5, 0}, -kUp), -kUp);
    ASSERT_NE(below, nullptr);
    EXPECT_EQ(below->face, FaceId(1U));
  }
}

// The inside of one box stays before the outside of another that it stands on.
TEST(Overlap, TheInsideOfABoxStaysBeforeAnotherSolid) {
  Patch inside = Rectangle(0, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  inside.is_back = inside.is_enclosed = true;
  std::vector<Patch> patches = {
      inside, Rectangle(1, {-1, -1, 0}, {3, 0, 0}, {0, 3, 0})};
  MemoryBudget budget(uint64_t{1} << 30);
  SeparateOverlaps(patches, std::vector<FaceFacts>{{1, 7}, {9, 8}}, budget);
  EXPECT_TRUE(Seen(Covering(patches, {0.5, 0.5, 0}, kUp), kUp)->is_enclosed);
}

// The end of a long wall reaches into a cell, and a cupboard's back, larger
// than that end, lies in its plane.
TEST(Overlap, AWallIsAsLargeAsItIsElsewhere) {
  std::vector<Patch> patches = {
      Rectangle(0, {0, 0, 0}, {0.5, 0, 0}, {0, 3, 0}),
      Rectangle(1, {0, 0, 0}, {2, 0, 0}, {0, 1, 0}),
  };
  MemoryBudget budget(uint64_t{1} << 30);
  SeparateOverlaps(patches, Faces({20, 2}), budget);
  EXPECT_EQ(Seen(Covering(patches, {0.2, 0.5, 0}, kUp), kUp)->face, FaceId(1U));
}

// The finish of a room's floor on a slab that goes on below other rooms: in
// this cell both have the same outline.
TEST(Overlap, AFaceThatIsSmallerElsewhereIsSeen) {
  for (const std::vector<float>& face_areas :
       {std::vector<float>{40, 9}, std::vector<float>{9, 40}}) {
    std::vector<Patch> patches = {
        Rectangle(0, {0, 0, 0}, {3, 0, 0}, {0, 3, 0}),
        Rectangle(1, {0, 0, 0}, {3, 0, 0}, {0, 3, 0}),
    };
    MemoryBudget budget(uint64_t{1} << 30);
    SeparateOverlaps(patches, Faces(face_areas), budget);
    EXPECT_EQ(Seen(Covering(patches, {1, 1, 0}, kUp), kUp)->face,
              FaceId(face_areas[0] < face_areas[1] ? 0U : 1U));
  }
}

// The walls of two rooms that are each a box of their own: a front in one place
// with the back of the other room's wall. Either may go on along other rooms of
// the same paint.
TEST(Overlap, OfOneOutlineTheFrontIsSeenAndWhatReflects) {
  const Patch front = Rectangle(0, {0, 0, 0}, {3, 0, 0}, {0, 3, 0});
  Patch back = Rectangle(1, {0, 0, 0}, {3, 0, 0}, {0, 3, 0});
  back.is_back = true;
  Patch black = back;
  black.reflects = false;
  for (const Patch& other : {back, black}) {
    for (const std::vector<float>& face_areas :
         {std::vector<float>{9, 9}, {9, 90}, {90, 9}}) {
      for (const bool first : {true, false}) {
        std::vector<Patch> patches = {front, other};
        std::swap(patches[0].face, patches[first ? 0 : 1].face);
        const FaceId wanted = patches[0].face;
        MemoryBudget budget(uint64_t{1} << 30);
        SeparateOverlaps(patches, Faces(face_areas), budget);
        EXPECT_EQ(Seen(Covering(patches, {1, 1, 0}, kUp), kUp)->face, wanted);
      }
    }
  }
}

// The same face twice, however each of the two was cut.
TEST(Overlap, OneOutlineOfManyPatchesIsKeptOnce) {
  std::vector<Patch> patches = {
      Rectangle(0, {0, 0, 0}, {3, 0, 0}, {0, 3, 0}),
      Rectangle(0, {3, 0, 0}, {3, 0, 0}, {0, 3, 0}),
      Rectangle(1, {0, 0, 0}, {6, 0, 0}, {0, 3, 0}),
  };
  Separate(patches);
  for (const double x : {0.5, 2.5, 3.5, 5.5}) {
    EXPECT_EQ(Covering(patches, {x, 1.5, 0}, kUp).size(), 1U) << x;
  }
}

// Tiles lie in a floor, each in the previous one, and a carpet lies above them
// all: nothing comes through the carpet, however near and however many the
// tiles are.
TEST(Overlap, WhatLiesJustAboveStaysAbove) {
  for (const int tiles : {1, 2, 3, 5}) {
    for (const double gap : {3e-4, 5e-4, 1e-3, 2e-3}) {
      std::vector<Patch> patches = {
          Rectangle(1, {0, 0, 0}, {9, 0, 0}, {0, 9, 0})};
      for (int i = 0; i < tiles; ++i) {
        const double size = 8 - i;
        patches.push_back(Rectangle(static_cast<uint32_t>(2 + i),
                                    {0.5, 0.5, 0},
                                    {size, 0, 0},
                                    {0, size, 0}));
      }
      patches.push_back(Rectangle(99, {1, 1, gap}, {7.6, 0, 0}, {0, 7.6, 0}));
      const size_t count = patches.size();
      Separate(patches);
      ASSERT_EQ(patches.size(), count);
      const double carpet = Height(patches.back());
      EXPECT_GE(carpet, gap);
      EXPECT_LE(carpet, gap + (tiles + 1) * kApartM);
      for (int i = 1; i <= tiles; ++i) {
        EXPECT_GE(carpet - Height(patches[static_cast<size_t>(i)]),
                  kApartM / 2 - 1e-12)
            << tiles << " tiles, " << gap;
      }
    }
  }
}

// A patch that lies far enough above another stays where it is.
TEST(Overlap, WhatLiesFarEnoughAboveIsUntouched) {
  const Patch floor = Rectangle(1, {0, 0, 0}, {9, 0, 0}, {0, 9, 0});
  const Patch tile = Rectangle(2, {1, 1, 0}, {1, 0, 0}, {0, 1, 0});
  const Patch above = Rectangle(3, {1, 1, 8e-4}, {1, 0, 0}, {0, 1, 0});
  const Patch beside = Rectangle(4, {4, 4, 3e-4}, {1, 0, 0}, {0, 1, 0});
  std::vector<Patch> patches = {floor, tile, above, beside};
  EXPECT_EQ(Separate(patches).moved, 1U);
  EXPECT_EQ(Height(patches[2]), 8e-4);
  EXPECT_EQ(Height(patches[3]), 3e-4);
}

TEST(Overlap, OnlyWhatLiesInAnotherIsMoved) {
  // A board that sticks out over the edge of a wall by half.
  std::vector<Patch> patches = {Rectangle(1, {0, 0, 0}, {4, 0, 0}, {0, 3, 0}),
                                Rectangle(2, {3, 1, 0}, {2, 0, 0}, {0, 1, 0})};
  Separate(patches);
  const auto inside = Covering(patches, {3.4, 1.6, 0}, kUp);
  ASSERT_EQ(inside.size(), 2U);
  EXPECT_EQ(Seen(inside, kUp)->face, FaceId(2U));
  const auto outside = Covering(patches, {4.4, 1.6, 0}, kUp);
  ASSERT_EQ(outside.size(), 1U);
  EXPECT_EQ(Height(*outside[0]), 0);
}

// A board lies half on a floor, with a sheet on each half: one sheet lies on
// the moved part of the board, the other does not.
TEST(Overlap, WhatLiesOnTheUnmovedPartOfAnotherIsMovedOnce) {
  const Patch floor = Rectangle(1, {0, 0, 0}, {9, 0, 0}, {0, 9, 0});
  const Patch board = Rectangle(2, {7, 1, 0}, {4, 0, 0}, {0, 2, 0});
  const Patch over_floor = Rectangle(3, {7.5, 1.5, 0}, {1, 0, 0}, {0, 1, 0});
  const Patch outside = Rectangle(4, {9.5, 1.5, 0}, {1, 0, 0}, {0, 1, 0});
  std::vector<Patch> patches = {floor, over_floor, outside, board};
  Separate(patches);
  ASSERT_EQ(patches.size(), 5U);
  EXPECT_EQ(patches[1].layer, 2);
  EXPECT_EQ(patches[2].layer, 1);
}

TEST(Overlap, WhatEmitsIsSeenHoweverLarge) {
  for (const double size : {0.5, 2.0, 8.0}) {
    Patch lamp = Rectangle(2, {0, 0, 0}, {size, 0, 0}, {0, size, 0});
    lamp.emits = true;
    std::vector<Patch> patches = {Rectangle(1, {0, 0, 0}, {2, 0, 0}, {0, 2, 0}),
                                  lamp};
    Separate(patches);
    const auto at = Covering(patches, {0.3, 0.2, 0}, kUp);
    ASSERT_FALSE(at.empty());
    EXPECT_TRUE(Seen(at, kUp)->emits) << size;
  }
}

TEST(Overlap, SidesThatCameApartBlockRaysEach) {
  const Patch wall = Rectangle(1, {0, 0, 0}, {4, 0, 0}, {0, 3, 0});
  const Patch front = Rectangle(2, {1, 1, 0}, {1, 0, 0}, {0, 1, 0});
  Patch back = Turned(front);
  back.is_twin = true;
  std::vector<Patch> patches = {wall, front, back};
  Separate(patches);
  ASSERT_EQ(patches.size(), 3U);
  EXPECT_FALSE(patches[2].is_twin);
}

// A heap of rectangles and triangles in one tilted plane.
class Heap {
 public:
  explicit Heap(uint64_t seed) : random_(seed) {
    for (uint32_t i = 0; i < 5; ++i) {
      patches_.push_back(DrawPatch(i));
      if (random_.Next() < 0.5) {
        patches_.push_back(Turned(patches_.back()));
        patches_.back().emits = false;
      }
    }
  }

  [[nodiscard]] const std::vector<Patch>& Patches() const { return patches_; }

  // A point of the plane that is off the rims of all patches.
  Point3 DrawPoint() {
    while (true) {
      const Point3 p = Point3{} + kA * Draw(-1, 3.5) + kB * Draw(-1, 3.5);
      if (std::none_of(patches_.begin(), patches_.end(), [&](const Patch& q) {
            return IsNearRim(q, p);
          })) {
        return p;
      }
    }
  }

  inline static const Vec3 kA = Normalize(Vec3{1, 0.3, 0.2});
  inline static const Vec3 kB = Normalize(Cross({-0.2, 0.1, 1}, kA));
  inline static const Vec3 kNormal = Cross(kA, kB);

 private:
  double Draw(double low, double high) {
    return low + (high - low) * random_.Next();
  }

  Patch DrawPatch(uint32_t face) {
    const double turn = Draw(0, kPi);
    const Vec3 u = kA * std::cos(turn) + kB * std::sin(turn);
    const Vec3 v = Cross(kNormal, u);
    Patch p = Rectangle(face,
                        Point3{} + kA * Draw(0, 2) + kB * Draw(0, 2),
                        u * Draw(0.2, 1.5),
                        v * Draw(0.2, 1.5) + u * Draw(-0.2, 0.2));
    p.material = MaterialId(random_.NextBelow(3));
    p.shape = random_.Next() < 0.5 ? PatchShape::kTriangle
                                   : PatchShape::kParallelogram;
    p.emits = random_.Next() < 0.1;
    p.is_back = !p.emits && random_.Next() < 0.4;
    return p;
  }

  Random random_;
  std::vector<Patch> patches_;
};

// Of the patches that covered a point, one is seen: one that emits, if any did.
void CheckOneIsSeen(const std::vector<const Patch*>& was,
                    const std::vector<const Patch*>& is,
                    Vec3 facing) {
  ASSERT_EQ(is.empty(), was.empty());
  if (was.empty()) {
    return;
  }
  const Patch* const seen = Seen(is, facing);
  EXPECT_EQ(seen->emits,
            std::any_of(was.begin(), was.end(), [](const Patch* w) {
              return w->emits;
            }));
  for (const Patch* other : is) {
    EXPECT_TRUE(other == seen ||
                Dot(seen->origin - other->origin, facing) > kCoincidentM);
  }
}

// The rule itself: no covered point is lost, and the right patch is seen there.
TEST(Overlap, OneIsSeenAtEveryPoint) {
  int looked = 0;
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    Heap heap(seed);
    std::vector<Patch> after = heap.Patches();
    Separate(after);
    for (int k = 0; k < 400; ++k) {
      const Point3 p = heap.DrawPoint();
      for (const Vec3 facing : {Heap::kNormal, -Heap::kNormal}) {
        const auto was = Covering(heap.Patches(), p, facing);
        CheckOneIsSeen(was, Covering(after, p, facing), facing);
        looked += was.empty() ? 0 : 1;
      }
    }
  }
  EXPECT_GT(looked, 1000);
}

// The whole partition is built from two boxes that share a wall, each written
// with all six sides.
TEST(Overlap, BoxesThatTouchKeepOneWallPerSide) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {2, 2, 2}});
  scene.AddBox({{2, 0, 0}, {4, 2, 2}});
  const Built built(scene);
  const auto walls_at = [&](Point3 inside, Vec3 facing) {
    const CellPatches cell = LoadCellPatches(*built.store, built.At(inside));
    return Covering(cell.patches, {2, 0.7, 0.9}, facing).size();
  };
  EXPECT_EQ(walls_at({1, 1, 1}, {-1, 0, 0}), 1U);
  EXPECT_EQ(walls_at({3, 1, 1}, {1, 0, 0}), 1U);
}

// A carpet passes a shaft in the floor. It is larger than the piece of the
// floor below it, and smaller than the floor.
TEST(Overlap, APieceOfASurfaceCountsAsTheWholeSurface) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, -1}, {6, 4, 2}});
  scene.AddWithHole({2, 0, 0, 0, 6, 4}, {2, 0, 2.5, 1.5, 3.5, 2.5});
  scene.Add({2, 0, 0.2, 0.1, 5.8, 1.4}, MaterialId(1U));
  const Built built(scene);
  const CellPatches cell = LoadCellPatches(*built.store, built.At({3, 3, 1}));
  for (const double x : {0.5, 3.0, 5.5}) {
    const auto covering = Covering(cell.patches, {x, 0.7, 0}, kUp);
    ASSERT_FALSE(covering.empty()) << x;
    EXPECT_EQ(Seen(covering, kUp)->material, MaterialId(1U)) << x;
  }
}

}  // namespace
}  // namespace enfilade
