// Patches are cut where others stand or lie on them.

#include "partition/contact.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::Built;
using testing::kUp;
using testing::SceneBuilder;
using testing::Separate;

constexpr FaceId kFloorFace{0U};
constexpr Vec3 kEast{1, 0, 0};
constexpr Vec3 kNorth{0, 1, 0};

Patch Rectangle(FaceId face, Point3 origin, Vec3 u, Vec3 v) {
  Patch p;
  p.origin = origin;
  p.u = u;
  p.v = v;
  p.face = face;
  p.material = MaterialId(face.value);
  return p;
}

Patch Floor() {
  return Rectangle(kFloorFace, {0, 0, 0}, kEast * 4, kNorth * 3);
}

// The four walls, from the floor up, of a box without top and bottom.
std::vector<Patch> Walls(Point3 low, Vec3 size) {
  const Vec3 x = kEast * size.x;
  const Vec3 y = kNorth * size.y;
  const Vec3 z = kUp * size.z;
  return {Rectangle(FaceId(1U), low, x, z),
          Rectangle(FaceId(2U), low + x, y, z),
          Rectangle(FaceId(3U), low + x + y, -x, z),
          Rectangle(FaceId(4U), low + y, -y, z)};
}

std::vector<Patch> PartsOf(const std::vector<Patch>& patches, FaceId face) {
  std::vector<Patch> parts;
  std::copy_if(patches.begin(),
               patches.end(),
               std::back_inserter(parts),
               [face](const Patch& p) { return p.face == face; });
  return parts;
}

double AreaOf(const std::vector<Patch>& patches) {
  double area = 0;
  for (const Patch& p : patches) {
    area += PatchArea(p);
  }
  return area;
}

double EnclosedArea(const std::vector<Patch>& patches) {
  double area = 0;
  for (const Patch& p : patches) {
    area += p.is_enclosed ? PatchArea(p) : 0;
  }
  return area;
}

std::vector<Patch> FloorWith(const std::vector<Patch>& furniture) {
  std::vector<Patch> patches{Floor()};
  patches.insert(patches.end(), furniture.begin(), furniture.end());
  return patches;
}

// The rim of a box that stands on the floor crosses no patch of the floor.
TEST(Contact, CutsTheFloorAlongTheWallsOfABox) {
  auto patches = FloorWith(Walls({1, 1, 0}, {1, 0.5, 0.4}));
  EXPECT_EQ(CutAlongContacts(patches).cut, 1U);
  const std::vector<Patch> floor = PartsOf(patches, kFloorFace);
  EXPECT_EQ(floor.size(), 5U);
  EXPECT_NEAR(AreaOf(floor), 12, 1e-9);
  EXPECT_EQ(patches.size(), floor.size() + 4);
  // The box has no top, so the floor inside it is not enclosed.
  EXPECT_EQ(EnclosedArea(patches), 0);
}

TEST(Contact, WhatPartsTakeIsToldBeforeTheyDo) {
  auto patches = FloorWith(Walls({1, 1, 0}, {1, 0.5, 0.4}));
  uint64_t told = 0;
  CutAlongContacts(patches, [&told](uint64_t bytes) { told = bytes; });
  EXPECT_GE(told, patches.capacity() * sizeof(Patch));
}

TEST(Contact, LeavesTheFloorUnderALeg) {
  auto patches = FloorWith(Walls({1, 1, 0}, {0.05, 0.05, 0.4}));
  EXPECT_EQ(CutAlongContacts(patches).cut, 0U);
  EXPECT_EQ(patches.size(), 5U);
}

// Adds the back of each patch: a cell has both patches of a face.
std::vector<Patch> TwoSided(std::vector<Patch> patches) {
  for (size_t i = 0, n = patches.size(); i < n; ++i) {
    Patch back = patches[i];
    std::swap(back.u, back.v);
    patches.push_back(back);
  }
  return patches;
}

