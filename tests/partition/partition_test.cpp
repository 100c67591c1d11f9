#include "partition/partition.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(PatchCount, AddsUpTheCells) {
  std::vector<CellInfo> cells(3);
  cells[0].patches = 5;
  cells[2].patches = 7;
  EXPECT_EQ(PatchCount(cells), 12U);
  EXPECT_EQ(PatchCount({}), 0U);
}

}  // namespace
}  // namespace enfilade
