// Flatland: exact form factors, and what wavelet bases do to them.

#include "tools/study/flatland_matrix.h"

#include <cmath>
#include <numeric>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

double SumOfSquares(const SquareMatrix& m) {
  return std::inner_product(
      m.values.begin(), m.values.end(), m.values.begin(), 0.0);
}

double MeanRowSum(const SquareMatrix& m) {
  return std::accumulate(m.values.begin(), m.values.end(), 0.0) /
         static_cast<double>(m.size);
}

TEST(FlatlandMatrix, FormFactorsSumToThoseOfTheSegments) {
  // Hottel: sqrt 2 - 1 face to face at distance 1, 1 - sqrt 1/2 at a corner.
  EXPECT_NEAR(MeanRowSum(FlatlandFormFactors(FlatlandScene::kParallel, 32)),
              std::sqrt(2.0) - 1,
              1e-12);
  EXPECT_NEAR(MeanRowSum(FlatlandFormFactors(FlatlandScene::kCorner, 32)),
              1 - std::sqrt(0.5),
              1e-12);
}

TEST(FlatlandMatrix, HaarIsOrthonormalInBothForms) {
  const auto nodal = FlatlandFormFactors(FlatlandScene::kCorner, 64);
  for (const auto form :
       {FlatlandForm::kStandard, FlatlandForm::kNonstandard}) {
    EXPECT_NEAR(SumOfSquares(InWaveletBasis(nodal, FlatlandBasis::kHaar, form)),
                SumOfSquares(nodal),
                1e-12);
  }
}

// The entry of the coarsest smooth functions of a constant matrix is its sum
// over the functions' norm; all others vanish, and with flatlets also those of
// a matrix that is linear in rows and columns.
TEST(FlatlandMatrix, WaveletsHaveVanishingMoments) {
  constexpr size_t kSize = 32;
  SquareMatrix constant{kSize, std::vector<double>(kSize * kSize, 1)};
  SquareMatrix linear = constant;
  for (size_t i = 0; i < kSize * kSize; ++i) {
    linear.values[i] = (2.0 + static_cast<double>(i / kSize)) *
                       (50.0 - static_cast<double>(i % kSize));
  }
  for (const auto form :
       {FlatlandForm::kStandard, FlatlandForm::kNonstandard}) {
    const auto haar = InWaveletBasis(constant, FlatlandBasis::kHaar, form);
    EXPECT_NEAR(haar.At(0, 0), kSize, 1e-12);
    EXPECT_EQ(CountLarge(haar, 1e-12), 1U);
    const auto flatlets =
        InWaveletBasis(linear, FlatlandBasis::kFlatlets, form);
    EXPECT_EQ(CountLarge(flatlets, 1e-12), 4U);
    EXPECT_GT(
        CountLarge(InWaveletBasis(linear, FlatlandBasis::kHaar, form), 1e-12),
        4U);
  }
}

// Figures 4 and 5: the more vanishing moments, the fewer entries that matter.
TEST(FlatlandMatrix, MoreVanishingMomentsLeaveFewerLargeEntries) {
  for (const auto scene : {FlatlandScene::kParallel, FlatlandScene::kCorner}) {
    const auto nodal = FlatlandFormFactors(scene, 32);
    for (const auto form :
         {FlatlandForm::kStandard, FlatlandForm::kNonstandard}) {
      const size_t haar =
          CountLarge(InWaveletBasis(nodal, FlatlandBasis::kHaar, form), 1e-3);
      const size_t flatlets = CountLarge(
          InWaveletBasis(nodal, FlatlandBasis::kFlatlets, form), 1e-3);
      EXPECT_LT(haar, CountLarge(nodal, 1e-3));
      EXPECT_LT(flatlets, haar);
    }
  }
}

TEST(FlatlandCommand, DrawsAndRefusesWhatIsNoPowerOfTwo) {
  const TemporaryFolder folder;
  const ProgramResult drawn = RunProgram({"flatland",
                                          "--scene",
                                          "corner",
                                          "--form",
                                          "nonstandard",
                                          folder / "a.svg"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_NE(ReadFile(folder / "a.svg").find("<circle"), std::string::npos);
  EXPECT_EQ(
      RunProgram({"flatland", "--elements", "33", folder / "b.svg"}).exit_code,
      2);
}

}  // namespace
}  // namespace enfilade
