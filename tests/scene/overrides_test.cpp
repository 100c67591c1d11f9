#include "scene/overrides.h"

#include "base/error.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

std::string ErrorOf(const std::string& text) {
  try {
    Overrides::Parse(text, "o.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Overrides, LaterAndMoreSpecificRulesWin) {
  const Overrides o = Overrides::Parse(
      R"({"objects": {"desk*": {"reflectance": 0.3}},
          "materials": {"*": {"reflectance": 0.1, "sides": 1},
                        "wood": {"reflectance": [0.2, 0.3, 0.4]}}})",
      "o.json");
  const auto reflectance = [&](const char* material, const char* object) {
    Material m;
    for (const size_t rule : o.Matching(material, object, "")) {
      o.Apply(rule, m);
    }
    EXPECT_EQ(m.sides, 1);
    return m.reflectance[0];
  };
  EXPECT_EQ(reflectance("steel", "chair"), 0.1);
  EXPECT_EQ(reflectance("wood", "chair"), 0.2);
  EXPECT_EQ(reflectance("wood", "desk 7"), 0.3);
}

TEST(Overrides, ErrorsNameTheLine) {
  EXPECT_NE(ErrorOf("{\n\"material\": {}}").find("o.json:2: unknown section"),
            std::string::npos);
  EXPECT_NE(ErrorOf("{\"materials\":\n{\"a\":\n{\"colour\": 1}}}")
                .find("o.json:3: unknown property"),
            std::string::npos);
  EXPECT_NE(ErrorOf("{\n\n\"materials\" 3}").find("o.json:3: not valid JSON"),
            std::string::npos);
  const auto bad = [](const std::string& properties) {
    return !ErrorOf("{\"materials\": {\"a\": {" + properties + "}}}").empty();
  };
  EXPECT_TRUE(bad("\"reflectance\": 1"));
  EXPECT_TRUE(bad("\"reflectance\": -0.1"));
  EXPECT_TRUE(bad("\"reflectance\": [0.1, 0.2]"));
  EXPECT_TRUE(bad("\"exitance\": \"bright\""));
  EXPECT_TRUE(bad("\"sides\": 3"));
  EXPECT_TRUE(bad("\"clear\": 1"));
  EXPECT_TRUE(bad("\"exitance\": 1e999"));
  EXPECT_TRUE(bad("\"sides\": 1, \"sides\": 2"));
  EXPECT_FALSE(bad("\"clear\": true"));
}

// Patterns end at a zero character, and would match other names.
TEST(Overrides, NamesHaveNoZeroCharacter) {
  EXPECT_NE(ErrorOf(R"({"materials": {"w\u0000x": {"reflectance": 0.5}}})")
                .find("o.json:1: a name has a zero character"),
            std::string::npos);
}

TEST(Overrides, WhatIsNotJsonIsToldInPlainWordsAndByItsPlace) {
  EXPECT_EQ(ErrorOf("{\n  \"materials\" 3}"),
            "o.json:2: not valid JSON at column 15: unexpected number literal; "
            "expected ':'");
  EXPECT_EQ(ErrorOf("{\"materials\": {"),
            "o.json:1: not valid JSON at column 16: unexpected end of input; "
            "expected string literal");
  EXPECT_EQ(ErrorOf("{\"" + std::string(1000, 'a') + "\n"),
            "o.json:1: not valid JSON at column 1003: invalid string: control "
            "character U+000A (LF) must be escaped to \\u000A or \\n");
  EXPECT_EQ(ErrorOf("{\"materials\": {\"a\":\n {\"exitance\": 1e999}}}"),
            "o.json:2: the number 1e999 is too large");
}

// Nesting is limited before the parser holds the file in memory.
TEST(Overrides, ADeeplyNestedFileIsRefusedBeforeItIsHeld) {
  EXPECT_NE(ErrorOf("{\"materials\": " + std::string(1000, '['))
                .find("o.json:1: nested too deeply"),
            std::string::npos);
}

// The JSON library would keep the last of equal keys and drop the others, which
// may be the ones that were meant.
TEST(Overrides, EqualKeysOfOneObjectAreRefused) {
  EXPECT_NE(ErrorOf("{\"materials\": {},\n\"surfaces\": {},\n"
                    "\"materials\": {}}")
                .find("o.json:3: 'materials' is there twice"),
            std::string::npos);
  EXPECT_EQ(ErrorOf("{\"materials\": {\"a\": {\"sides\": 1}, \"b\": "
                    "{\"sides\": 1}}, \"objects\": {\"a\": {}}}"),
            "");
}

}  // namespace
}  // namespace enfilade
