// How well a near link's kernel is rebuilt from its sum.

#include "solver/refine/near_code.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/solver/test_cells.h"
#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr uint16_t kAll = 0xffff;

// Two squares that face each other; the upper one sends 1 W/m2.
class FacingSquares {
 public:
  explicit FacingSquares(double height)
      : geometry_(test::GeometryOf({test::Floor(), test::Ceiling(height)})),
        receiver_(MakeTransferEnd(geometry_[0], {})) {
    source_.end = MakeTransferEnd(geometry_[1], {});
    source_.radiosity.fill(1);
  }

  [[nodiscard]] Kernel Quadrature() const {
    return QuadratureKernel(receiver_, source_.end);
  }

  [[nodiscard]] Kernel Near() const {
    return NearKernel(receiver_, source_.end);
  }

  [[nodiscard]] NearCode Encoded(const Kernel& kernel, uint16_t visible) const {
    return EncodeNear(receiver_, source_, kernel, visible);
  }

 private:
  std::vector<PatchGeometry> geometry_;
  TransferEnd receiver_;
  RadiantEnd source_;
};

TEST(NearCode, OfQuadratureIsExactButForTheRoundingOfItsSum) {
  const FacingSquares squares(1);
  const NearCode code = squares.Encoded(squares.Quadrature(), kAll);
  ASSERT_TRUE(code.error);
  EXPECT_LT(*code.error, std::ldexp(1.0F, -11));
  EXPECT_EQ(code.sum, EncodeSum(squares.Quadrature()));
}

TEST(NearCode, LosesTheMoreTheCloserTheElementsAre) {
  const FacingSquares apart(1);
  const FacingSquares close(0.1);
  const NearCode code = apart.Encoded(apart.Near(), kAll);
  const NearCode closer = close.Encoded(close.Near(), kAll);
  ASSERT_TRUE(code.error && closer.error);
  EXPECT_GT(*closer.error, 4 * *code.error);
}

// A square is two triangles, over which the loss is spread likewise: its RMS
// over a triangle is about that over the square, whatever the number of nodes.
TEST(NearCode, CountsTrianglesAsMuchAsSquares) {
  constexpr double kHeight = 0.25;
  Patch triangle = test::Floor();
  triangle.shape = PatchShape::kTriangle;
  const auto geometry = test::GeometryOf({triangle, test::Ceiling(kHeight)});
  const TransferEnd receiver = MakeTransferEnd(geometry[0], {});
  RadiantEnd source;
  source.end = MakeTransferEnd(geometry[1], {});
  source.radiosity.fill(1);
  const Kernel kernel = NearKernel(receiver, source.end);
  const NearCode code = EncodeNear(receiver, source, kernel, kAll);
  ASSERT_TRUE(code.error);
  // The loss by hand, node by node.
  Kernel rebuilt = QuadratureKernel(receiver, source.end);
  float all = 0;
  float all_rebuilt = 0;
  for (size_t i = 0; i < kernel.size(); ++i) {
    all += kernel[i];
    all_rebuilt += rebuilt[i];
  }
  double square = 0;
  for (size_t g = 0; g < receiver.node_count; ++g) {
    double loss = 0;
    for (size_t q = 0; q < kTransferNodes; ++q) {
      const size_t i = g * kTransferNodes + q;
      loss += static_cast<double>(rebuilt[i] * all / all_rebuilt - kernel[i]);
    }
    square += loss * loss / static_cast<double>(receiver.node_count);
  }
  ASSERT_GT(square, 0);
  // The sum has eleven bits.
  EXPECT_NEAR(*code.error, std::sqrt(square), 0.02 * std::sqrt(square));
}

TEST(NearCode, HasNoErrorWhereQuadratureIsZero) {
  const FacingSquares squares(1);
  EXPECT_FALSE(squares.Encoded(squares.Near(), 0).error);
}

}  // namespace
}  // namespace enfilade
