#include "solver/transfer/plain_kernel.h"

#include "base/random.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Four [[gnu::vector_size(4 * sizeof(float))]] = float;

constexpr Vec3f kUp = {0, 0, 1};
constexpr Vec3f kDown = {0, 0, -1};

Vec3f RandomOffset(Random* random) {
  const auto coordinate = [&] {
    return static_cast<float>(4 * random->Next() - 2);
  };
  return {coordinate(), coordinate(), coordinate()};
}

// Between parallel planes at distance h, cos = h / r at both ends.
TEST(PlainKernelTest, FollowsBothCosinesAndTheSquareOfTheDistance) {
  constexpr float kHeight = 2;
  constexpr float kAside = 1.5F;
  const float r2 = kHeight * kHeight + kAside * kAside;
  EXPECT_NEAR(PlainKernel(3.0F, kAside, 0.0F, kHeight, kUp, kDown),
              3 * kHeight * kHeight / (r2 * r2),
              1e-6F);
}

TEST(PlainKernelTest, IsTheSameFromEitherEnd) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Vec3f d = RandomOffset(&random);
    EXPECT_EQ(PlainKernel(1.0F, d.x, d.y, d.z, kUp, kDown),
              PlainKernel(1.0F, -d.x, -d.y, -d.z, kDown, kUp));
  }
}

TEST(PlainKernelTest, IsZeroBehindEitherPlaneAndFiniteAtNoDistance) {
  EXPECT_EQ(PlainKernel(1.0F, 0.0F, 0.0F, -1.0F, kUp, kDown), 0);
  EXPECT_EQ(PlainKernel(1.0F, 0.0F, 0.0F, 1.0F, kUp, kUp), 0);
  EXPECT_EQ(PlainKernel(1.0F, 0.0F, 0.0F, 0.0F, kUp, kDown), 0);
}

// The gather works side by side on what refinement judges one by one.
TEST(PlainKernelTest, OfVectorsHasTheBitsOfNumbers) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    Four dx = {};
    Four dy = {};
    Four dz = {};
    std::array<float, 4> single{};
    for (size_t k = 0; k < single.size(); ++k) {
      const Vec3f d = RandomOffset(&random);
      dx[k] = d.x;
      dy[k] = d.y;
      dz[k] = d.z;
      single[k] = PlainKernel(0.7F, d.x, d.y, d.z, kUp, kDown);
    }
    const Four all = PlainKernel(Four{} + 0.7F, dx, dy, dz, kUp, kDown);
    for (size_t k = 0; k < single.size(); ++k) {
      EXPECT_EQ(all[k], single[k]);
    }
  }
}

TEST(ScaleToFormFactorTest, ScalesTheSumAndKeepsTheShape) {
  const std::array<float, 3> weight = {0.5F, 0.25F, 0.25F};
  std::array<float, 3> row = {0.1F, 0.2F, 0.3F};
  ScaleToFormFactor(0.9F, weight, &row);
  EXPECT_NEAR(std::accumulate(row.begin(), row.end(), 0.0F), 0.9F, 1e-6F);
  // A fiftieth of the sum is even.
  EXPECT_NEAR(row[2] - row[1], 0.9F / 0.612F * 0.1F, 1e-6F);
}

TEST(ScaleToFormFactorTest, SpreadsARowWithoutNodesEvenly) {
  const std::array<float, 3> weight = {0.5F, 0.25F, 0.25F};
  std::array<float, 3> row{};
  ScaleToFormFactor(0.4F, weight, &row);
  EXPECT_NEAR(row[0], 0.2F, 1e-6F);
  EXPECT_NEAR(row[1], 0.1F, 1e-6F);
  EXPECT_NEAR(row[2], 0.1F, 1e-6F);
}

}  // namespace
}  // namespace enfilade