size_t FloorParts(std::vector<Patch> furniture) {
  std::vector<Patch> patches = FloorWith(furniture);
  CutAlongContacts(patches);
  return PartsOf(patches, kFloorFace).size();
}

// Rows of feet beside a cupboard.
std::vector<Patch> CupboardAndFeet(int feet) {
  std::vector<Patch> furniture = Walls({2.8, 1, 0}, {1, 0.8, 1});
  for (int i = 0; i < feet; ++i) {
    const std::vector<Patch> foot =
        Walls({0.1 + 0.33 * (i % 8), 0.1 + 0.5 * (i / 8), 0}, {0.28, 0.2, 0.4});
    furniture.insert(furniture.end(), foot.begin(), foot.end());
  }
  return furniture;
}

// Forty feet have more sides than the floor may have parts. Cuts along some of
// them would leave strips that are of no use to the other feet.
TEST(Contact, LeavesTheFloorUnderFeetThatAreTooMany) {
  const size_t cupboard = FloorParts(CupboardAndFeet(0));
  EXPECT_GT(cupboard, 1U);
  EXPECT_EQ(FloorParts(CupboardAndFeet(40)), cupboard);
  EXPECT_GT(FloorParts(CupboardAndFeet(8)), cupboard);
  EXPECT_EQ(FloorParts(TwoSided(CupboardAndFeet(8))),
            FloorParts(CupboardAndFeet(8)));
}

// The walls of a room stand on the rim of its floor, in however many pieces.
TEST(Contact, WhatStandsOnTheRimTakesNoParts) {
  std::vector<Patch> furniture = CupboardAndFeet(0);
  for (int i = 0; i < 100; ++i) {
    furniture.push_back(
        Rectangle(FaceId(1U), {0.04 * i, 0, 0}, kEast * 0.04, kUp * 2));
  }
  EXPECT_EQ(FloorParts(furniture), FloorParts(CupboardAndFeet(0)));
}

// A lamp lights the rim of a contact if the lamp is as near as the contact is
// long; a lamp on the ceiling does not count.
TEST(Contact, CutsTheFloorUnderALegBesideALamp) {
  Patch lamp = Rectangle(FaceId(9U), {1.1, 1, 0.02}, kEast * 0.03, kUp * 0.03);
  lamp.emits = true;
  std::vector<Patch> leg = Walls({1, 1, 0}, {0.05, 0.05, 0.4});
  leg.push_back(lamp);
  auto patches = FloorWith(leg);
  EXPECT_EQ(CutAlongContacts(patches).cut, 1U);
  EXPECT_NEAR(AreaOf(PartsOf(patches, kFloorFace)), 12, 1e-9);
  leg.back().origin.z = 2;
  patches = FloorWith(leg);
  EXPECT_EQ(CutAlongContacts(patches).cut, 0U);
}

// The cut leaves each part of the lamp wholly in front of the wall or wholly
// behind it.
TEST(Contact, CutsALampThatAWallGoesThrough) {
  Patch lamp = Rectangle(FaceId(9U), {1.1, 1, 0.02}, kEast * 0.03, kUp * 0.03);
  lamp.emits = true;
  lamp.reflects = false;
  std::vector<Patch> patches = {
      lamp, Rectangle(FaceId(1U), {1.12, 0, -1}, kNorth * 3, kUp * 3)};
  EXPECT_EQ(CutAlongContacts(patches).cut, 2U);
  EXPECT_EQ(PartsOf(patches, FaceId(9U)).size(), 2U);
}

