// Reflection, emission and projection on trees, by their defining identities.

#include "solver/elements/push_pull.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/solver/test_cells.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::GeometryOf;
using test::kFloatRounding;
using test::RandomPatches;

constexpr size_t kChannels = kRgbChannels;
constexpr std::array<float, kChannels> kReflectances = {0.2F, 0.5F, 0.8F};
constexpr std::array<float, kChannels> kExitance = {3, 1, 0.5F};

SurfaceTable Surfaces() {
  SurfaceTable table;
  table.reflectance.assign(kReflectances.begin(), kReflectances.end());
  table.exitance.assign(kExitance.begin(), kExitance.end());
  return table;
}

// Random patches, the even ones emitting, with random trees over them.
class PushPullTest : public ::testing::TestWithParam<size_t> {
 protected:
  PushPullTest()
      : basis_(GetParam()),
        patches_(Patches()),
        tree_({&basis_, kChannels}, patches_),
        gathered_(tree_.Shape().Stride()) {
    Random random(42);
    for (int i = 0; i < 60; ++i) {
      ElementPath path = kRootPath;
      for (uint32_t level = random.NextBelow(5); level > 0; --level) {
        path = ChildPath(path, random.NextBelow(kChildren));
      }
      tree_.FindOrCreate(
          PatchId(random.NextBelow(static_cast<uint32_t>(patches_.size()))),
          path,
          patches_);
    }
    gathered_.GrowTo(tree_.Size());
  }

  static std::vector<PatchGeometry> Patches() {
    auto patches = GeometryOf(RandomPatches(41, 8, 4, 2), 0.8);
    for (size_t i = 0; i < patches.size(); i += 2) {
      patches[i].emits = true;
    }
    return patches;
  }

  [[nodiscard]] const PatchGeometry& PatchOf(ElementId e) const {
    return patches_[tree_.At(e).patch];
  }

  [[nodiscard]] const ShapeBasis& BasisOf(ElementId e) const {
    return basis_.On(PatchOf(e).shape);
  }

  [[nodiscard]] float Emitted(ElementId e, size_t channel) const {
    return PatchOf(e).emits ? kExitance[channel] : 0;
  }

  // Calls visit(element, channel, node, index of the coefficient).
  template <typename Visit>
  void ForEachNode(const Visit& visit) const {
    for (size_t i = 0; i < tree_.Size(); ++i) {
      for (size_t c = 0; c < kChannels; ++c) {
        for (size_t q = 0; q < BasisOf(ElementId(i)).NodeCount(); ++q) {
          visit(ElementId(i), c, q, c * tree_.Shape().NodeStride() + q);
        }
      }
    }
  }

  [[nodiscard]] bool IsRoot(ElementId e) const {
    return e.Index() < tree_.PatchCount();
  }

  Basis basis_;
  std::vector<PatchGeometry> patches_;
  CellTree tree_;
  CoefficientArray gathered_;
};

TEST_P(PushPullTest, DarkElementsHaveTheirEmission) {
  const CoefficientArray b = PushPull({tree_, patches_, Surfaces()});
  ForEachNode([&](ElementId e, size_t c, size_t, size_t at) {
    EXPECT_NEAR(b[e][at], Emitted(e, c), kFloatRounding);
  });
}

TEST_P(PushPullTest, WithoutIrradianceOnlyEmissionIsLeft) {
  const CoefficientArray b =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  const CoefficientArray e = PushPull({tree_, patches_, Surfaces()});
  for (size_t i = 0; i < tree_.Size(); ++i) {
    for (size_t k = 0; k < b.Stride(); ++k) {
      EXPECT_EQ(b[ElementId(i)][k], e[ElementId(i)][k]);
    }
  }
}

TEST_P(PushPullTest, ConstantIrradianceOfTheRootIsReflectedEverywhere) {
  ForEachNode([&](ElementId e, size_t c, size_t, size_t at) {
    if (IsRoot(e)) {
      gathered_[e][at] = 2 + static_cast<float>(c);
    }
  });
  const CoefficientArray b =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  ForEachNode([&](ElementId e, size_t c, size_t, size_t at) {
    const float h = 2 + static_cast<float>(c);
    EXPECT_NEAR(b[e][at], Emitted(e, c) + kReflectances[c] * h, kFloatRounding);
  });
}

