#include <algorithm>
#include <utility>

#include "tests/cpu_time.h"
#include "tests/scene/temp_scene.h"
#include <fmt/format.h>
#include <zlib.h>

namespace enfilade {
namespace {

constexpr const char* kMtl =
    "newmtl white\nKd 0.8 0.7 0.6\n"
    "newmtl lamp\nKd 0 0 0\nKe 10 20 30\n"
    "newmtl glass\nKd 0.2 0.2 0.2\nd 0.3\n"
    "newmtl smoke\nKd 0.2 0.2 0.2\nTr 0.7\n"
    "newmtl mirror\nKd 1 1 1\n";

// A lamp, followed by the given rest of the file.
std::string Scene(const std::string& rest) {
  return "mtllib m.mtl\n"
         "v 0 0 3\nv 0 1 3\nv 1 1 3\nv 1 0 3\n"
         "usemtl lamp\nf 1 2 3 4\n" +
         rest;
}

class ObjImport : public ::testing::Test {
 protected:
  ObjImport() { temp_.Write("m.mtl", kMtl); }

  Imported Import(const std::string& rest, const ImportOptions& options = {}) {
    return ImportFile(temp_.Write("s.obj", Scene(rest)), options);
  }

  std::string Error(const std::string& rest,
                    const ImportOptions& options = {}) {
    return ImportError(temp_.Write("s.obj", Scene(rest)), options);
  }

