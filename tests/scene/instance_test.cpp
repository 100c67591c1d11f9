// Pieces that an OBJ places by #instance lines.

#include "scene/instance_line.h"

#include <algorithm>
#include <cmath>

#include "tests/scene/temp_scene.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr const char* kLamp =
    "mtllib m.mtl\n"
    "v 0 0 3\nv 0 1 3\nv 1 1 3\nv 1 0 3\n"
    "o lamp\nusemtl lamp\nf 1 2 3 4\n";
constexpr const char* kSceneMtl =
    "newmtl lamp\nKd 0 0 0\nKe 10 20 30\nnewmtl paint\nKd 0.8 0.8 0.8\n";

// A triangle and a quadrilateral above it. One of their two materials has the
// name of a material of the scene.
constexpr const char* kPiece =
    "mtllib piece.mtl\n"
    "v 1 0 0\nv 0 2 0\nv 0 0 0.5\n"
    "g first\nusemtl paint\nf 1 2 3\n"
    "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "g second\nusemtl cloth\nf -4 -3 -2 -1\n";
constexpr const char* kPieceMtl =
    "newmtl paint\nKd 0.1 0.2 0.3\nnewmtl cloth\nKd 0.4 0.4 0.4\n";

class Instances : public ::testing::Test {
 protected:
  Instances() {
    temp_.Write("m.mtl", kSceneMtl);
    temp_.Write("p/piece.obj", kPiece);
    temp_.Write("p/piece.mtl", kPieceMtl);
  }

  std::filesystem::path Scene(const std::string& rest) {
    return temp_.Write("s.obj", kLamp + rest);
  }

  std::string Error(const std::string& rest) {
    return ImportError(Scene(rest));
  }

  TempScene temp_;
};

std::vector<Point3> TurnedTo(std::vector<Point3> vertices, Point3 first) {
  const auto at = std::find(vertices.begin(), vertices.end(), first);
  std::rotate(vertices.begin(), at, vertices.end());
  return vertices;
}

TEST_F(Instances, QuarterTurnsAndDyadicMovesAreExact) {
  const Imported scene =
      ImportFile(Scene("o chair\n#instance p/piece.obj 10 -20 0.25 90 2\n"));
  ASSERT_EQ(scene.faces.size(), 3U);
  EXPECT_EQ(scene.info.input_polygons, 3U);
  EXPECT_EQ(
      TurnedTo(scene.faces[1].vertices, {10, -18, 0.25}),
      (std::vector<Point3>{{10, -18, 0.25}, {6, -20, 0.25}, {10, -20, 1.25}}));
  EXPECT_EQ(
      TurnedTo(scene.faces[2].vertices, {10, -20, 2.25}),
      (std::vector<Point3>{
          {10, -20, 2.25}, {10, -18, 2.25}, {8, -18, 2.25}, {8, -20, 2.25}}));
}

TEST(InstancePlacement, TurnsAsARotationAboutZDoes) {
  const InstancePlacement placement({1, 2, 3}, 30, 0.5);
  const Point3 p = placement.At({2, 4, 6});
  EXPECT_NEAR(p.x, 1 + std::sqrt(3) / 2 - 1, 1e-14);
  EXPECT_NEAR(p.y, 2 + 0.5 + std::sqrt(3), 1e-14);
  EXPECT_EQ(p.z, 6);
  for (int turns = -8; turns <= 8; ++turns) {
    const Point3 q = InstancePlacement({}, 90.0 * turns, 1).At({3, 5, 7});
    EXPECT_EQ(std::abs(q.x) + std::abs(q.y), 8) << turns;
  }
}

