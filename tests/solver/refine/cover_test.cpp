// Covers are found where something stands and are searched for nowhere else.

#include "solver/refine/cover.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::Append;
using test::BoxPatches;
using test::GeometryOf;

constexpr double kRoomEdge = 4;  // m, the edge of the floor; patch 0
constexpr Box3 kRoomBox = {{0, 0, 0}, {kRoomEdge, kRoomEdge, 3}};

void Fill(std::span<float> coefficients, float value) {
  std::fill(coefficients.begin(), coefficients.end(), value);
}

// A cell with the covers found on it. All patches reflect 1 W/m2 unless another
// light is given.
class CoveredCell {
 public:
  using Light = std::function<void(std::span<const PatchGeometry>, CellTree*)>;

  CoveredCell(std::vector<Patch> patches,
              double tau,
              uint64_t seed = 5,
              size_t most_receivers = SIZE_MAX,
              const Light& light = {})
      : budget_(1ULL << 30),
        device_(budget_, Point3{}),
        geometry_(GeometryOf(patches)),
        clusters_(geometry_, WholePatches(geometry_.size())) {
    CellPatches cell;
    cell.bounds = kRoomBox;
    cell.patches = std::move(patches);
    const auto blockers = device_.Build(cell);
    CoverOptions options;
    options.tau = tau;
    options.seed = seed;
    options.most_receivers = most_receivers;
    const Basis basis(2);
    CellTree tree({&basis, kRgbChannels}, geometry_);
    for (size_t i = 0; i < tree.Size(); ++i) {
      Fill(tree.Sent()[ElementId(i)], 1);
    }
    if (light) {
      light(geometry_, &tree);
    }
    tree.UpdateDetail();
    const SurfaceTable black;
    const ReflectedLight reflected(tree, geometry_, black, {});
    covers_ = FindCovers(
        options,
        {CellId(0U), geometry_, &clusters_, blockers.get(), &reflected});
  }

  [[nodiscard]] const std::vector<PatchGeometry>& Geometry() const {
    return geometry_;
  }

  [[nodiscard]] const Covers& Found() const { return covers_; }

  // The receivers on one patch.
  [[nodiscard]] std::vector<ElementFrame> Leaves(uint32_t patch) const {
    std::vector<ElementFrame> leaves;
    for (const ClusterItem& item : covers_.receivers) {
      if (item.patch == patch) {
        leaves.push_back(FrameOfPath(geometry_[patch].shape, item.path));
      }
    }
    return leaves;
  }

 private:
  MemoryBudget budget_;
  OcclusionDevice device_;
  std::vector<PatchGeometry> geometry_;
  ClusterTree clusters_;
  Covers covers_;
};

std::vector<Patch> BareRoom() {
  return BoxPatches(kRoomBox, true);
}

// A plinth on the floor, too low and narrow for a view out from under it.
constexpr Box3 kPlinth = {{1.3, 2.1, 0}, {1.6, 2.4, 0.1}};

std::vector<Patch> RoomWithPlinth() {
  std::vector<Patch> patches = BareRoom();
  Append(patches, BoxPatches(kPlinth, false));
  return patches;
}

// The part of a leaf of the floor that the plinth covers.
double CoveredShare(ElementFrame leaf) {
  const auto overlap = [&](double from, double low, double high) {
    const double width = kRoomEdge * static_cast<double>(leaf.scale);
    return std::max(0.0, std::min(from + width, high) - std::max(from, low)) /
           width;
  };
  return overlap(kRoomEdge * static_cast<double>(leaf.a),
                 kPlinth.low.x,
                 kPlinth.high.x) *
         overlap(kRoomEdge * static_cast<double>(leaf.b),
                 kPlinth.low.y,
                 kPlinth.high.y);
}

double LeafArea(ElementFrame leaf) {
  return kRoomEdge * kRoomEdge * static_cast<double>(leaf.scale * leaf.scale);
}