  TempScene temp_;
};

constexpr const char* kQuad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST_F(ObjImport, KeepsColourAndExitance) {
  const Imported scene = Import(std::string(kQuad) + "usemtl white\nf 5 6 7 8");
  ASSERT_EQ(scene.faces.size(), 2U);
  const Material& lamp = scene.info.materials[scene.faces[0].material.Index()];
  const Material& floor = scene.info.materials[scene.faces[1].material.Index()];
  EXPECT_EQ(lamp.exitance, (Rgb{10, 20, 30}));
  EXPECT_NEAR(floor.reflectance[0], 0.8, 1e-12);
  EXPECT_NEAR(floor.reflectance[2], 0.6, 1e-12);
  EXPECT_EQ(scene.info.input_polygons, 2U);
}

// A floor of 3 by 3 m: whichever axis it is level to is up. In gbXML z is.
TEST_F(ObjImport, UpIsWhatMoreAreaIsLevelTo) {
  EXPECT_FALSE(Import("v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nusemtl white\n"
                      "f 5 6 7 8\n")
                   .info.y_is_up);
  EXPECT_TRUE(Import("v 0 0 0\nv 0 0 3\nv 3 0 3\nv 3 0 0\nusemtl white\n"
                     "f 5 6 7 8\n")
                  .info.y_is_up);
}

TEST_F(ObjImport, MessagesGoOnAfterAZeroByte) {
  const std::string error = Error(std::string("v 0 0\0 1\n", 9));
  EXPECT_NE(error.find("'0?' is not a finite number"), std::string::npos)
      << error;
}

TEST_F(ObjImport, NegativeIndicesCountFromTheEnd) {
  const Imported scene =
      Import(std::string(kQuad) + "usemtl white\nf -4//1 -3/2 -2/1/1 -1");
  ASSERT_EQ(scene.faces.size(), 2U);
  EXPECT_EQ(scene.faces[1].vertices[0], (Point3{0, 0, 0}));
}

TEST_F(ObjImport, LinesMayContinueAndEndWithCarriageReturns) {
  const Imported scene =
      Import("v 0 0 0\r\nv 1 \\\r\n0 0\r\nv 1 1 0\r\nusemtl white \r\nf 5 6 7");
  EXPECT_NEAR(scene.Area(), 1.5, 1e-12);
}

TEST_F(ObjImport, GzippedFilesReadAlike) {
  const std::string text = Scene(std::string(kQuad) + "f 5 6 7 8\n");
  const auto path = temp_.Write("s.obj.gz", "");
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
  gzclose(file);
  EXPECT_EQ(ImportFile(path).faces.size(), 2U);
}

TEST_F(ObjImport, ClearMaterialsAreIgnored) {
  const Imported scene = Import(std::string(kQuad) +
                                "usemtl glass\nf 5 6 7 8\n"
                                "usemtl smoke\nf 5 6 7\n");
  EXPECT_EQ(scene.faces.size(), 1U);
  EXPECT_EQ(scene.info.input_polygons, 3U);
}

TEST_F(ObjImport, ASceneOfClearMaterialsAloneIsRefused) {
  const auto path =
      temp_.Write("c.obj",
                  "mtllib m.mtl\nusemtl glass\nv 0 0 0\nv 1 0 0\nv 1 1 0\n"
                  "f 1 2 3\n");
  try {
    ImportFile(path);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no surface is left of 1 polygon"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(ObjImport, ConcavePolygonsBecomeConvexFaces) {
  const Imported scene = Import(
      "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n"
      "usemtl white\nf 5 6 7 8 9 10");
  EXPECT_EQ(scene.faces.size(), 3U);
  EXPECT_NEAR(scene.Area(), 1 + 3, 1e-12);
}

// Exporters write such faces for edges; desks and chairs of catalogues have
// dozens.
TEST_F(ObjImport, FacesOfTwoVerticesAreDroppedAndTold) {
  const Imported scene = Import("f 1 2\nl 1 2\nf 3\n");
  EXPECT_EQ(scene.faces.size(), 1U);
  EXPECT_NE(std::find(scene.info.notes.begin(),
                      scene.info.notes.end(),
                      "2 faces of fewer than three vertices were dropped"),
            scene.info.notes.end());
}

// A room in millimetres is 4,000 units long. Read as metres, it would have
// nothing as small as the 2 mm that count as thick, close or wide.
TEST_F(ObjImport, ASceneThatIsNoBuildingsSizeNeedsItsUnit) {
  const auto room = [&](const std::string& length) {
    return temp_.Write("u.obj",
                       "mtllib m.mtl\nusemtl lamp\nv 0 0 0\nv " + length +
                           " 0 0\nv " + length + " 0 " + length +
                           "\nf 1 2 3\n");
  };
  for (const char* length : {"4000", "0.4", "0.004"}) {
    try {
      ImportFile(room(length));
      FAIL() << length;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("--unit"), std::string::npos);
    }
  }
  ImportOptions options;
  options.unit = 0.001;
  EXPECT_NEAR(ImportFile(room("4000"), options).Area(), 8, 1e-9);
  // A room in metres that is taken for one in millimetres is told of.
  const auto told_of = [](const Imported& scene) {
    return std::any_of(scene.info.notes.begin(),
                       scene.info.notes.end(),
                       [](const std::string& note) {
                         return note.find("by the --unit that was given") !=
                                std::string::npos;
                       });
  };
  EXPECT_FALSE(told_of(ImportFile(room("4000"), options)));
  EXPECT_TRUE(told_of(ImportFile(room("4"), options)));
  options.unit = 1000;
  EXPECT_NEAR(ImportFile(room("0.004"), options).Area(), 8, 1e-9);
  const auto in_km = HashSceneFiles(room("4"), options).value;
  EXPECT_NE(in_km, HashSceneFiles(room("4"), {}).value);
}

// The polygon is refused before anything is laid out over all of it.
TEST_F(ObjImport, APolygonThatIsAsLargeAsAPlanetIsRefusedAtOnce) {
  ImportOptions options;
  options.default_luminaires = true;
  const auto scene = [&](const std::string& far) {
    return temp_.Write(
        "far.obj", "v 0 0 0\nv " + far + " 0 0\nv 0 " + far + " 0\nf 1 2 3\n");
  };
  for (const char* far : {"1.1e5", "1e6", "9e7"}) {
    options.unit.reset();
    EXPECT_THROW(ImportFile(scene(far), options), InputError) << far;
    options.unit = 1;
    const std::string error = ImportError(scene(far), options);
    EXPECT_NE(error.find("by the --unit that was given"), std::string::npos)
        << far << error;
  }
  EXPECT_NE(ImportError(scene("9e4"), options).find("no ceiling"),
            std::string::npos);
}

// What is laid out is the house, and not the site on which it stands.
TEST_F(ObjImport, ASiteTakesNoMoreMemoryThanTheHouseOnIt) {
  const auto quad = [](double low, double high, double z) {
    return fmt::format(
        "v {0} {0} {2}\nv {1} {0} {2}\nv {1} {1} {2}\nv {0} {1} {2}\n"
        "f -4 -3 -2 -1\n",
        low,
        high,
        z);
  };
  ImportOptions options;
  options.default_luminaires = true;
  options.unit = 1;
  for (const double site : {10.0, 40'000.0}) {
    const auto scene = temp_.Write(
        "site.obj", quad(-site, site, 0) + quad(0, 4, 3) + quad(0, 4, 3.2));
    constexpr uint64_t kBudget = 20ULL << 20;
    EXPECT_EQ(ImportFile(scene, options, kBudget).faces.size(), 3U + 4U)
        << site;
  }
}

// Over the whole ground, which rises by 3 m, there are 10^10 places where a
// lamp might hang.
TEST_F(ObjImport, PlacesForLampsAreSoughtWhereRoomsAre) {
  const auto quad = [](double low, double high, double z, double rise) {
    return fmt::format(
        "v {0} {0} {2}\nv {1} {0} {3}\nv {1} {1} {3}\nv {0} {1} {2}\n"
        "f -4 -3 -2 -1\n",
        low,
        high,
        z + rise * low,
        z + rise * high);
  };
  const auto ground = [&](double low, double high) {
    return quad(low, high, 1.5, 5e-5);
  };
  std::string houses;
  std::string gardens;
  for (const double at : {-20'000.0, 0.0, 20'000.0}) {
    for (const double z : {3.0, 3.2, -3.0, -3.2}) {
      houses += quad(at, at + 4, z, 0);
    }
    gardens += ground(at - 10, at + 10);
  }
  ImportOptions options;
  options.default_luminaires = true;
  options.unit = 1;
  const auto site = temp_.Write("site.obj", houses + ground(-30'000, 30'000));
  const auto cut = temp_.Write("gardens.obj", houses + gardens);
  const size_t lamps = ImportFile(site, options).faces.size() - 13;
  EXPECT_GE(lamps, 8U);
  EXPECT_EQ(ImportFile(cut, options).faces.size() - 15, lamps);
  const auto seconds = [&](const std::filesystem::path& scene) {
    return CpuSecondsOf([&] { ImportFile(scene, options); });
  };
  EXPECT_LT(seconds(site), 10 * seconds(cut)) << "for as many places";
}

// A fence across the site hides no lamps beside it, and those under it not.
TEST_F(ObjImport, LongWallsKeepLampsOffWhereverTheyRun) {
  const auto lamps = [&](const std::string& wall) {
    ImportOptions options;
    options.default_luminaires = true;
    options.unit = 1;
    const std::string hall =
        "v 0 0 0\nv 60 0 0\nv 60 60 0\nv 0 60 0\nf 1 2 3 4\n"
        "v 0 0 3\nv 60 0 3\nv 60 60 3\nv 0 60 3\nf 8 7 6 5\n";
    return ImportFile(temp_.Write("hall.obj", hall + wall), options)
               .faces.size() -
           (wall.empty() ? 2U : 3U);
  };
  const size_t open = lamps("");
  const std::string steep =
      "v 1 -500 0\nv 59 500 0\nv 59 500 3\nv 1 -500 3\nf -4 -3 -2 -1\n";
  const std::string flat =
      "v -500 1 0\nv 500 59 0\nv 500 59 3\nv -500 1 3\nf -4 -3 -2 -1\n";
  const std::string away =
      "v -500 61 0\nv 500 61 0\nv 500 61 3\nv -500 61 3\nf -4 -3 -2 -1\n";
  EXPECT_EQ(lamps(away), open);
  EXPECT_NE(lamps(steep), open);
  EXPECT_EQ(lamps(steep), lamps(flat)) << "the same wall, mirrored";
}

TEST_F(ObjImport, AStrayVertexIsRefusedOnlyIfAPolygonHasIt) {
  const std::string stray = std::string(kQuad) + "v 0 0 9e9\nusemtl white\n";
  EXPECT_EQ(Import(stray + "f 5 6 7 8\n").faces.size(), 2U);
  const std::string error = Error(stray + "f 5 6 9\n");
  EXPECT_NE(error.find("vertex 9 is more than"), std::string::npos) << error;
}

TEST_F(ObjImport, AFileWithoutPolygonsIsNoScene) {
  for (const char* text : {"", "\x89PNG\r\n\x1a\n", "v 0 0 0\n"}) {
    const auto path = temp_.Write("empty.obj", text);
    try {
      ImportFile(path);
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("there is no polygon in it"),
                std::string::npos)
          << error.what();
    }
  }
}

TEST_F(ObjImport, WhatEmitsBeyondAllMeasureIsRefused) {
  for (const char* exitance : {"1e30 1 1", "1e-40 0 0"}) {
    temp_.Write("m.mtl",
                std::string("newmtl white\nKd .5 .5 .5\nnewmtl lamp\nKe ") +
                    exitance + "\n");
    const auto path = temp_.Write(
        "e.obj",
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl lamp\nf 1 2 3");
    try {
      ImportFile(path);
      FAIL() << exitance;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("'lamp' has exitance"),
                std::string::npos);
    }
  }
}

TEST_F(ObjImport, ErrorsNameFileAndLine) {
  EXPECT_NE(Error("f 1 2 99").find("s.obj:8: vertex 99"), std::string::npos);
  EXPECT_NE(Error("f 1 2 0").find("s.obj:8:"), std::string::npos);
  EXPECT_NE(Error("v 0 1e9 0\nf 1 2 5").find("s.obj:9: vertex 5 is more than"),
            std::string::npos);
  EXPECT_NE(Error("f 1 2 x").find("s.obj:8: 'x'"), std::string::npos);
  EXPECT_NE(Error("v 0 nan 0").find("s.obj:8: coordinate 'nan'"),
            std::string::npos);
  EXPECT_NE(Error("v 0 1e999 0").find("s.obj:8:"), std::string::npos);
  EXPECT_NE(Error("v 0 1").find("s.obj:8:"), std::string::npos);
  EXPECT_NE(Error("usemtl pink\nf 1 2 3").find("s.obj:8: material 'pink'"),
            std::string::npos);
  EXPECT_NE(Error("mtllib none.mtl\nusemtl pink\nf 1 2 3")
                .find("s.obj:9: material 'pink' is in no material file, and"),
            std::string::npos);
}

// A model that came without its material files.
TEST_F(ObjImport, MaterialsThatTheOverrideFileDescribesNeedNoMaterialFile) {
  const std::string pink =
      std::string(kQuad) + "mtllib none.mtl\nusemtl pink\nf 5 6 7 8\n";
  ImportOptions options;
  options.overrides =
      temp_.Write("o.json", R"({"materials": {"p*": {"exitance": 1}}})");
  EXPECT_NE(Error(pink, options).find("none.mtl does not exist"),
            std::string::npos);
  options.overrides =
      temp_.Write("o.json", R"({"materials": {"p*": {"reflectance": 0.3}}})");
  const Imported scene = Import(pink, options);
  ASSERT_EQ(scene.faces.size(), 2U);
  EXPECT_EQ(
      scene.info.materials[scene.faces[1].material.Index()].reflectance[1],
      0.3);
  EXPECT_TRUE(std::any_of(scene.info.notes.begin(),
                          scene.info.notes.end(),
                          [](const std::string& note) {
                            return note.find("none.mtl does not exist") !=
                                   std::string::npos;
                          }));
  options.overrides =
      temp_.Write("o.json", R"({"materials": {"pink": {"clear": true}}})");
  EXPECT_EQ(Import(pink, options).faces.size(), 1U);
  options.overrides = temp_.Write("o.json",
                                  R"({"materials": {"p*": {"clear": true},
                                      "pink": {"clear": false}}})");
  EXPECT_NE(Error(pink, options).find("none.mtl does not exist"),
            std::string::npos);
}