TEST_F(Instances, MaterialsComeFromThePieceAndTheObjectFromTheScene) {
  const Imported scene =
      ImportFile(Scene("o chair\nusemtl paint\n#instance p/piece.obj 0 0 0 0\n"
                       "f 1 2 3\n"
                       "o other\n#instance p/piece.obj 0 5 0 0\n"));
  ASSERT_EQ(scene.faces.size(), 6U);
  const auto red = [&](size_t face) {
    return scene.info.materials[scene.faces[face].material.Index()]
        .reflectance[0];
  };
  EXPECT_NEAR(red(1), 0.1, 1e-12);
  EXPECT_NEAR(red(2), 0.4, 1e-12);
  EXPECT_NEAR(red(3), 0.8, 1e-12) << "the scene's goes on";
  EXPECT_EQ(scene.faces[1].object, scene.faces[3].object);
  EXPECT_NE(scene.faces[1].object, scene.faces[4].object);
  EXPECT_EQ(scene.faces[1].material, scene.faces[4].material)
      << "a piece's materials are one however often it stands";
  EXPECT_EQ(scene.info.materials.size(), 4U);
}

// The parser adds up to 17 rounded digits, of coordinates below 32, for each of
// three axes.
constexpr double kReadingError = 3 * 17 * 32 * 0x1.0p-53;

// The piece as OBJ text with its vertices moved, in place of an instance.
std::string Flat(const Instance& instance) {
  std::string text = "mtllib flat.mtl\n";
  for (const Point3 p : {Point3{1, 0, 0},
                         Point3{0, 2, 0},
                         Point3{0, 0, 0.5},
                         Point3{0, 0, 1},
                         Point3{1, 0, 1},
                         Point3{1, 1, 1},
                         Point3{0, 1, 1}}) {
    const Point3 q = instance.placement.At(p);
    text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", q.x, q.y, q.z);
  }
  return text + "usemtl tint\nf -7 -6 -5\nusemtl cloth\nf -4 -3 -2 -1\n";
}

TEST_F(Instances, AreTheSameFacesAsTheSceneWrittenOutFlat) {
  temp_.Write("flat.mtl",
              "newmtl tint\nKd 0.1 0.2 0.3\nnewmtl cloth\nKd 0.4 0.4 0.4\n");
  std::string placed;
  std::string flat;
  for (int i = 0; i < 7; ++i) {
    const std::string words = fmt::format(
        " p/piece.obj {} {} 0.01 {} 1.{}", 0.37 * i, 3.1 * i, 49 * i, i);
    const InstanceReading read = ReadInstance(words);
    ASSERT_TRUE(read.instance) << read.error;
    placed += fmt::format("o o{}\n#instance{}\n", i, words);
    flat += fmt::format("o o{}\n{}", i, Flat(*read.instance));
  }
  const Imported a = ImportFile(Scene(placed));
  const Imported b = ImportFile(Scene(flat));
  ASSERT_EQ(a.faces.size(), 15U);
  ASSERT_EQ(b.faces.size(), a.faces.size());
  for (size_t i = 0; i < a.faces.size(); ++i) {
    ASSERT_EQ(a.faces[i].vertices.size(), b.faces[i].vertices.size()) << i;
    for (size_t v = 0; v < a.faces[i].vertices.size(); ++v) {
      EXPECT_LE(Length(a.faces[i].vertices[v] - b.faces[i].vertices[v]),
                kReadingError)
          << i;
    }
    EXPECT_EQ(a.faces[i].material, b.faces[i].material) << i;
    EXPECT_EQ(a.faces[i].object, b.faces[i].object) << i;
  }
}

