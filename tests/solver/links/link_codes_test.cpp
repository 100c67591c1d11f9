#include "solver/links/link_codes.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(Coefficient, KeepsElevenBits) {
  for (float v = 1e-9F; v < 1e4F; v *= 1.37F) {
    EXPECT_NEAR(
        DecodeCoefficient(EncodeCoefficient(v)) / v, 1.0, std::ldexp(1.0, -11));
  }
  EXPECT_EQ(DecodeCoefficient(EncodeCoefficient(0)), 0.0F);
  EXPECT_EQ(DecodeCoefficient(EncodeCoefficient(-1)), 0.0F);
}

// Coefficients of nearly touching elements, some of them blocked.
Kernel RandomKernel(Random* random) {
  Kernel kernel{};
  for (float& k : kernel) {
    k = random->NextBelow(5) == 0
            ? 0.0F
            : static_cast<float>(std::exp2(-12 * random->Next()));
  }
  return kernel;
}

double RowSum(const Kernel& kernel, size_t g) {
  const auto row = kernel.begin() + static_cast<ptrdiff_t>(g * kTransferNodes);
  return std::accumulate(row, row + kTransferNodes, 0.0);
}

Kernel ByRows(const KernelColumns& columns) {
  Kernel kernel{};
  for (size_t i = 0; i < kernel.size(); ++i) {
    kernel[i] = columns[i % kTransferNodes][i / kTransferNodes];
  }
  return kernel;
}

constexpr double kMostRoot = 255;

class KernelCode : public ::testing::Test {
 protected:
  static Kernel Restored(const Kernel& kernel) {
    const EncodedKernel encoded = EncodeKernel(kernel);
    return ByRows(DecodeKernel(encoded.sum, encoded.shape));
  }

  Random random_{7};
};

TEST_F(KernelCode, KeepsZeros) {
  for (int n = 0; n < 1000; ++n) {
    const Kernel kernel = RandomKernel(&random_);
    const Kernel restored = Restored(kernel);
    for (size_t i = 0; i < kernel.size(); ++i) {
      EXPECT_TRUE(kernel[i] > 0 || restored[i] == 0.0F);
    }
  }
}

// Squares of adjacent roots are at most 2 * most - 1 of most^2 apart. A
// coefficient takes half of that by its own rounding and no more than that from
// the coefficient before it, since the squares of smaller roots are closer
// together. The error of the scale that keeps the sum is the mean of these
// errors, weighted by size.
TEST_F(KernelCode, KeepsEachCoefficientToAShareOfTheLargest) {
  const double apart = (2 * kMostRoot - 1) / (kMostRoot * kMostRoot);
  for (int n = 0; n < 1000; ++n) {
    const Kernel kernel = RandomKernel(&random_);
    const Kernel restored = Restored(kernel);
    const float largest = *std::max_element(kernel.begin(), kernel.end());
    for (size_t i = 0; i < kernel.size(); ++i) {
      EXPECT_NEAR(
          restored[i] / largest, kernel[i] / largest, 1.5 * apart + 1e-6);
    }
  }
}

TEST_F(KernelCode, KeepsTheSum) {
  for (int n = 0; n < 1000; ++n) {
    const Kernel kernel = RandomKernel(&random_);
    const Kernel restored = Restored(kernel);
    const double sum = std::accumulate(kernel.begin(), kernel.end(), 0.0);
    EXPECT_NEAR(std::accumulate(restored.begin(), restored.end(), 0.0),
                sum,
                std::ldexp(sum, -11) + 1e-6 * sum);
  }
}

// Four independent roundings would each be off by the root of a twelfth of a
// step, and their sum by twice that. Since each coefficient takes over the
// rounding error of another, only the rounding of the smallest and of the
// common scale is left.
TEST_F(KernelCode, KeepsTheSumsOfRows) {
  const double step = 2 * 0.84 / kMostRoot;  // at the mean root, of 1 to 2
  double squared = 0;
  size_t rows = 0;
  for (int n = 0; n < 1000; ++n) {
    Kernel kernel;
    for (float& k : kernel) {
      k = static_cast<float>(1 + random_.Next());
    }
    const Kernel restored = Restored(kernel);
    const float largest = *std::max_element(kernel.begin(), kernel.end());
    for (size_t g = 0; g < kTransferNodes; ++g) {
      const double error = (RowSum(restored, g) - RowSum(kernel, g)) /
                           static_cast<double>(largest);
      squared += error * error;
      ++rows;
    }
  }
  EXPECT_LT(std::sqrt(squared / static_cast<double>(rows)),
            step / std::sqrt(12) + std::ldexp(1.0, -11));
}

// Rounding is not one-sided: the sum of many kernels is right for a source that
// is bright at any one of its nodes.
TEST_F(KernelCode, IsNotOneSided) {
  std::array<double, kTransferNodes> exact{};
  std::array<double, kTransferNodes> restored{};
  for (int n = 0; n < 20000; ++n) {
    const Kernel kernel = RandomKernel(&random_);
    const Kernel code = Restored(kernel);
    for (size_t i = 0; i < kernel.size(); ++i) {
      exact[i % kTransferNodes] += static_cast<double>(kernel[i]);
      restored[i % kTransferNodes] += static_cast<double>(code[i]);
    }
  }
  for (size_t q = 0; q < kTransferNodes; ++q) {
    EXPECT_NEAR(restored[q] / exact[q], 1.0, 2e-3) << q;
  }
}

TEST_F(KernelCode, KeepsNothingOfNothing) {
  EXPECT_EQ(Restored(Kernel{}), Kernel{});
}

}  // namespace
}  // namespace enfilade
