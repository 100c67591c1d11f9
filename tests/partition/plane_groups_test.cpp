// Planes less than a millimetre apart belong to one wall, in whatever order
// they come.

#include "partition/plane_groups.h"

#include "base/error.h"
#include "base/random.h"

#include <algorithm>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr Vec3 kAcross{1, 0, 0};

// The planes of the tiles, of ten centimetres each, of an oblique wall whose
// corners are rounded to doubles at map coordinates.
std::vector<Plane> PlanesOfFarTiles(Point3 center) {
  constexpr size_t kTiles = 12;
  const Vec3 along = Normalize(Vec3{0.8660254037844387, 0.5, 0});
  const auto corner = [&](size_t i, double z) {
    return center + along * (0.1 * static_cast<double>(i)) + Vec3{0, 0, z};
  };
  std::vector<Plane> planes;
  for (size_t i = 0; i < kTiles; ++i) {
    planes.push_back(PlaneOf(
        {corner(i, 0), corner(i + 1, 0), corner(i + 1, 1), corner(i, 1)}));
  }
  return planes;
}

class PlaneGroupsTest : public ::testing::Test {
 protected:
  std::unique_ptr<PlaneGroups> GroupsOf(const std::vector<Plane>& planes,
                                        Point3 center = {}) {
    auto groups = std::make_unique<PlaneGroups>(center, budget_);
    for (const Plane& plane : planes) {
      groups->Add(plane, 1);
    }
    groups->Number();
    return groups;
  }

  MemoryBudget budget_{1U << 30};
};

TEST_F(PlaneGroupsTest, BothSidesOfAPlaneAreOneGroup) {
  const Plane plane{kAcross, 3};
  const auto groups = GroupsOf({plane});
  EXPECT_EQ(groups->Of(plane), groups->Of(plane.Flipped()));
}

TEST_F(PlaneGroupsTest, OtherNormalsAndOtherPlacesAreOtherGroups) {
  const auto groups = GroupsOf(
      {{kAcross, 3}, {kAcross, 3.0011}, {{0, 1, 0}, 3}, {kAcross, 3.0005}});
  EXPECT_NE(groups->Of({kAcross, 3}), groups->Of({{0, 1, 0}, 3}));
  // The last plane is near both of the first two.
  EXPECT_EQ(groups->Of({kAcross, 3}), groups->Of({kAcross, 3.0011}));
  const auto apart = GroupsOf({{kAcross, 3}, {kAcross, 3.0011}});
  EXPECT_NE(apart->Of({kAcross, 3}), apart->Of({kAcross, 3.0011}));
}

// Compares with groups made by sorting all planes.
TEST_F(PlaneGroupsTest, TheOrderOfPlanesDoesNotCount) {
  constexpr size_t kPlanes = 2000;
  Random random(7);
  std::vector<Plane> planes;
  for (size_t i = 0; i < kPlanes; ++i) {
    planes.push_back({kAcross, 1.5 * random.Next()});
  }
  const auto groups = GroupsOf(planes);
  std::sort(planes.begin(), planes.end(), [](const Plane& a, const Plane& b) {
    return a.offset < b.offset;
  });
  uint32_t number = 0;
  for (size_t i = 0; i < kPlanes; ++i) {
    if (i > 0 && planes[i].offset - planes[i - 1].offset >= 1e-3) {
      ++number;
    }
    ASSERT_EQ(groups->Of(planes[i]), number) << i;
  }
  EXPECT_GT(number, 100U);
  EXPECT_LT(number, kPlanes / 2);
}

TEST_F(PlaneGroupsTest, AnObliqueWallInMapCoordinatesIsOneGroup) {
  const Point3 center{430'000.3, 5'400'000.7, 120.1};
  const std::vector<Plane> planes = PlanesOfFarTiles(center);
  const auto groups = GroupsOf(planes, center);
  for (const Plane& plane : planes) {
    EXPECT_EQ(groups->Of(plane), 0U);
  }
}

TEST_F(PlaneGroupsTest, GroupsAreChargedAndPlanesAreNot) {
  PlaneGroups groups({}, budget_);
  groups.Add({kAcross, 0}, 1);
  const uint64_t of_one = budget_.UsedBytes();
  EXPECT_GT(of_one, 0U);
  for (int i = 0; i < 1000; ++i) {
    groups.Add({kAcross, 0}, 1);
  }
  EXPECT_EQ(budget_.UsedBytes(), of_one);
  groups.Add({kAcross, 1}, 1);
  EXPECT_GT(budget_.UsedBytes(), of_one);
  MemoryBudget none(of_one - 1);
  PlaneGroups refused({}, none);
  EXPECT_THROW(refused.Add({kAcross, 0}, 1), DoesNotFitError);
}

}  // namespace
}  // namespace enfilade