TEST(Cover, BareRoomHasNone) {
  // In the corner between two walls half of the directions are blocked: one
  // point in 2^16 is mistaken for covered.
  const CoveredCell cell(BareRoom(), 0.2);
  ASSERT_EQ(cell.Found().receivers.size(), 6U);
  for (const ClusterItem& item : cell.Found().receivers) {
    EXPECT_EQ(item.path, kRootPath);
  }
}

TEST(Cover, BareRoomIsLookedAtInStripsAlongItsEdgesOnly) {
  const CoveredCell cell(BareRoom(), 0.2);
  // There is one point per 8 cm2 of the four strips of 0.05 m along the edges
  // of each of six walls, of at most 4 m. At least half of all directions are
  // free there, so a point takes 2 rays on the average, with a variance of 2 at
  // most; 5 standard deviations are added.
  const double points = 6 * 4 * kRoomEdge * 0.05 / 8e-4;
  EXPECT_GT(cell.Found().rays, 0U);
  EXPECT_LE(static_cast<double>(cell.Found().rays),
            2 * points + 5 * std::sqrt(2 * points));
}

// Half of a floor under a slab: a few points say that it has to be split.
TEST(Cover, WhatIsClearTakesFewRays) {
  std::vector<Patch> patches = {BareRoom()[0]};
  patches.push_back(
      test::Rectangle({0, 0, 0.02}, {0, kRoomEdge, 0}, {kRoomEdge / 2, 0, 0}));
  patches.back().reflects = false;
  // A tau at which the halves are not looked at.
  const double whole = 0.5 * kRoomEdge;
  const CoveredCell cell(patches, 0.6 * whole);
  EXPECT_EQ(cell.Leaves(0).size(), 4U);
  // The slab is widened to a little more than the half, for which 256 points
  // would be tested, and nearly all of them by 24 rays.
  EXPECT_GE(cell.Found().rays, 16U * 24);
  EXPECT_LE(cell.Found().rays, 256U * 24 / 2);
}

TEST(Cover, BesideATriangleNothingIsCovered) {
  Patch triangle = BareRoom()[0];
  triangle.u = {2, 0, 0};
  triangle.v = {0, 2, 0};
  triangle.shape = PatchShape::kTriangle;
  std::vector<Patch> patches = {triangle};
  Append(patches, BoxPatches({{1.7, 1.7, 0}, {1.9, 1.9, 0.1}}, false));
  EXPECT_EQ(CoveredCell(patches, 0.001).Leaves(0).size(), 1U);
}

TEST(Cover, FreeHangingThingsOutOfReachCostNoRays) {
  std::vector<Patch> floor = {BareRoom()[0]};
  Append(floor, BoxPatches({{1, 1, 0.5}, {2, 2, 1}}, false));
  const CoveredCell cell(floor, 0.01);
  EXPECT_EQ(cell.Leaves(0).size(), 1U);
  floor.resize(1);
  EXPECT_EQ(CoveredCell(floor, 0.01).Found().rays, 0U);
}

TEST(Cover, BoxOnTheFloorIsFound) {
  const double tau = 0.05;
  const CoveredCell cell(RoomWithPlinth(), tau);
  const auto leaves = cell.Leaves(0);
  EXPECT_GT(leaves.size(), 4U);
  double covered = 0;
  for (const ElementFrame leaf : leaves) {
    const double share = CoveredShare(leaf);
    const double error = std::sqrt(share * (1 - share) * LeafArea(leaf));
    // The bound is 2 tau because the share is sampled. If the error is 2 tau,
    // the share is (2 tau)^2 / area or more, which is at least 12 points at one
    // per 8 cm2; the error passes for tau only if 3 or fewer of them were hit.
    EXPECT_LE(error, 2 * tau) << leaf.a << " " << leaf.b << " " << leaf.scale;
    covered += share > 0.5 ? LeafArea(leaf) : 0;
  }
  // The leaves that are mostly covered make up the footprint.
  EXPECT_NEAR(covered, 0.3 * 0.3, 0.3 * 0.3 * 0.5);
}

