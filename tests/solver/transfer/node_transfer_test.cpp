// Transfers at the nodes of bases: their sums, reciprocity, the closed forms of
// unit squares, and what visibility bits leave of them.

#include "solver/transfer/node_transfer.h"

#include "solver/transfer/link_rays.h"

#include <array>
#include <cmath>

#include "tests/solver/print_basis.h"
#include "tests/solver/test_cells.h"
#include <gtest/gtest.h>

namespace enfilade {

namespace {

using test::kFloatRounding;

class NodeTransfer : public ::testing::TestWithParam<BasisKind> {
 protected:
  NodeTransfer() : basis_(GetParam()) {}

  [[nodiscard]] NodeEnd EndOf(const PatchGeometry& patch,
                              ElementFrame frame = {}) const {
    return MakeNodeEnd(basis_.On(patch.shape), patch, frame);
  }

  // The mean over the receiver of the irradiance of a source of 1 W/m2.
  static double MeanOf(const NodeKernel& kernel, const NodeEnd& receiver) {
    double mean = 0;
    for (size_t i = 0; i < kernel.size(); ++i) {
      mean += static_cast<double>(receiver.nodes.weight[i / kMaxNodes]) *
              static_cast<double>(kernel[i]);
    }
    return mean;
  }

  static double RowSum(const NodeKernel& kernel, size_t g) {
    double sum = 0;
    for (size_t q = 0; q < kMaxNodes; ++q) {
      sum += static_cast<double>(kernel[g * kMaxNodes + q]);
    }
    return sum;
  }

