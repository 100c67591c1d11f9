// What a report says in words.

#include "tools/report.h"

#include <string>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(DarknessNote, SaysWhatTheErrorIsWhereTheLightIs) {
  EXPECT_EQ(DarknessNote(1, 0.1), "");
  EXPECT_EQ(DarknessNote(0.004, 0.1), "");
  const std::string note = DarknessNote(0.0004, 0.1);
  EXPECT_NE(note.find("0.04 % of the surfaces"), std::string::npos) << note;
  EXPECT_NE(note.find("one of 0.002 there"), std::string::npos) << note;
}

}  // namespace
}  // namespace enfilade
