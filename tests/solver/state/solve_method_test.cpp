#include "solver/state/solve_method.h"

#include <optional>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(SolveMethod, IsFoundByItsName) {
  for (const MethodTraits& traits : AllMethods()) {
    EXPECT_EQ(MethodNamed(traits.name), traits.method) << traits.name;
    EXPECT_EQ(TraitsOf(traits.method).name, traits.name);
  }
  EXPECT_EQ(MethodNamed("wavelets"), std::nullopt);
  EXPECT_EQ(MethodNamed(""), std::nullopt);
}

}  // namespace
}  // namespace enfilade
