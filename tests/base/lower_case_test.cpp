#include "base/lower_case.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(LowerCase, ChangesCapitalsOnly) {
  EXPECT_EQ(LowerCase("Haus-1.OBJ.gz"), "haus-1.obj.gz");
}

TEST(LowerCase, LeavesBytesBeyondAsciiAlone) {
  EXPECT_EQ(LowerCase("\xc3\x84.XML"), "\xc3\x84.xml");
}

}  // namespace
}  // namespace enfilade