// Lights the square metre of the floor that the plinth stands on with `inside`,
// and the rest of the floor with `outside`.
CoveredCell::Light LightAboutThePlinth(float inside, float outside) {
  return [=](std::span<const PatchGeometry> patches, CellTree* tree) {
    ElementPath path = kRootPath;
    const float share[] = {1 / 16.0F, 1 / 4.0F, 1};
    for (size_t level = 0;; ++level) {
      const ElementId on_the_way =
          tree->FindOrCreate(PatchId(0U), path, patches);
      Fill(tree->Sent()[on_the_way],
           inside * share[level] + outside * (1 - share[level]));
      if (level == 2) {
        return;
      }
      const auto holds_plinth = [&](size_t c) {
        return CoveredShare(FrameOfPath(patches[0].shape, ChildPath(path, c))) >
               0;
      };
      size_t inner = 0;
      for (size_t c = 0; c < kChildren; ++c) {
        Fill(tree->Sent()[tree->FindOrCreate(
                 PatchId(0U), ChildPath(path, c), patches)],
             outside);
        inner = holds_plinth(c) ? c : inner;
      }
      path = ChildPath(path, inner);
    }
  };
}

// Weighed by the mean light of the floor, the plinth's edges would be an error
// of only 0.02.
TEST(Cover, IsFoundInTheOneBrightPlaceOfADarkPatch) {
  const double tau = 0.05;
  const CoveredCell cell(
      RoomWithPlinth(), tau, 5, SIZE_MAX, LightAboutThePlinth(1, 0));
  for (const ElementFrame leaf : cell.Leaves(0)) {
    const double share = CoveredShare(leaf);
    EXPECT_LE(std::sqrt(share * (1 - share) * LeafArea(leaf)), 2 * tau)
        << leaf.a << " " << leaf.b << " " << leaf.scale;
  }
}

TEST(Cover, IsNotSplitInTheOneDarkPlaceOfABrightPatch) {
  const CoveredCell cell(
      RoomWithPlinth(), 0.05, 5, SIZE_MAX, LightAboutThePlinth(0, 1));
  for (const ElementFrame leaf : cell.Leaves(0)) {
    EXPECT_TRUE(CoveredShare(leaf) == 0 || LeafArea(leaf) > 0.99)
        << leaf.a << " " << leaf.b << " " << leaf.scale;
  }
}

// The feet of chairs are a thousandth of the floor that they stand on: a foot
// that was missed on the way down would be lit like the floor around it.
TEST(Cover, EveryFootIsFound) {
  constexpr double kFoot = 0.04;
  constexpr double kTau = 0.01;
  Random random(3);
  std::vector<Patch> patches = BareRoom();
  std::vector<Point3> feet;
  for (int i = 0; i < 15; ++i) {
    for (int k = 0; k < 15; ++k) {
      const Point3 low = {0.1 + 0.25 * i + 0.1 * random.Next(),
                          0.1 + 0.25 * k + 0.1 * random.Next(),
                          0};
      feet.push_back(low);
      Append(patches, BoxPatches({low, low + Vec3{kFoot, kFoot, 0.45}}, false));
    }
  }
  const auto leaves = CoveredCell(std::move(patches), kTau).Leaves(0);
  const auto overlap = [](double from, double width, double low) {
    return std::max(0.0,
                    std::min(from + width, low + kFoot) - std::max(from, low));
  };
  for (const ElementFrame leaf : leaves) {
    const double width = kRoomEdge * static_cast<double>(leaf.scale);
    double covered = 0;
    for (const Point3 low : feet) {
      covered +=
          overlap(kRoomEdge * static_cast<double>(leaf.a), width, low.x) *
          overlap(kRoomEdge * static_cast<double>(leaf.b), width, low.y);
    }
    // A foot in an unsplit element is an error of 4 tau. If an element's error
    // is 3 tau, 7 of 32 points or more are covered on the average; the error
    // passes for tau only if none of them was hit.
    EXPECT_LE(std::sqrt(covered * (1 - covered / LeafArea(leaf))), 3 * kTau)
        << leaf.a << " " << leaf.b << " " << leaf.scale;
  }
}

