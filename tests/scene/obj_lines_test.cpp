#include "scene/obj_files.h"

#include <algorithm>
#include <span>
#include <string>

#include "tests/scene/temp_scene.h"

namespace enfilade {
namespace {

constexpr const char* kLampMtl = "newmtl lamp\nKd 0\nKe 10\n";
constexpr const char* kLampObj =
    "mtllib m.mtl\nv 0 0 3\nv 0 1 3\nv 1 1 3\nv 1 0 3\n"
    "usemtl lamp\nf 1 2 3 4\n";

// A lamp, followed by more lines, of which the first is line 8.
class ObjLines : public ::testing::Test {
 protected:
  ObjLines() { temp_.Write("m.mtl", kLampMtl); }

  std::filesystem::path Write(const std::string& rest) {
    return temp_.Write("s.obj", kLampObj + rest);
  }

  TempScene temp_;
};

// Exporters write paths that end in a backslash into comments.
TEST_F(ObjLines, CommentsThatEndInABackslashEndThere) {
  temp_.Write("m.mtl", "# C:\\lamps\\\nnewmtl lamp\n \t# old\\\nKe 10 10 10\n");
  const Imported scene =
      ImportFile(Write("# C:\\models\\\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 5 6 7\n"));
  EXPECT_EQ(scene.faces.size(), 2U);
  EXPECT_EQ(scene.info.materials[0].exitance, (Rgb{10, 10, 10}));
}

TEST_F(ObjLines, NumbersMayBeFollowedByComments) {
  temp_.Write("m.mtl",
              "newmtl lamp # 1\nKd 0.5 0.5 0.5 # grey\nKe 10 10 10\t#bright\n"
              "d 1 # not clear\nnewmtl A#1 \nKd 0.2\n");
  const Imported scene = ImportFile(
      temp_.Write("s.obj",
                  "mtllib m.mtl\nv 0 0 3 # corner\nv 0 1 3\nv 1 1 3\t# 4 5\n"
                  "usemtl lamp # 1\nf 1 2 3 # top\nusemtl  A#1\n"
                  "f 3//1 2//2 1//3 # 1 2 3\n"));
  ASSERT_EQ(scene.faces.size(), 2U);
  EXPECT_EQ(scene.faces[0].vertices.size(), 3U);
  EXPECT_EQ(scene.info.materials[0].exitance, (Rgb{10, 10, 10}));
  EXPECT_EQ(scene.info.materials[1].reflectance, (Rgb{0.2, 0.2, 0.2}));
}

TEST_F(ObjLines, BlanksBeforeANameAreNoPartOfIt) {
  temp_.Write("m.mtl", "newmtl  lamp\nKe 10 10 10\n");
  EXPECT_EQ(ImportFile(Write("usemtl \tlamp\nf 1 2 3\n")).faces.size(), 2U);
}

TEST_F(ObjLines, BlanksBeforeABackslashAreNoPartOfAName) {
  const Imported scene = ImportFile(Write("usemtl lamp \\\n\nf 1 2 3\n"));
  EXPECT_EQ(scene.info.input_polygons, 2U);
}

// Of `g` the format takes each word for a name, which exporters ignore.
TEST_F(ObjLines, AnObjectHasAllWordsOfItsName) {
  for (const char* line :
       {"g Main Hall floor", "g  Main \tHall floor ", "o \tMain Hall floor"}) {
    ImportOptions options;
    options.overrides = temp_.Write(
        "o.json", R"({"objects": {"Main Hall floor": {"reflectance": 0.25}}})");
    const Imported scene = ImportFile(
        Write(std::string(line) + "\nusemtl lamp\nf 1 2 3\n"), options);
    ASSERT_EQ(scene.info.materials.size(), 2U) << line;
    EXPECT_EQ(scene.info.materials[1].reflectance, (Rgb{0.25, 0.25, 0.25}));
  }
}

TEST_F(ObjLines, MaterialFilesThatAreMissingAreNotKept) {
  std::string lines = "mtllib m.mtl\n";
  for (int i = 0; i < 1000; ++i) {
    lines += "mtllib none" + std::to_string(i) + ".mtl\n";
  }
  const auto obj = Write(lines);
  const auto files = FilesBehindObj(obj, [](std::span<const char>) {}).existing;
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(files[0].filename(), "m.mtl");
}

TEST_F(ObjLines, MaterialFilesMayBeNamedAsOnWindows) {
  temp_.Write("my paints/a b.mtl", "newmtl red\nKd 0.5 0 0\n");
  temp_.Write("paints/c.mtl", "newmtl blue\nKd 0 0 0.5\n");
  const auto obj = Write(
      "mtllib my paints\\a b.mtl\nusemtl red\nf 1 2 3\n"
      "mtllib none.mtl paints\\c.mtl\nusemtl blue\nf 1 3 4\n");
  const Imported scene = ImportFile(obj);
  ASSERT_EQ(scene.info.materials.size(), 3U);
  EXPECT_EQ(scene.info.materials[1].reflectance, (Rgb{0.5, 0, 0}));
  EXPECT_EQ(scene.info.materials[2].reflectance, (Rgb{0, 0, 0.5}));
  const auto files = FilesBehindObj(obj, [](std::span<const char>) {}).existing;
  ASSERT_EQ(files.size(), 3U);
  EXPECT_EQ(files[2].filename(), "c.mtl");
}

TEST_F(ObjLines, StatementsOfUnknownKindsAreToldOf) {
  const auto told = [](const Imported& scene) {
    for (const std::string& note : scene.info.notes) {
      if (note.find("unknown kinds") != std::string::npos) {
        return note;
      }
    }
    return std::string();
  };
  EXPECT_EQ(told(ImportFile(
                Write("# call\nvt 0 0\nvn 0 0 1\nvp 0\ns off\nl 1 2\np 1\n"
                      "g\nmg 0\ncstype bezier\ndeg 3\nend\n#fo 1 2 3\n"))),
            "");
  const std::string note = told(
      ImportFile(Write("fo 1 2 3\nvv 0 0 0\n call other.obj\n\xfe\x01\n")));
  EXPECT_TRUE(note.starts_with("4 lines of unknown kinds were passed over"))
      << note;
  EXPECT_NE(note.find("s.obj:8: 'fo')"), std::string::npos) << note;
}

// A piece that stands twice is read twice.
TEST_F(ObjLines, StatementsOfUnknownKindsInPiecesAreToldOf) {
  temp_.Write("piece.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nsurf\n");
  const Imported scene =
      ImportFile(Write("#instance piece.obj 0 0 0 0\nvv\n"
                       "#instance piece.obj 5 0 0 0\n"));
  EXPECT_TRUE(std::any_of(
      scene.info.notes.begin(), scene.info.notes.end(), [](const auto& note) {
        return note.starts_with("3 lines of unknown kinds") &&
               note.find("piece.obj:5: 'surf'") != std::string::npos;
      }));
}

TEST_F(ObjLines, ALineLongerThanAnyFaceIsRefused) {
  const std::string long_line = "f" + std::string(3 << 20, ' ') + "1 2 3\n";
  const std::string error = ImportError(Write("\n" + long_line));
  EXPECT_NE(error.find("s.obj:9: the line is longer than"), std::string::npos)
      << error;
  std::string continued = "f";
  for (int i = 0; i < 3 << 10; ++i) {
    continued += std::string(1 << 10, '1') + "\\\n";
  }
  EXPECT_NE(ImportError(Write(continued)).find("s.obj:8: the line is longer"),
            std::string::npos);
}

// The line parser takes 0e999 for a number, but the library computes it as 0
// times 10^999, which is not finite.
TEST_F(ObjLines, AVertexThatIsNotFiniteIsRefused) {
  for (const char* vertex : {"v 0e999 0 0", "v 0 0e999 0", "v 0 0 0e999"}) {
    EXPECT_NE(ImportError(Write(vertex)).find("s.obj:8: a coordinate"),
              std::string::npos)
        << vertex;
  }
}

TEST_F(ObjLines, NamesTooLongForAFileAreErrorsOfTheirLine) {
  std::string names;
  for (int i = 0; i < 100; ++i) {
    names += " lamp.mtl";
  }
  const std::string name(300, 'x');
  EXPECT_NE(ImportError(Write("mtllib" + names + "\nusemtl pink\n"))
                .find("s.obj:9: material 'pink'"),
            std::string::npos);
  EXPECT_NE(ImportError(Write("mtllib " + name + "\nusemtl pink\n"))
                .find("s.obj:9: material 'pink'"),
            std::string::npos);
  EXPECT_NE(ImportError(Write("#instance " + name + ".obj 0 0 0 0"))
                .find("s.obj:8: piece"),
            std::string::npos);
}

TEST_F(ObjLines, TheHashSeesWhereLinesEnd) {
  const auto one = HashSceneFiles(Write("#usemtl lamp\n"), {}).value;
  EXPECT_NE(one, HashSceneFiles(Write("#\nusemtl lamp\n"), {}).value);
}

TEST_F(ObjLines, TheHashSeesWhereFilesEnd) {
  const auto path = Write("mtllib n.mtl\n");
  temp_.Write("n.mtl", "newmtl b\n");
  const auto apart = HashSceneFiles(path, {}).value;
  temp_.Write("m.mtl", std::string(kLampMtl) + "newmtl b\n");
  temp_.Write("n.mtl", "");
  EXPECT_NE(apart, HashSceneFiles(path, {}).value);
}

}  // namespace
}  // namespace enfilade
