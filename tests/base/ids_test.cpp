#include "base/ids.h"

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(Ids, OfDifferentThingsDoNotMix) {
  static_assert(!std::is_convertible_v<CellId, PatchId>);
  static_assert(!std::is_convertible_v<uint32_t, CellId>);
  EXPECT_LT(CellId(1U), CellId(2U));
  EXPECT_EQ(CellId(size_t{5}).Index(), 5U);
}

TEST(Ids, FirstOnesCountFromZero) {
  const std::vector<CellId> ids = {CellId(0U), CellId(1U), CellId(2U)};
  EXPECT_EQ(FirstIds<CellId>(3), ids);
  EXPECT_TRUE(FirstIds<CellId>(0).empty());
}

}  // namespace
}  // namespace enfilade