TEST_F(ObjImport, PiecesShareMaterialsThatTheOverrideFileDescribes) {
  temp_.Write("piece.obj", std::string(kQuad) + "usemtl pink\nf 1 2 3 4\n");
  ImportOptions options;
  options.overrides =
      temp_.Write("o.json", R"({"materials": {"pink": {"reflectance": 0.3}}})");
  const Imported scene = Import(
      "#instance piece.obj 0 0 0 0\n#instance piece.obj 4 0 0 0\n", options);
  EXPECT_EQ(scene.faces.size(), 3U);
  EXPECT_EQ(scene.info.materials.size(), 2U);
}

TEST_F(ObjImport, NumbersInMaterialFilesAreChecked) {
  temp_.Write("m.mtl", "newmtl lamp\nKe 1 1 1\nKd 0.5 nan 0.5\n");
  EXPECT_NE(Error("").find("m.mtl:3: 'nan' of material 'lamp'"),
            std::string::npos);
}

// One value stands for three. A material with a halo is clear only towards its
// silhouette.
TEST_F(ObjImport, ColoursOfOneValueAreGrey) {
  temp_.Write("m.mtl",
              "newmtl lamp\nKd 0\nKe 20\n"
              "newmtl white\nKd 0.5\nd -halo 0.9\n");
  const Imported scene = Import(std::string(kQuad) + "usemtl white\nf 5 6 7 8");
  ASSERT_EQ(scene.faces.size(), 2U);
  const Material& lamp = scene.info.materials[scene.faces[0].material.Index()];
  const Material& floor = scene.info.materials[scene.faces[1].material.Index()];
  EXPECT_EQ(lamp.exitance, (Rgb{20, 20, 20}));
  EXPECT_EQ(floor.reflectance, (Rgb{0.5, 0.5, 0.5}));
  temp_.Write("m.mtl", "newmtl lamp\nKe 20 20\n");
  EXPECT_NE(Error("").find("m.mtl:2"), std::string::npos);
  temp_.Write("m.mtl", "newmtl lamp\nKe 20\nd -1\n");
  EXPECT_NE(Error("").find("m.mtl:3"), std::string::npos);
}