  Basis basis_;
};

TEST_P(NodeTransfer, RowsOfNearTransfersAreTheExactFormFactors) {
  // The receiver is close by and not larger than the source.
  const auto patches = test::GeometryOf(test::RandomPatches(7, 40, 0.7, 1));
  for (size_t i = 0; i + 1 < patches.size(); i += 2) {
    const NodeEnd source = EndOf(patches[i]);
    const NodeEnd receiver = EndOf(patches[i + 1], {0.2F, 0.3F, 0.125F});
    if (source.end.diameter < receiver.end.diameter) {
      continue;
    }
    const NodeKernel kernel = NearNodeKernel(receiver, source);
    const Corners corners = CornersOf(patches[i], {});
    for (size_t g = 0; g < receiver.count; ++g) {
      const bool behind =
          Dot(receiver.nodes.At(g) - patches[i].origin, patches[i].normal) <= 0;
      const float exact = PointToPolygon(
          receiver.nodes.At(g), receiver.end.patch->normal, corners.View());
      EXPECT_NEAR(RowSum(kernel, g),
                  behind ? 0.0 : static_cast<double>(exact),
                  kFloatRounding);
    }
  }
}

TEST_P(NodeTransfer, FarTransfersAreReciprocal) {
  // A_r w_g K_gq is the same both ways.
  const auto patches = test::GeometryOf(test::RandomPatches(8, 40, 5, 1));
  for (size_t i = 0; i + 1 < patches.size(); i += 2) {
    const NodeEnd a = EndOf(patches[i]);
    const NodeEnd b = EndOf(patches[i + 1]);
    const NodeKernel to_a = FarNodeKernel(a, b);
    const NodeKernel to_b = FarNodeKernel(b, a);
    for (size_t g = 0; g < a.count; ++g) {
      for (size_t q = 0; q < b.count; ++q) {
        EXPECT_NEAR(a.end.area * a.nodes.weight[g] * to_a[g * kMaxNodes + q],
                    b.end.area * b.nodes.weight[q] * to_b[q * kMaxNodes + g],
                    kFloatRounding);
      }
    }
  }
}

PatchGeometry UnitSquare(Point3 origin, Vec3 u, Vec3 v) {
  Patch p;
  p.origin = origin;
  p.u = u;
  p.v = v;
  p.shape = PatchShape::kParallelogram;
  return test::GeometryOf({p})[0];
}

TEST_P(NodeTransfer, UnitSquaresFaceToFaceHaveTheirFormFactor) {
  const PatchGeometry below = UnitSquare({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const PatchGeometry above = UnitSquare({0, 0, 1}, {0, 1, 0}, {1, 0, 0});
  const NodeEnd source = EndOf(above);
  const auto error_of = [&](ElementFrame frame) {
    const NodeEnd r = EndOf(below, frame);
    return MeanOf(TransferKernel(r, source), r);
  };
  constexpr double kExact = 0.199825;
  const double error = error_of({}) - kExact;
  if (!GetParam().flat) {
    EXPECT_NEAR(error, 0, 1e-4);
    return;
  }
  // The irradiance of cells is taken at their centroids: the error of the mean
  // falls with the square of the cells' size. By symmetry the four quarters of
  // the receiver get the same.
  const double error_of_quarter = error_of({0, 0, 0.5F}) - kExact;
  EXPECT_NEAR(error / error_of_quarter, 4, 0.4);
}

TEST_P(NodeTransfer, SmallCloseSourcesKeepTheirFlux) {
  // What leaves a source towards a large receiver arrives there:
  // A_r K sums to A_s times the form factors of the source's nodes.
  const PatchGeometry floor = UnitSquare({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const PatchGeometry lamp =
      UnitSquare({0.3, 0.4, 0.05}, {0, 0.02, 0}, {0.02, 0, 0});
  const NodeEnd r = EndOf(floor);
  const NodeEnd s = EndOf(lamp);
  double arriving = 0;
  const Corners corners = CornersOf(floor, {});
  for (size_t q = 0; q < s.count; ++q) {
    arriving += static_cast<double>(
        s.nodes.weight[q] *
        PointToPolygon(s.nodes.At(q), lamp.normal, corners.View()));
  }
  EXPECT_NEAR(MeanOf(TransferKernel(r, s), r) /
                  (static_cast<double>(lamp.area) * arriving),
              1,
              1e-4);
}

TEST_P(NodeTransfer, EveryBitIsItsShareOfAnEvenKernel) {
  const auto patches = test::GeometryOf(test::RandomPatches(9, 8, 5, 1));
  for (size_t i = 0; i + 1 < patches.size(); i += 2) {
    const NodeEnd r = EndOf(patches[i]);
    const NodeEnd s = EndOf(patches[i + 1]);
    NodeKernel even{};
    for (size_t g = 0; g < r.count; ++g) {
      for (size_t q = 0; q < s.count; ++q) {
        even[g * kMaxNodes + q] = s.nodes.weight[q];
      }
    }
    const SampleMap& on_r = basis_.SamplesOn(r.basis->Shape());
    const SampleMap& on_s = basis_.SamplesOn(s.basis->Shape());
    NodeKernel all = even;
    MaskNodeKernel(AllPairs(r.end, s.end), on_r, on_s, &all);
    EXPECT_NEAR(MeanOf(all, r), 1, kFloatRounding);
    for (size_t g = 0; g < r.end.node_count; ++g) {
      for (size_t q = 0; q < s.end.node_count; ++q) {
        NodeKernel one = even;
        MaskNodeKernel(static_cast<uint16_t>(1U << (g * kTransferNodes + q)),
                       on_r,
                       on_s,
                       &one);
        EXPECT_NEAR(
            MeanOf(one, r),
            1.0 / static_cast<double>(r.end.node_count * s.end.node_count),
            kFloatRounding);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Bases,
                         NodeTransfer,
                         ::testing::Values(BasisKind{3, false},
                                           BasisKind{4, false},
                                           BasisKind{2, true},
                                           BasisKind{3, true}));

TEST(FlatTransfer, CoefficientsAreTheFormFactorsOfCells) {
  // The kernel is that of the ends' own cells, as if each were a constant
  // element (W, 2.4.3).
  const ShapeBasis f3(PatchShape::kParallelogram, {3, true});
  const PatchGeometry wall = UnitSquare({0, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const PatchGeometry floor = UnitSquare({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const NodeEnd r = MakeNodeEnd(f3, floor, {});
  const NodeEnd s = MakeNodeEnd(f3, wall, {});
  const NodeKernel kernel = TransferKernel(r, s);  // they touch
  for (size_t q = 0; q < 9; ++q) {
    const ElementFrame cell = {
        static_cast<float>(q % 3) / 3, static_cast<float>(q / 3) / 3, 1.0F / 3};
    const Corners corners = CornersOf(wall, cell);
    for (size_t g = 0; g < 9; ++g) {
      EXPECT_NEAR(kernel[g * kMaxNodes + q],
                  PointToPolygon(r.nodes.At(g), floor.normal, corners.View()),
                  1e-6);
    }
  }
}

}  // namespace
}  // namespace enfilade