// The facets of a round leg are narrow: the floor under the leg is farther from
// each facet than the facet is wide.
TEST(Cover, TheFootOfARoundLegIsFound) {
  constexpr int kFacets = 48;
  constexpr double kRadius = 0.04;
  std::vector<Patch> patches = BareRoom();
  const auto at = [](int i) {
    const double phi = 2 * kPi * i / kFacets;
    return Point3{
        1.37 + kRadius * std::cos(phi), 2.21 + kRadius * std::sin(phi), 0};
  };
  for (int i = 0; i < kFacets; ++i) {
    patches.push_back(test::Rectangle(at(i), at(i + 1) - at(i), {0, 0, 0.45}));
  }
  double covered = 0;
  for (const ElementFrame leaf :
       CoveredCell(std::move(patches), 0.005).Leaves(0)) {
    const double middle_x =
        kRoomEdge * static_cast<double>(leaf.a + leaf.scale / 2);
    const double middle_y =
        kRoomEdge * static_cast<double>(leaf.b + leaf.scale / 2);
    if (std::hypot(middle_x - 1.37, middle_y - 2.21) < kRadius) {
      covered += LeafArea(leaf);
      EXPECT_LE(kRoomEdge * static_cast<double>(leaf.scale), 2 * kRadius);
    }
  }
  EXPECT_NEAR(covered, kPi * kRadius * kRadius, 0.5 * kPi * kRadius * kRadius);
}

// The root of the integral over the floor of the squared error of taking each
// leaf for evenly covered.
double EdgeError(double tau) {
  double square = 0;
  for (const ElementFrame leaf : CoveredCell(RoomWithPlinth(), tau).Leaves(0)) {
    const double share = CoveredShare(leaf);
    square += share * (1 - share) * LeafArea(leaf);
  }
  return std::sqrt(square);
}

TEST(Cover, ErrorOfItsEdgesFallsWithTheRootOfTau) {
  const double whole = std::sqrt(0.09 * (1 - 0.09 / 16));  // one element
  EXPECT_NEAR(EdgeError(1), whole, 1e-4);
  // Leaves on the edge are about as wide as tau / reflected, and the strip that
  // they form is wrong by a constant: its area falls with tau.
  const double slope =
      std::log(EdgeError(0.2) / EdgeError(0.005)) / std::log(0.2 / 0.005);
  EXPECT_NEAR(slope, 0.5, 0.1);
}

TEST(Cover, OnlyWhatIsPartlyCoveredIsSplit) {
  const CoveredCell cell(RoomWithPlinth(), 0.05);
  // The edge of the cover must cross the parent of every leaf.
  for (const ElementFrame leaf : cell.Leaves(0)) {
    if (leaf.scale == 1) {
      continue;
    }
    const float wide = 2 * leaf.scale;
    const ElementFrame parent = {wide * std::floor(leaf.a / wide),
                                 wide * std::floor(leaf.b / wide),
                                 wide};
    const double share = CoveredShare(parent);
    EXPECT_GT(share, 0) << parent.a << " " << parent.b << " " << wide;
    EXPECT_LT(share, 1) << parent.a << " " << parent.b << " " << wide;
  }
}

// The leaves of every patch tile it: none is an ancestor of another, and their
// areas add up.
void ExpectTiled(const CoveredCell& cell) {
  std::vector<std::vector<ElementPath>> paths(cell.Geometry().size());
  for (const ClusterItem& item : cell.Found().receivers) {
    paths[item.patch].push_back(item.path);
  }
  for (const auto& of_patch : paths) {
    double area = 0;  // powers of four: exact
    for (const ElementPath path : of_patch) {
      size_t level = 0;
      for (ElementPath up = path; up != kRootPath; up >>= 2) {
        ++level;
        EXPECT_EQ(std::count(of_patch.begin(), of_patch.end(), up >> 2), 0);
      }
      EXPECT_EQ(std::count(of_patch.begin(), of_patch.end(), path), 1);
      area += std::pow(0.25, level);
    }
    EXPECT_EQ(area, 1);
  }
}