TEST_F(ObjImport, AByteOrderMarkIsNoPartOfTheFirstWord) {
  const std::string mark = "\xef\xbb\xbf";
  temp_.Write("m.mtl", mark + kMtl);
  const auto path = temp_.Write("s.obj", mark + Scene(""));
  EXPECT_EQ(ImportFile(path).faces.size(), 1U);
}

TEST_F(ObjImport, RulesThatMatchNothingAreTold) {
  ImportOptions options;
  options.overrides = temp_.Write("o.json",
                                  R"({"materials": {"lamp": {"sides": 1},
                        "lmap": {"exitance": 5}}})");
  std::string notes;
  for (const std::string& note : Import("", options).info.notes) {
    notes += note + "\n";
  }
  EXPECT_NE(notes.find("o.json:2: 'lmap' matches nothing"), std::string::npos);
  EXPECT_EQ(notes.find("'lamp'"), std::string::npos);
}

TEST_F(ObjImport, ReflectanceOfOneIsRefusedWhereUsedAndTheMendWorks) {
  EXPECT_EQ(Error(""), "") << "nothing uses the mirror";
  const std::string used = std::string(kQuad) + "usemtl mirror\nf 5 6 7 8";
  const std::string error = Error(used);
  EXPECT_NE(error.find("m.mtl:13: material 'mirror'"), std::string::npos)
      << error;
  ImportOptions options;
  options.overrides = temp_.Write("o.json", error.substr(error.find('{')));
  EXPECT_EQ(Error(used, options), "");
}