TEST_P(PushPullTest, IrradianceOfAPointIsTheSumOverItsElements) {
  // Every element has gathered 1, so a leaf at level n has n + 1.
  ForEachNode(
      [&](ElementId e, size_t, size_t, size_t at) { gathered_[e][at] = 1; });
  const CoefficientArray b =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  ForEachNode([&](ElementId e, size_t c, size_t, size_t at) {
    const Element& element = tree_.At(e);
    if (element.first_child == 0) {
      const double level = -std::log2(std::abs(element.frame.scale));
      EXPECT_NEAR(b[e][at],
                  static_cast<double>(Emitted(e, c)) +
                      static_cast<double>(kReflectances[c]) * (level + 1),
                  kFloatRounding);
    }
  });
}

// Random irradiance on all elements.
void FillAtRandom(CoefficientArray* values) {
  Random random(43);
  for (size_t i = 0; i < values->Size(); ++i) {
    for (float& v : (*values)[ElementId(i)]) {
      v = static_cast<float>(random.Next());
    }
  }
}

TEST_P(PushPullTest, ParentsAreTheProjectionOfTheirChildren) {
  FillAtRandom(&gathered_);
  const CoefficientArray b =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  ForEachNode([&](ElementId e, size_t c, size_t g, size_t at) {
    const uint32_t child = tree_.At(e).first_child;
    if (child == 0) {
      return;
    }
    // The projection has the same inner product with every function as the
    // children.
    const ShapeBasis& basis = BasisOf(e);
    double projected = 0;
    for (size_t k = 0; k < kChildren; ++k) {
      for (size_t q = 0; q < basis.NodeCount(); ++q) {
        const auto of_child = b[ElementId(child + k)];
        const float v = of_child[c * tree_.Shape().NodeStride() + q];
        // The child's node lies at a point of the parent and weighs a quarter.
        const ChildFrame frame = FrameOfChild(PatchOf(e).shape, k);
        const UnitPoint node = basis.Node(q);
        const UnitPoint at_parent = {frame.a + frame.scale * node.a,
                                     frame.b + frame.scale * node.b};
        projected += 0.25 * basis.Weight(q) * static_cast<double>(v) *
                     basis.Evaluate(at_parent)[g];
      }
    }
    EXPECT_NEAR(static_cast<double>(b[e][at]) * basis.Weight(g),
                projected,
                kFloatRounding);
  });
}

TEST_P(PushPullTest, SumOverLeavesIsTheIntegralOverTheRoots) {
  FillAtRandom(&gathered_);
  const CoefficientArray b =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  double roots = 0;
  ForEachNode([&](ElementId e, size_t, size_t q, size_t at) {
    if (IsRoot(e)) {
      roots += static_cast<double>(PatchOf(e).area) * BasisOf(e).Weight(q) *
               static_cast<double>(b[e][at]) / kChannels;
    }
  });
  const LeafSums sums = SumOverLeaves(tree_, patches_, b);
  EXPECT_NEAR(sums.value / roots, 1, kFloatRounding);
  if (GetParam() == 1) {  // higher orders may swing below zero
    EXPECT_NEAR(sums.absolute, sums.value, 1e-9 * roots);
  }
  EXPECT_GE(sums.absolute, sums.value * (1 - 1e-9));
  double area = 0;
  for (const PatchGeometry& p : patches_) {
    area += static_cast<double>(p.area);
  }
  EXPECT_GE(sums.squared * area, sums.value * sums.value / kChannels);
}

TEST_P(PushPullTest, WhatTheBasisHoldsAtTheRootIsReproducedOnTheLeaves) {
  // Irradiance 1 + 2 a - b (higher orders) over each patch.
  const auto field = [&](double a, double b) {
    return GetParam() == 1 ? 1 : 1 + 2 * a - b;
  };
  ForEachNode([&](ElementId e, size_t, size_t q, size_t at) {
    if (IsRoot(e)) {
      const UnitPoint node = BasisOf(e).Node(q);
      gathered_[e][at] = static_cast<float>(field(node.a, node.b));
    }
  });
  const CoefficientArray b =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  ForEachNode([&](ElementId e, size_t c, size_t q, size_t at) {
    const ElementFrame f = tree_.At(e).frame;
    const UnitPoint node = BasisOf(e).Node(q);
    const double h =
        field(static_cast<double>(f.a) + static_cast<double>(f.scale) * node.a,
              static_cast<double>(f.b) + static_cast<double>(f.scale) * node.b);
    EXPECT_NEAR(b[e][at],
                static_cast<double>(Emitted(e, c)) +
                    static_cast<double>(kReflectances[c]) * h,
                2 * kFloatRounding);
  });
}