// Each side of a round foot is short, but all of them together are not.
TEST(Contact, CutsAroundARoundFoot) {
  std::vector<Patch> foot;
  constexpr int kSides = 12;
  const auto corner = [](int i) {
    const double angle = 2 * kPi * i / kSides;
    return Point3{2 + 0.2 * std::cos(angle), 1.5 + 0.2 * std::sin(angle), 0};
  };
  for (int i = 0; i < kSides; ++i) {
    foot.push_back(
        Rectangle(FaceId(1U), corner(i), corner(i + 1) - corner(i), kUp * 0.1));
  }
  auto patches = FloorWith(foot);
  CutAlongContacts(patches);
  // The floor inside the foot consists of parts of its own.
  double inside = 0;
  for (const Patch& p : PartsOf(patches, kFloorFace)) {
    const bool is_inside =
        std::all_of(foot.begin(), foot.end(), [&p](const Patch& wall) {
          const auto depth = [&wall](Point3 at) {
            return -Dot(at - wall.origin, PatchNormal(wall));
          };
          return depth(p.origin) > -1e-6 && depth(p.origin + p.u) > -1e-6 &&
                 depth(p.origin + p.v) > -1e-6;
        });
    inside += is_inside ? PatchArea(p) : 0;
  }
  EXPECT_NEAR(inside, 0.5 * kSides * 0.04 * std::sin(2 * kPi / kSides), 1e-9);
}

constexpr int kBulbSides = 8;
constexpr double kBulbRadius = 0.012;

// The sides of a bulb that comes out of the floor.
std::vector<Patch> BulbAt(Point3 middle) {
  const auto corner = [&](int i) {
    const double angle = 2 * kPi * i / kBulbSides;
    return middle + kEast * (kBulbRadius * std::cos(angle)) +
           kNorth * (kBulbRadius * std::sin(angle));
  };
  std::vector<Patch> bulb;
  for (int i = 0; i < kBulbSides; ++i) {
    Patch side = Rectangle(
        FaceId(1U), corner(i), corner(i + 1) - corner(i), kUp * kBulbRadius);
    side.emits = true;
    bulb.push_back(side);
  }
  return bulb;
}

// The area of the patches whose middle lies within a bulb's rim.
double AreaWithin(const std::vector<Patch>& patches, Point3 bulb) {
  double area = 0;
  for (const Patch& p : patches) {
    const bool triangle = p.shape == PatchShape::kTriangle;
    const Point3 middle = p.origin + (p.u + p.v) / (triangle ? 3 : 2);
    area += Length(middle - bulb) < kBulbRadius ? PatchArea(p) : 0;
  }
  return area;
}

double FootOfBulb() {
  return 0.5 * kBulbSides * kBulbRadius * kBulbRadius *
         std::sin(2 * kPi / kBulbSides);
}

// A bulb is half sunk into a wall. Its light ends at its rim, which is made of
// sides of a few millimetres. The bulb's foot becomes parts of its own, and all
// parts except those near the foot are as large as possible.
TEST(Contact, CutsTheFootOfABulbOutOfAWall) {
  auto patches = FloorWith(BulbAt({2, 1.5, 0}));
  EXPECT_EQ(CutAlongContacts(patches).cut, 1U);
  const std::vector<Patch> floor = PartsOf(patches, kFloorFace);
  EXPECT_NEAR(AreaOf(floor), 12, 1e-9);
  EXPECT_LE(floor.size(), 40U);
  EXPECT_NEAR(AreaWithin(floor, {2, 1.5, 0}), FootOfBulb(), 1e-9);
  const auto largest = std::max_element(
      floor.begin(), floor.end(), [](const Patch& a, const Patch& b) {
        return PatchArea(a) < PatchArea(b);
      });
  EXPECT_GT(PatchArea(*largest), 5);
}

// The foot of every bulb is cut out, even under a ceiling full of downlights.
TEST(Contact, CutsTheFootOfEveryBulbOutOfAWall) {
  std::vector<Point3> middles;
  for (int i = 0; i < 8; ++i) {
    for (int k = 0; k < 6; ++k) {
      // The bulbs are not in straight rows, where their frames could share
      // lines.
      middles.push_back(
          {0.3 + 0.45 * i + 0.02 * k, 0.3 + 0.45 * k + 0.013 * i, 0});
    }
  }
  std::vector<Patch> bulbs;
  for (const Point3 middle : middles) {
    for (const Patch& side : BulbAt(middle)) {
      bulbs.push_back(side);
    }
  }
  auto patches = FloorWith(bulbs);
  EXPECT_EQ(CutAlongContacts(patches).cut, 1U);
  const std::vector<Patch> floor = PartsOf(patches, kFloorFace);
  EXPECT_NEAR(AreaOf(floor), 12, 1e-9);
  EXPECT_LE(floor.size(), 40 * middles.size());
  for (const Point3 middle : middles) {
    EXPECT_NEAR(AreaWithin(floor, middle), FootOfBulb(), 1e-9);
  }
}