// The suggested mend is JSON with a pattern for the material's name.
TEST_F(ObjImport, TheMendWorksWhateverTheNameHolds) {
  const std::string used =
      std::string(kQuad) + "mtllib n.mtl\nusemtl a[1]*?\"\\b c\nf 5 6 7 8";
  temp_.Write("n.mtl", "newmtl a[1]*?\"\\b c\nKd 1 1 1\n");
  const std::string error = Error(used);
  ImportOptions options;
  options.overrides = temp_.Write("o.json", error.substr(error.find('{')));
  EXPECT_EQ(Error(used, options), "") << error;
}

TEST_F(ObjImport, SceneWithoutLightIsRefused) {
  const auto path =
      temp_.Write("dark.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3");
  EXPECT_NE(ImportError(path).find("--default-luminaires"), std::string::npos);
}

TEST_F(ObjImport, PolygonsWithoutMaterialAreGrey) {
  ImportOptions options;
  options.overrides =
      temp_.Write("o.json", R"({"materials": {"default*": {"exitance": 3}}})");
  const Imported scene = ImportFile(
      temp_.Write("grey.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3"), options);
  ASSERT_EQ(scene.info.materials.size(), 1U);
  EXPECT_EQ(scene.info.materials[0].reflectance, (Rgb{0.5, 0.5, 0.5}));
  EXPECT_EQ(scene.info.materials[0].exitance, (Rgb{3, 3, 3}));
}

