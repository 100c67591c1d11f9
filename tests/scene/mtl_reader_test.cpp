#include "scene/mtl_reader.h"

#include <algorithm>

#include "tests/memory_peak.h"
#include "tests/scene/temp_scene.h"

namespace enfilade {
namespace {

class MtlReading : public ::testing::Test {
 protected:
  std::vector<MtlMaterial> Read(const std::string& text) {
    std::vector<MtlMaterial> read;
    ReadMtl(temp_.Write("names.mtl", text),
            [&](MtlMaterial&& m, double /*share*/) {
              read.push_back(std::move(m));
            });
    return read;
  }

  TempScene temp_;
};

// Each material is read as it would be if its name were one word.
TEST_F(MtlReading, NamesMayHoldBlanks) {
  const std::vector<MtlMaterial> read = Read(
      "newmtl Dark Wood \r\nKd 0.5\r\nd -halo 0.9\r\n"
      "newmtl Dark\r\nKd 0.5 0.5 0\r\nd 0.2\r\n"
      "newmtl\tDark  Oak\t\r\nKe 7\r\n");
  ASSERT_EQ(read.size(), 3U);
  EXPECT_EQ(read[0].material.name, "Dark Wood");
  EXPECT_EQ(read[0].material.reflectance, (Rgb{0.5, 0.5, 0.5}));
  EXPECT_FALSE(read[0].material.clear);
  EXPECT_TRUE(read[0].place.ends_with("names.mtl:2")) << read[0].place;
  EXPECT_EQ(read[1].material.name, "Dark");
  EXPECT_EQ(read[1].material.reflectance, (Rgb{0.5, 0.5, 0}));
  EXPECT_TRUE(read[1].material.clear);
  EXPECT_EQ(read[2].material.name, "Dark  Oak");
  EXPECT_EQ(read[2].material.exitance, (Rgb{7, 7, 7}));
}

TEST_F(MtlReading, FacesUseMaterialsByNamesWithBlanks) {
  temp_.Write("m.mtl", "newmtl Dark Wood\nKd 0.5\nKe 1\nnewmtl Dark\nKd 0\n");
  const Imported scene = ImportFile(temp_.Write(
      "s.obj",
      "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl Dark Wood \nf 1 2 3\n"));
  ASSERT_EQ(scene.info.materials.size(), 1U);
  EXPECT_EQ(scene.info.materials[0].reflectance, (Rgb{0.5, 0.5, 0.5}));
}

TEST_F(MtlReading, ANameThatComesAgainBeginsAnew) {
  const std::vector<MtlMaterial> read =
      Read("newmtl a\nKd 0.5\nd -halo 0.1\nnewmtl a\nKe 1 2 3\n");
  ASSERT_EQ(read.size(), 2U);
  EXPECT_FALSE(read[1].material.clear);
  EXPECT_EQ(read[1].material.reflectance, (Rgb{}));
}

TEST_F(MtlReading, WhatHasNoColourAndDoesNotEmitIsGrey) {
  const std::vector<MtlMaterial> read = Read(
      "newmtl wall\nmap_Kd plaster.jpg\n"
      "newmtl unlit\nKe 0 0 0\n"
      "newmtl lamp\nKe 9 9 9\n"
      "newmtl black\nKd 0 0 0\n");
  ASSERT_EQ(read.size(), 4U);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(read[i].is_assumed, i < 2) << i;
    EXPECT_EQ(read[i].material.reflectance[1], i < 2 ? 0.5 : 0) << i;
  }
}

TEST_F(MtlReading, ColoursThatAreAssumedAreToldOfWhereFacesHaveThem) {
  temp_.Write("m.mtl",
              "newmtl lamp\nKe 9\nnewmtl unused\nnewmtl wall\nNs 3\n"
              "newmtl pane\nd 0.1\nnewmtl told\nillum 1\nnewmtl floor\n");
  const auto obj = temp_.Write(
      "s.obj",
      "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 1\nusemtl lamp\n"
      "f 1 2 3\nusemtl floor\nf 1 2 4\nusemtl told\nf 1 3 4\n"
      "usemtl wall\nf 2 3 4\no o2\nf 2 4 1\nusemtl pane\nf 3 4 2\n");
  ImportOptions options;
  options.overrides =
      temp_.Write("o.json", R"({"materials": {"told": {"reflectance": 0.2}}})");
  const Imported scene = ImportFile(obj, options);
  EXPECT_TRUE(std::find(scene.info.notes.begin(),
                        scene.info.notes.end(),
                        "2 materials give no Kd (first: wall): taken as 0.5; "
                        "set them with --overrides") != scene.info.notes.end());
}

TEST_F(MtlReading, OpacityWinsOverTransparency) {
  for (const char* opaque : {"d 0.9\nTr 0.8", "d -halo 0.9\nTr 0.8"}) {
    const auto read = Read(std::string("newmtl a\n") + opaque + "\n");
    ASSERT_EQ(read.size(), 1U);
    EXPECT_FALSE(read[0].material.clear) << opaque;
  }
}

TEST_F(MtlReading, TheLastOfEqualLinesCounts) {
  const auto read = Read("Kd 0.9\nnewmtl a\nKd 0.1 0.2 0.3\nKd 0.5\nNs 3\n");
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].material.reflectance, (Rgb{0.5, 0.5, 0.5}));
}