// A piece that is read twice: a strip whose vertices, 1.4 MB, exceed the
// quarter of the budget that vertices may have.
TEST_F(Instances, ALargePieceIsReadUnderASmallBudget) {
  constexpr int kSteps = 30'000;
  std::string text = "mtllib piece.mtl\n";
  for (int i = 0; i <= kSteps; ++i) {
    text += fmt::format("v {} 0 {}\nv {} 1 {}\n", i, i % 2, i, i % 2);
  }
  for (int i = 0; i < kSteps; ++i) {
    if (i % 1000 == 0) {  // batches of cleaning
      text += i % 2000 == 0 ? "usemtl paint\n" : "usemtl cloth\n";
    }
    const int v = 2 * i + 1;
    text += fmt::format("f {} {} {} {}\n", v, v + 1, v + 3, v + 2);
  }
  temp_.Write("p/strip.obj", text);
  constexpr const char* kLine = "#instance p/strip.obj 0 {} 0 0\n";
  ImportOptions options;
  options.unit = 1;  // the strip is 30 km long
  const Imported scene = ImportFile(
      Scene(fmt::format(kLine, 0) + fmt::format(kLine, 5)), options, 2 << 20);
  EXPECT_EQ(scene.faces.size(), 2U * kSteps + 1);
  EXPECT_NEAR(scene.Area(), 1 + 2 * kSteps * std::sqrt(2.0), 1e-6 * kSteps);
}

TEST_F(Instances, FaultsNameFileAndLine) {
  const auto expect = [&](const std::string& line, const std::string& what) {
    const std::string error = Error(line + "\n");
    EXPECT_NE(error.find("s.obj:9: "), std::string::npos) << error;
    EXPECT_NE(error.find(what), std::string::npos) << error;
  };
  expect("#instance p/none.obj 0 0 0 0", "none.obj does not exist");
  expect("#instance p 0 0 0 0", "does not exist");
  expect("#instance p/piece.obj 0 zero 0 0", "'zero' is not a finite number");
  expect("#instance p/piece.obj 0 0 nan 0", "'nan' is not a finite number");
  expect("#instance p/piece.obj 0 0 0", "has 4 words");
  expect("#instance p/piece.obj 0 0 0 0 1 1", "has 7 words");
  expect("#instance", "has 0 words");
  expect("#instance ../p/piece.obj 0 0 0 0", "leaves the folder");
  expect("#instance /p/piece.obj 0 0 0 0", "leaves the folder");
  expect("#instance p/../../piece.obj 0 0 0 0", "leaves the folder");
  expect("#instance p/piece.obj 0 0 0 0 0", "scale 0 is not above 0");
  expect("#instance p/piece.obj 0 0 0 0 -1", "scale -1 is not above 0");
}

TEST_F(Instances, FaultsInsideAPieceNameItsLine) {
  temp_.Write("p/bad.obj", "v 0 0 0\nf 1 2 3\n");
  EXPECT_NE(Error("#instance p/bad.obj 0 0 0 0\n").find("bad.obj:2: vertex 2"),
            std::string::npos);
}

TEST_F(Instances, APieceCannotHoldPiecesNorTheSceneItself) {
  temp_.Write("p/nest.obj", "v 0 0 0\n#instance piece.obj 0 0 0 0\n");
  EXPECT_NE(Error("#instance p/nest.obj 0 0 0 0\n").find("nest.obj:2: a piece"),
            std::string::npos);
  EXPECT_NE(Error("#instance s.obj 0 0 0 0\n").find("s.obj:9: a piece"),
            std::string::npos);
}

TEST_F(Instances, LongerWordsAreComments) {
  EXPECT_EQ(ImportFile(Scene("#instances are explained elsewhere\n"
                             "# instance p/none.obj 0 0 0 0\n"))
                .faces.size(),
            1U);
}

TEST_F(Instances, TheHashCoversPiecesAndTheirMaterials) {
  const auto path = Scene("#instance p/piece.obj 0 0 0 0\n");
  const auto before = HashSceneFiles(path, {}).value;
  EXPECT_EQ(HashSceneFiles(path, {}).value, before);
  temp_.Write("p/piece.obj", std::string(kPiece) + "f -1 -2 -3\n");
  const auto other_piece = HashSceneFiles(path, {}).value;
  EXPECT_NE(other_piece, before);
  temp_.Write("p/piece.mtl", std::string(kPieceMtl) + "newmtl x\nKd 0 0 0\n");
  EXPECT_NE(HashSceneFiles(path, {}).value, other_piece);
}

}  // namespace
}  // namespace enfilade