// A luminaire may be larger, such as a tube in a white box without a top. If
// the boxes hold no lamps, so many of them are left to refinement, as are the
// feet of chairs.
TEST(Contact, CutsOutTheFootOfEveryLuminaire) {
  constexpr double kSize = 0.3;
  constexpr double kStep = 0.4;
  const auto parts_inside = [&](bool has_lamps) {
    std::vector<Patch> boxes;
    for (int i = 0; i < 9; ++i) {
      for (int k = 0; k < 7; ++k) {
        const Point3 low{0.1 + kStep * i, 0.1 + kStep * k, 0};
        for (const Patch& wall : Walls(low, {kSize, kSize, 0.1})) {
          boxes.push_back(wall);
        }
        boxes.push_back(Rectangle(FaceId(5U),
                                  low + Vec3{0.05, 0.14, 0.05},
                                  kEast * 0.2,
                                  kNorth * 0.02));
        boxes.back().emits = has_lamps;
      }
    }
    auto patches = FloorWith(boxes);
    CutAlongContacts(patches);
    const std::vector<Patch> floor = PartsOf(patches, kFloorFace);
    EXPECT_NEAR(AreaOf(floor), 12, 1e-9);
    return std::count_if(floor.begin(), floor.end(), [&](const Patch& p) {
      const Point3 low = p.origin;
      const Point3 high = p.origin + p.u + p.v;
      const double x = std::min(low.x, high.x) - 0.1;
      const double y = std::min(low.y, high.y) - 0.1;
      const double in_x = x - kStep * std::round(x / kStep);
      const double in_y = y - kStep * std::round(y / kStep);
      return std::abs(in_x) < 1e-9 && std::abs(in_y) < 1e-9 &&
             std::abs(PatchArea(p) - kSize * kSize) < 1e-9;
    });
  };
  EXPECT_EQ(parts_inside(true), 63);
  EXPECT_EQ(parts_inside(false), 0);
}

TEST(Contact, LeavesWhatStandsBehindOrApart) {
  // Below the floor; a centimetre above it; beside it.
  for (const Point3 low :
       {Point3{1, 1, -0.4}, Point3{1, 1, 0.01}, Point3{5, 1, 0}}) {
    auto patches = FloorWith(Walls(low, {1, 0.5, 0.4}));
    EXPECT_EQ(CutAlongContacts(patches).cut, 0U);
  }
}

TEST(Contact, CutsWhereSomethingGoesThrough) {
  auto patches = FloorWith(Walls({1, 1, -0.2}, {1, 0.5, 0.4}));
  CutAlongContacts(patches);
  EXPECT_EQ(PartsOf(patches, kFloorFace).size(), 5U);
}

// The wall behind the picture gets no light; the rest of the wall does.
TEST(Contact, EnclosesWhatIsCovered) {
  auto patches =
      FloorWith({Rectangle(FaceId(1U), {1, 1, 0}, kEast * 1, kNorth * 0.5)});
  Separate(patches);
  const ContactCounts counts = CutAlongContacts(patches);
  EXPECT_NEAR(counts.covered_m2, 0.5, 1e-9);
  const std::vector<Patch> floor = PartsOf(patches, kFloorFace);
  EXPECT_NEAR(AreaOf(floor), 12, 1e-9);
  EXPECT_NEAR(EnclosedArea(floor), 0.5, 1e-9);
  EXPECT_EQ(EnclosedArea(PartsOf(patches, FaceId(1U))), 0);
  EXPECT_TRUE(std::all_of(
      floor.begin(), floor.end(), [](const Patch& p) { return p.reflects; }));
}