TEST_F(ObjImport, VerticesSpillUnderASmallBudget) {
  std::string text = "mtllib m.mtl\nusemtl lamp\n";
  constexpr int kStrips = 30000;
  for (int i = 0; i < kStrips; ++i) {
    const std::string x = std::to_string(3 * i);
    text += "v " + x + " 0 0\nv " + x + " 1 0\nv " + x + " 0 1\n";
  }
  for (int i = kStrips; i > 0; --i) {  // from the last back to the first
    const int v = 3 * i;
    text += "o s" + std::to_string(i) + "\nf " + std::to_string(v - 2) + " " +
            std::to_string(v - 1) + " " + std::to_string(v) + "\n";
  }
  const auto path = temp_.Write("many.obj", text);
  ImportOptions options;
  options.unit = 1;  // 90 km of them
  const Imported roomy = ImportFile(path, options);
  const Imported tight = ImportFile(path, options, 1ULL << 20);
  ASSERT_EQ(roomy.faces.size(), size_t{kStrips});
  ASSERT_EQ(tight.faces.size(), size_t{kStrips});
  for (size_t i = 0; i < roomy.faces.size(); ++i) {
    ASSERT_EQ(roomy.faces[i].vertices, tight.faces[i].vertices);
  }
}

TEST_F(ObjImport, HashNoticesEveryInputFile) {
  const auto path = temp_.Write("s.obj", Scene(""));
  ImportOptions options;
  const auto before = HashSceneFiles(path, options).value;
  EXPECT_EQ(before, ImportFile(path).info.source_hash);
  temp_.Write("m.mtl", std::string(kMtl) + "# changed\n");
  const auto with_other_mtl = HashSceneFiles(path, options).value;
  EXPECT_NE(before, with_other_mtl);
  options.sides = 1;
  EXPECT_NE(with_other_mtl, HashSceneFiles(path, options).value);
}

TEST_F(ObjImport, TheHashTellsWhereAFileIsGone) {
  const auto path = temp_.Write("s.obj", Scene(""));
  ASSERT_TRUE(HashSceneFiles(path, {}).is_whole);
  std::filesystem::remove(path.parent_path() / "m.mtl");
  EXPECT_FALSE(HashSceneFiles(path, {}).is_whole);
  ImportOptions options;
  options.overrides = path.parent_path() / "none.json";
  temp_.Write("m.mtl", kMtl);
  EXPECT_FALSE(HashSceneFiles(path, options).is_whole);
}

// When each line that continues the one before was searched from the beginning,
// four times as many lines took sixteen times as long. One pass takes four
// times, and the bound lies between.
TEST_F(ObjImport, ManyContinuedBlankLinesAreReadInOnePass) {
  const auto seconds = [&](int lines) {
    std::string text;
    for (int i = 0; i < lines; ++i) {
      text += "\\\n";
    }
    text = std::string(kQuad) + text + "\nusemtl white\nf 5 6 7 8\n";
    return CpuSecondsOf([&] { EXPECT_EQ(Import(text).faces.size(), 2U); });
  };
  EXPECT_LT(seconds(100'000), 8 * seconds(25'000));
}

// A ceiling of small tiles in two colours is no plane of one material, and its
// tiles are not joined.
TEST_F(ObjImport, LampsHangFromCeilingsOfSmallTiles) {
  temp_.Write("tiles.mtl",
              "newmtl a\nKd 0.5 0.5 0.5\nnewmtl b\nKd 0.6 0.6 0.6\n");
  const auto lamps_under = [&](int tiles) {
    constexpr double kRoom = 4.8;
    const double size = kRoom / tiles;
    std::string text = "mtllib tiles.mtl\n";
    for (const int z : {0, 3}) {
      for (int i = 0; i < tiles * tiles; ++i) {
        const double x = size * (i % tiles);
        const double y = size * (i / tiles);
        text +=
            fmt::format("usemtl {}\n", (i + i / tiles) % 2 == 0 ? "a" : "b");
        for (const auto& [dx, dy] :
             {std::pair{0.0, 0.0}, {size, 0.0}, {size, size}, {0.0, size}}) {
          text += fmt::format("v {} {} {}\n", x + dx, y + dy, z);
        }
        text += z == 0 ? "f -4 -3 -2 -1\n" : "f -1 -2 -3 -4\n";
      }
    }
    ImportOptions options;
    options.default_luminaires = true;
    return ImportFile(temp_.Write("tiles.obj", text), options).faces.size() -
           static_cast<size_t>(2 * tiles * tiles);
  };
  EXPECT_EQ(lamps_under(8), 4U);   // tiles of 0.6 m
  EXPECT_EQ(lamps_under(16), 4U);  // of 0.3 m
}

}  // namespace
}  // namespace enfilade