TEST_P(PushPullTest, BlackPatchesOnlyEmit) {
  FillAtRandom(&gathered_);
  for (PatchGeometry& p : patches_) {
    p.reflects = false;
  }
  const CoefficientArray b =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  ForEachNode([&](ElementId e, size_t c, size_t, size_t at) {
    EXPECT_NEAR(b[e][at], Emitted(e, c), kFloatRounding);
  });
}

// ------------------------------------------------------------------- gains

TEST_P(PushPullTest, LeavesReflectTheShareThatTheyKeep) {
  FillAtRandom(&gathered_);
  CoefficientArray kept(tree_.Shape().NodeStride());
  kept.GrowTo(tree_.Size());
  size_t next = 0;
  for (size_t i = 0; i < kept.Size(); ++i) {
    for (float& share : kept[ElementId(i)]) {
      share = static_cast<float>(next++ % 5) / 4;
    }
  }
  const CoefficientArray some =
      PushPull({tree_, patches_, Surfaces(), &gathered_, &kept});
  const CoefficientArray all =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  ForEachNode([&](ElementId e, size_t c, size_t q, size_t at) {
    if (tree_.At(e).first_child == 0) {
      const double emitted = static_cast<double>(Emitted(e, c));
      const double reflected = static_cast<double>(all[e][at]) - emitted;
      EXPECT_NEAR(some[e][at],
                  emitted + static_cast<double>(kept[e][q]) * reflected,
                  kFloatRounding);
    }
  });
}

// ------------------------------------------------------------------- order

TEST_P(PushPullTest, EveryElementIsVisitedOnceAndAfterItsChildren) {
  const SurfaceTable surfaces = Surfaces();
  const ReflectingCell cell{tree_, patches_, surfaces};
  std::vector<int> visits(tree_.Size());
  VisitRadiosity(
      cell, [&](size_t block, ElementId id, std::span<const float> radiosity) {
        const Element& e = tree_.At(id);
        EXPECT_EQ(block, e.patch / kBlockPatches);
        EXPECT_EQ(radiosity.size(), tree_.Shape().Stride());
        ++visits[id.Index()];
        for (size_t c = 0; e.first_child != 0 && c < kChildren; ++c) {
          EXPECT_EQ(visits[e.first_child + c], 1);
        }
      });
  EXPECT_EQ(std::count(visits.begin(), visits.end(), 1),
            static_cast<std::ptrdiff_t>(visits.size()));
}

// ------------------------------------------------------------------- sums

TEST_P(PushPullTest, LeavingFluxIsTheSumOverAllLeaves) {
  FillAtRandom(&gathered_);
  const SurfaceTable surfaces = Surfaces();
  const ReflectingCell cell{tree_, patches_, surfaces, &gathered_};
  const double flux = SumOverLeaves(tree_, patches_, PushPull(cell)).value;
  EXPECT_NEAR(LeavingFlux(cell), flux, 1e-12 * std::abs(flux));
}

TEST_P(PushPullTest, MeanReflectedIsWhatIsBeyondEmission) {
  ForEachNode([&](ElementId e, size_t c, size_t, size_t at) {
    if (IsRoot(e)) {
      gathered_[e][at] = c == 1 ? 4 : 1;
    }
  });
  const CoefficientArray b =
      PushPull({tree_, patches_, Surfaces(), &gathered_});
  for (size_t i = 0; i < patches_.size(); ++i) {
    // 0.5 * 4 in the second channel is the largest.
    EXPECT_NEAR(
        MeanReflected(patches_[i], b[ElementId(i)], tree_.Shape(), Surfaces()),
        2,
        kFloatRounding);
  }
}

TEST_P(PushPullTest, EmittedFluxIsAreaTimesExitance) {
  double flux = 0;
  for (const PatchGeometry& p : patches_) {
    flux += p.emits ? static_cast<double>(p.area) * (3 + 1 + 0.5) / 3 : 0;
  }
  EXPECT_NEAR(EmittedFlux(patches_, Surfaces()) / flux, 1, kFloatRounding);
}

INSTANTIATE_TEST_SUITE_P(Orders, PushPullTest, ::testing::Values(1, 2, 3, 4));

}  // namespace
}  // namespace enfilade