TEST_F(MtlReading, OneMaterialAtATimeIsHeld) {
#ifndef ENFILADE_JEMALLOC
  GTEST_SKIP() << "sanitizers keep what is freed";
#endif
  constexpr size_t kCount = 20'000;
  std::string text;
  for (size_t i = 0; i < kCount; ++i) {
    text += "newmtl m" + std::to_string(i) + "\nKd 0.5 0.5 0.5\nKe 1\n";
  }
  const auto path = temp_.Write("many.mtl", text);
  const uint64_t before = BeginPeak();
  size_t count = 0;
  ReadMtl(path, [&](const MtlMaterial& /*m*/, double /*share*/) { ++count; });
  EXPECT_EQ(count, kCount);
  EXPECT_LT(PeakResidentBytes(), before + (8U << 20));
}

TEST_F(MtlReading, MaterialsAreChargedBeforeTheyAreKept) {
  std::string text;
  for (size_t i = 0; i < 20'000; ++i) {
    text += "newmtl m" + std::to_string(i) + "\nKd 0.5 0.5 0.5\nKe 1\n";
  }
  temp_.Write("many.mtl", text);
  const auto obj = temp_.Write(
      "s.obj",
      "mtllib many.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl m7\nf 1 2 3\n");
  EXPECT_EQ(ImportFile(obj).info.materials.size(), 1U);
  EXPECT_THROW(ImportFile(obj, {}, 4U << 20), DoesNotFitError);
}

TEST_F(MtlReading, SidesAreThoseOfTheirMaterialAlone) {
  const auto read =
      Read("newmtl a\nsides 1\nnewmtl b\nKd 1\nnewmtl c\nsides 2\n");
  ASSERT_EQ(read.size(), 3U);
  EXPECT_EQ(read[0].material.sides, 1);
  EXPECT_EQ(read[1].material.sides, 2);
  EXPECT_EQ(read[2].material.sides, 2);
  for (const char* wrong : {"sides", "sides 0", "sides 1 2", "sides one"}) {
    EXPECT_THROW(Read(std::string("newmtl a\n") + wrong + "\n"), InputError);
  }
}

// The values would otherwise go to the material before.
TEST_F(MtlReading, AMaterialWithoutANameIsRefused) {
  try {
    Read("newmtl a\nKd 0.5 0.5 0.5\n newmtl \nKd 0 0 0\n");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("names.mtl:3: 'newmtl'"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace enfilade