TEST(Cover, LeavesTileTheirPatches) {
  std::vector<Patch> patches = RoomWithPlinth();
  // A triangle lies half under the plinth's neighbour, 5 mm below it: the gap
  // at the sides is no view.
  Append(patches, BoxPatches({{3, 3, 0.985}, {3.2, 3.2, 1.1}}, false));
  patches.push_back(test::Triangle({2.9, 2.9, 0.98}, {0, 0.5, 0}, {0.5, 0, 0}));
  std::swap(patches.back().u, patches.back().v);  // faces up, to the box
  const CoveredCell cell(patches, 0.01);
  EXPECT_GT(cell.Leaves(static_cast<uint32_t>(patches.size() - 1)).size(), 1U);
  ExpectTiled(cell);
}

TEST(Cover, BlackPatchesReceiveNothing) {
  std::vector<Patch> patches = RoomWithPlinth();
  patches[0].reflects = false;
  EXPECT_TRUE(CoveredCell(patches, 0.05).Leaves(0).empty());
}

// A box around the floor's middle is open above by a slit: a twentieth of the
// light gets in, here and there, and there is no edge to find.
TEST(Cover, ANarrowViewIsNoEdge) {
  std::vector<Patch> patches = BareRoom();
  Append(patches, BoxPatches({{1, 1, 0}, {1.3, 1.01, 0.1}}, false));
  Append(patches, BoxPatches({{1, 1.29, 0}, {1.3, 1.3, 0.1}}, false));
  Append(patches, BoxPatches({{1, 1, 0}, {1.01, 1.3, 0.1}}, false));
  Append(patches, BoxPatches({{1.29, 1, 0}, {1.3, 1.3, 0.1}}, false));
  Append(patches, BoxPatches({{1, 1, 0.1}, {1.13, 1.3, 0.11}}, false));
  Append(patches, BoxPatches({{1.17, 1, 0.1}, {1.3, 1.3, 0.11}}, false));
  const CoveredCell open(patches, 1e-3);
  patches = BareRoom();
  Append(patches, BoxPatches({{1, 1, 0}, {1.3, 1.3, 0.11}}, false));
  const CoveredCell closed(patches, 1e-3);
  const auto inside = [](const CoveredCell& cell) {
    return std::ranges::count_if(cell.Leaves(0), [](ElementFrame leaf) {
      const float low =
          std::min(leaf.a, leaf.b) * static_cast<float>(kRoomEdge);
      const float high = (std::max(leaf.a, leaf.b) + leaf.scale) *
                         static_cast<float>(kRoomEdge);
      return low > 1.02F && high < 1.28F;
    });
  };
  EXPECT_LE(inside(open), 4 * inside(closed) + 16);
}

TEST(Cover, ACellHasABoundedNumberOfReceivers) {
  const auto plain = CoveredCell(RoomWithPlinth(), 1e-4, 7);
  ASSERT_GT(plain.Found().receivers.size(), 500U);
  const CoveredCell bounded(RoomWithPlinth(), 1e-4, 7, 300);
  EXPECT_LE(bounded.Found().receivers.size(), 300U);
  EXPECT_GT(bounded.Found().receivers.size(), bounded.Geometry().size());
  ExpectTiled(bounded);
}

TEST(Cover, SameSeedFindsTheSame) {
  const CoveredCell a(RoomWithPlinth(), 0.02, 7);
  const CoveredCell b(RoomWithPlinth(), 0.02, 7);
  EXPECT_EQ(a.Found().rays, b.Found().rays);
  ASSERT_EQ(a.Found().receivers.size(), b.Found().receivers.size());
  for (size_t i = 0; i < a.Found().receivers.size(); ++i) {
    EXPECT_EQ(a.Found().receivers[i].patch, b.Found().receivers[i].patch);
    EXPECT_EQ(a.Found().receivers[i].path, b.Found().receivers[i].path);
  }
}

}  // namespace
}  // namespace enfilade