// Light reaches into a joint of two millimetres, as between tiles.
TEST(Contact, EnclosesWhatIsAsGoodAsTouched) {
  const auto enclosed_below = [](double gap) {
    auto patches = FloorWith(
        {Rectangle(FaceId(1U), {1, 1, gap}, kNorth * 0.5, kEast * 1)});
    CutAlongContacts(patches);
    return EnclosedArea(PartsOf(patches, kFloorFace));
  };
  EXPECT_NEAR(enclosed_below(0.0009), 0.5, 1e-9);
  EXPECT_EQ(enclosed_below(0.002), 0);
}

// Light fills the gap before a lamp: neither the lamp nor what it shines on is
// covered, by the lamp's other side no more than by the lamp.
TEST(Contact, ALampCoversNothingThatItFaces) {
  for (const bool faces_down : {true, false}) {
    Patch lamp = Rectangle(FaceId(1U), {1, 1, 5e-4}, kEast * 1, kNorth * 0.5);
    Patch back = lamp;
    (faces_down ? lamp : back).u = kNorth * 0.5;
    (faces_down ? lamp : back).v = kEast * 1;
    lamp.emits = true;
    back.is_back = true;
    auto patches = FloorWith({lamp, back});
    CutAlongContacts(patches);
    for (const Patch& p : PartsOf(patches, FaceId(1U))) {
      EXPECT_FALSE(p.emits && p.is_enclosed);
    }
    EXPECT_NEAR(
        EnclosedArea(PartsOf(patches, kFloorFace)), faces_down ? 0 : 0.5, 1e-9);
  }
}

// The door covers all of the floor except a rim that is not worth a part.
TEST(Contact, EnclosesAsAWholeWhatIsCoveredAsAWhole) {
  Patch door =
      Rectangle(FaceId(1U), {5e-4, 5e-4, 0}, kEast * 3.999, kNorth * 2.999);
  door.emits = true;  // so that it is not the same face twice
  auto patches = FloorWith({door});
  Separate(patches);
  CutAlongContacts(patches);
  ASSERT_EQ(patches.size(), 2U);
  EXPECT_TRUE(patches[0].is_enclosed);
  EXPECT_FALSE(patches[1].is_enclosed);
}

TEST(Contact, PartsOfATwinAreTwins) {
  Patch floor = Floor();
  Patch below = floor;
  std::swap(below.u, below.v);
  below.is_twin = true;
  std::vector<Patch> patches = {floor, below};
  for (const Patch& wall : Walls({1, 1, -0.4}, {1, 0.5, 0.4})) {
    patches.push_back(wall);
  }
  CutAlongContacts(patches);
  size_t twins = 0;
  for (const Patch& p : PartsOf(patches, kFloorFace)) {
    EXPECT_EQ(p.is_twin, PatchNormal(p).z < 0);
    twins += p.is_twin ? 1 : 0;
  }
  EXPECT_EQ(twins, 5U);
}

// A cupboard stands on the floor of a room; the whole partition finds that the
// floor under the cupboard is dark.
TEST(Contact, TheFloorUnderACupboardIsEnclosed) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {4, 3, 2.5}});
  scene.AddSolid({{1, 1, 0}, {2, 1.5, 1.5}});
  const Built built(scene);
  const CellPatches cell = LoadCellPatches(*built.store, built.At({3, 2, 1}));
  double dark_floor = 0;
  double floor = 0;
  for (const Patch& p : cell.patches) {
    if (PatchNormal(p).z > 0.9 && p.origin.z < 1e-9) {
      floor += PatchArea(p);
      dark_floor += p.is_enclosed ? PatchArea(p) : 0;
    }
  }
  EXPECT_NEAR(floor, 12, 1e-9);
  EXPECT_NEAR(dark_floor, 0.5, 1e-9);
}

}  // namespace
}  // namespace enfilade
