#include "base/memory.h"
#include "base/photometry.h"
#include "base/planar_polygon.h"
#include "base/winding_number.h"
#include "scene/gbxml_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "tests/cpu_time.h"
#include "tests/scene/temp_scene.h"
#include <zlib.h>

namespace enfilade {
namespace {

std::string Loop(const std::vector<Point3>& points) {
  std::string text = "<PlanarGeometry><PolyLoop>";
  for (const Point3 p : points) {
    text += "<CartesianPoint>";
    for (size_t i = 0; i < 3; ++i) {
      text += "<Coordinate>" + std::to_string(p[i]) + "</Coordinate>";
    }
    text += "</CartesianPoint>";
  }
  return text + "</PolyLoop></PlanarGeometry>";
}

std::string Surface(const std::string& type,
                    const std::vector<std::string>& spaces,
                    const std::vector<Point3>& points,
                    const std::string& openings = "") {
  std::string text = "<Surface id=\"s\" surfaceType=\"" + type + "\">";
  for (const std::string& space : spaces) {
    text += "<AdjacentSpaceId spaceIdRef=\"" + space + "\"/>";
  }
  return text + Loop(points) + openings + "</Surface>";
}

std::string Box(const std::string& space, double x0, double x1, bool west) {
  const double y = 2;
  const double z = 3;
  std::string text =
      Surface("SlabOnGrade",
              {space},
              {{x0, 0, 0}, {x1, 0, 0}, {x1, y, 0}, {x0, y, 0}}) +
      Surface(
          "Roof", {space}, {{x0, 0, z}, {x1, 0, z}, {x1, y, z}, {x0, y, z}}) +
      Surface("ExteriorWall",
              {space},
              {{x0, 0, 0}, {x1, 0, 0}, {x1, 0, z}, {x0, 0, z}}) +
      Surface("ExteriorWall",
              {space},
              {{x0, y, 0}, {x1, y, 0}, {x1, y, z}, {x0, y, z}});
  const double x = west ? x0 : x1;
  return text + Surface("ExteriorWall",
                        {space},
                        {{x, 0, 0}, {x, y, 0}, {x, y, z}, {x, 0, z}});
}

// Two rooms, a from x = 0 to 2 and b from 2 to 4, with a wall between them.
std::string TwoRooms(const std::string& between,
                     const std::string& unit = "Meters") {
  return "<gbXML lengthUnit=\"" + unit +
         "\"><Campus><Building><Space id=\"a\"/><Space id=\"b\"/></Building>" +
         Box("a", 0, 2, true) + Box("b", 2, 4, false) + between +
         "</Campus></gbXML>";
}

const std::vector<Point3> kWall = {{2, 0, 0}, {2, 2, 0}, {2, 2, 3}, {2, 0, 3}};

std::string WallWithDoor(const std::vector<std::string>& spaces) {
  return Surface(
      "InteriorWall",
      spaces,
      kWall,
      "<Opening openingType=\"NonSlidingDoor\">" +
          Loop({{2, 0.5, 0}, {2, 1.5, 0}, {2, 1.5, 2}, {2, 0.5, 2}}) +
          "</Opening>");
}

class GbxmlImport : public ::testing::Test {
 protected:
  Imported Import(const std::string& text,
                  const std::string& overrides = "{}",
                  bool strip = false) {
    ImportOptions options;
    options.overrides = temp_.Write("o.json", overrides);
    options.default_luminaires = true;
    options.strip_spaces = strip;
    return ImportFile(temp_.Write("s.xml", text), options);
  }

  TempScene temp_;
};

// The winding number round p of the space's boundary, wound as the faces and
// openings claim: 1 inside and 0 outside if every claim is right.
double Winding(const Imported& scene, SpaceId space, Point3 p) {
  std::vector<Triangle3> surface;
  const auto add = [&](const std::vector<Point3>& v, bool outwards) {
    ForEachTriangle(v, [&](Point3 a, Point3 b, Point3 c) {
      surface.push_back(outwards ? Triangle3{a, b, c} : Triangle3{a, c, b});
    });
  };
  const auto add_sides = [&](const auto& f) {
    if (f.front_space == space && f.back_space != space) {
      add(f.vertices, false);
    } else if (f.back_space == space && f.front_space != space) {
      add(f.vertices, true);
    }
  };
  for (const Face& face : scene.faces) {
    add_sides(face);
  }
  for (const Opening& opening : scene.info.openings) {
    add_sides(opening);
  }
  return WindingNumber(surface, p);
}

// Casts rays from just off every face into the Spaces that the face claims;
// returns how many claims about closed Spaces are wrong.
size_t WrongSides(const Imported& scene, size_t& checked) {
  constexpr double kOffMetres = 0.004;
  size_t wrong = 0;
  for (const Face& face : scene.faces) {
    const Vec3 normal = Normalize(AreaVector(face.vertices));
    const Point3 middle = Lerp(
        Lerp(face.vertices[0], face.vertices[1], 0.5), face.vertices[2], 0.4);
    const std::array<std::pair<std::optional<SpaceId>, Point3>, 2> claims{
        {{face.front_space, middle + normal * kOffMetres},
         {face.back_space, middle - normal * kOffMetres}}};
    for (const auto& [space, point] : claims) {
      if (space && scene.info.spaces[space->Index()].closed) {
        ++checked;
        wrong += std::abs(Winding(scene, *space, point) - 1) > 0.1 ? 1U : 0U;
      }
    }
  }
  return wrong;
}

TEST_F(GbxmlImport, HowFarVerticesWereMovedIsKept) {
  EXPECT_EQ(Import(TwoRooms(Surface("InteriorWall", {"a", "b"}, kWall)))
                .info.greatest_move_m,
            0);
  const Imported moved = Import(
      TwoRooms(Surface("InteriorWall",
                       {"a", "b"},
                       {{2, 0, 0}, {2, 2, 0}, {2, 2, 3}, {2, 0, 2.9992}})));
  EXPECT_NEAR(moved.info.greatest_move_m, 8e-4, 1e-9);
}

TEST_F(GbxmlImport, WithoutAUnitItIsMetresAndSaysSo) {
  std::string text = TwoRooms(WallWithDoor({"a", "b"}));
  text.replace(text.find(" lengthUnit=\"Meters\""), 20, "");
  const Imported scene = Import(text);
  EXPECT_NEAR(scene.info.bounds.high.x, 4, 1e-9);
  EXPECT_TRUE(std::any_of(scene.info.notes.begin(),
                          scene.info.notes.end(),
                          [](const std::string& note) {
                            return note.find("no lengthUnit") !=
                                   std::string::npos;
                          }));
}

TEST_F(GbxmlImport, StrippedSpacesMayBeNamedAmiss) {
  const std::string text = TwoRooms(WallWithDoor({"a", "nowhere"}));
  EXPECT_THROW(Import(text), InputError);
  EXPECT_EQ(Import(text, "{}", /*strip=*/true).Area(),
            Import(TwoRooms(WallWithDoor({"a", "b"})), "{}", true).Area());
}

TEST_F(GbxmlImport, DoorIsAHoleAndAnOpeningBetweenItsSpaces) {
  const Imported scene = Import(TwoRooms(WallWithDoor({"a", "b"})));
  ASSERT_EQ(scene.info.openings.size(), 1U);
  EXPECT_NEAR(PolygonArea(scene.info.openings[0].vertices), 2, 1e-12);
  EXPECT_EQ(scene.info.gbxml->interior_doors, 1U);
  EXPECT_EQ(scene.info.gbxml->closed_spaces, 2U);
  double wall = 0;
  for (const Face& face : scene.faces) {
    const Material& m = scene.info.materials[face.material.Index()];
    wall += m.name == "InteriorWall" ? PolygonArea(face.vertices) : 0;
  }
  EXPECT_NEAR(wall, 6 - 2, 1e-12);
}

TEST_F(GbxmlImport, SidesAreFoundWhateverTheFileSays) {
  for (const auto& spaces : {std::vector<std::string>{"a", "b"}, {"b", "a"}}) {
    const Imported scene = Import(TwoRooms(WallWithDoor(spaces)));
    size_t checked = 0;
    EXPECT_EQ(WrongSides(scene, checked), 0U);
    EXPECT_GT(checked, 10U);
    // The wall's normal is +x, towards b.
    EXPECT_EQ(scene.info.openings[0].front_space, SpaceId(1U));
    EXPECT_EQ(scene.info.openings[0].back_space, SpaceId(0U));
  }
}

// The rooms are 2 by 2 m and 3 m high, so that more area faces y than z.
TEST_F(GbxmlImport, ZIsUpWhateverTheFaces) {
  const Imported scene = Import(TwoRooms(WallWithDoor({"a", "b"})));
  double y_m2 = 0;
  double z_m2 = 0;
  for (const Face& face : scene.faces) {
    const Vec3 area = AreaVector(face.vertices);
    y_m2 += std::abs(area.y);
    z_m2 += std::abs(area.z);
  }
  EXPECT_GT(y_m2, z_m2);
  EXPECT_FALSE(scene.info.y_is_up);
}

TEST_F(GbxmlImport, ClosedDoorIsAFace) {
  const Imported scene = Import(TwoRooms(WallWithDoor({"a", "b"})), R"({
      "surfaces": {"NonSlidingDoor": {"clear": false, "reflectance": 0.3}}})");
  EXPECT_TRUE(scene.info.openings.empty());
  EXPECT_EQ(scene.info.gbxml->interior_doors, 1U);
}

TEST_F(GbxmlImport, AirIsWhollyOpen) {
  const Imported scene = Import(TwoRooms(Surface("Air", {"a", "b"}, kWall)));
  ASSERT_EQ(scene.info.openings.size(), 1U);
  EXPECT_EQ(scene.info.gbxml->open_boundaries, 1U);
  EXPECT_NEAR(PolygonArea(scene.info.openings[0].vertices), 6, 1e-12);
}

TEST_F(GbxmlImport, OpeningOutsideOfItsSurfaceIsToldOf) {
  const auto wall_with_door_from = [](double y) {
    return Surface(
        "InteriorWall",
        {"a", "b"},
        kWall,
        "<Opening openingType=\"NonSlidingDoor\">" +
            Loop({{2, y, 0}, {2, y + 1, 0}, {2, y + 1, 2}, {2, y, 2}}) +
            "</Opening>");
  };
  const auto told_of = [&](double y) {
    const Imported scene = Import(TwoRooms(wall_with_door_from(y)));
    return std::any_of(scene.info.notes.begin(),
                       scene.info.notes.end(),
                       [](const std::string& note) {
                         return note.starts_with("1 openings lie outside");
                       });
  };
  EXPECT_FALSE(told_of(0.5));
  EXPECT_FALSE(told_of(1.5)) << "half of it is a door";
  EXPECT_TRUE(told_of(7));
}

TEST_F(GbxmlImport, EveryCampusIsRead) {
  std::string text = TwoRooms(WallWithDoor({"a", "b"}));
  const Imported one = Import(text);
  text.insert(text.find("</gbXML>"),
              "<Campus><Building><Space id=\"c\"/></Building>" +
                  Box("c", 10, 12, true) + "</Campus>");
  const Imported two = Import(text);
  EXPECT_EQ(two.info.gbxml->spaces, one.info.gbxml->spaces + 1);
  EXPECT_EQ(two.info.gbxml->surfaces, one.info.gbxml->surfaces + 5);
  EXPECT_NEAR(two.info.bounds.high.x, 12, 1e-12);
}

// A shell that lies in one plane has no inside. Its middle surface names the
// Space twice; the surface belongs to the Space because less of it is open that
// way.
TEST_F(GbxmlImport, EverySurfaceWhoseSidesAreUnclearIsToldOf) {
  const auto strip = [](double low, const std::vector<std::string>& spaces) {
    return Surface(
        "ExteriorWall",
        spaces,
        {{10, 0, low}, {10, 2, low}, {10, 2, low + 1}, {10, 0, low + 1}});
  };
  std::string text = TwoRooms(WallWithDoor({"a", "b"}));
  text.insert(text.find("</gbXML>"),
              "<Campus><Building><Space id=\"c\"/></Building>" +
                  strip(0, {"c"}) + strip(1, {"c", "c"}) + strip(2, {"c"}) +
                  "</Campus>");
  const Imported scene = Import(text);
  EXPECT_TRUE(std::any_of(scene.info.notes.begin(),
                          scene.info.notes.end(),
                          [](const std::string& note) {
                            return note.starts_with(
                                "3 surfaces lie in shells too broken");
                          }));
}

// Each of the room's twelve walls is a surface that names the room twice, and
// so is a partition inside of it.
TEST_F(GbxmlImport, ManyWallsThatNameTheirSpaceTwiceCloseIt) {
  constexpr size_t kWalls = 12;
  constexpr double kHeight = 3;
  std::vector<Point3> floor;
  for (size_t i = 0; i < kWalls; ++i) {
    const double angle = 2 * kPi * static_cast<double>(i) / kWalls;
    floor.push_back({5 * std::cos(angle), 5 * std::sin(angle), 0});
  }
  std::vector<Point3> roof = floor;
  for (Point3& p : roof) {
    p.z = kHeight;
  }
  std::string text =
      "<gbXML lengthUnit=\"Meters\"><Campus><Building><Space id=\"a\"/>"
      "</Building>" +
      Surface("SlabOnGrade", {"a"}, floor) + Surface("Roof", {"a"}, roof) +
      Surface("InteriorWall",
              {"a", "a"},
              {{0, 0, 0}, {2, 0, 0}, {2, 0, kHeight}, {0, 0, kHeight}});
  for (size_t i = 0; i < kWalls; ++i) {
    const size_t next = (i + 1) % kWalls;
    text += Surface("ExteriorWall",
                    {"a", "a"},
                    {floor[i], floor[next], roof[next], roof[i]});
  }
  const Imported scene = Import(text + "</Campus></gbXML>");
  EXPECT_EQ(scene.info.gbxml->closed_spaces, 1U);
  for (const Face& face : scene.faces) {
    const Point3 middle = VertexMean(face.vertices);
    if (Emits(scene.info.materials[face.material.Index()])) {
      continue;
    }
    const bool is_wall = std::hypot(middle.x, middle.y) > 4;
    EXPECT_EQ(face.front_space && face.back_space,
              !is_wall && middle.z > 0 && middle.z < kHeight)
        << middle.x << " " << middle.y << " " << middle.z;
  }
}

// For each wall that was left out, each other one was once tried against all
// edges of the room: four times the walls took 64 times as long. Trying each
// once takes 16 times, and the bound lies between.
TEST_F(GbxmlImport, WallsThatNameTheirSpaceTwiceAreTriedOnceEach) {
  constexpr double kHeight = 3;
  constexpr double kSide = 40;
  std::string text =
      "<gbXML lengthUnit=\"Meters\"><Campus><Building><Space id=\"a\"/>"
      "</Building>" +
      Surface("SlabOnGrade",
              {"a"},
              {{0, 0, 0}, {kSide, 0, 0}, {kSide, kSide, 0}, {0, kSide, 0}}) +
      Surface("Roof",
              {"a"},
              {{0, 0, kHeight},
               {kSide, 0, kHeight},
               {kSide, kSide, kHeight},
               {0, kSide, kHeight}});
  const auto wall = [&](Point3 from, Point3 to) {
    const Vec3 up = {0, 0, kHeight};
    return Surface("InteriorWall", {"a", "a"}, {from, to, to + up, from + up});
  };
  for (const auto& [from, to] :
       {std::pair{Point3{0, 0, 0}, Point3{kSide, 0, 0}},
        {{kSide, 0, 0}, {kSide, kSide, 0}},
        {{kSide, kSide, 0}, {0, kSide, 0}},
        {{0, kSide, 0}, {0, 0, 0}}}) {
    text += wall(from, to);
  }
  ImportOptions options;
  options.default_luminaires = true;
  const auto seconds = [&](int walls) {
    std::string more;
    for (int i = 0; i < walls; ++i) {
      const double x = 2 + 2 * (i % 18);
      const double y = 2 + 2 * (i / 18);
      more += wall({x, y, 0},
                   i % 2 == 0 ? Point3{x + 2, y, 0} : Point3{x, y + 1.5, 0});
    }
    const auto path =
        temp_.Write("many.xml", text + more + "</Campus></gbXML>");
    return CpuSecondsOf([&] {
      EXPECT_EQ(ImportFile(path, options).info.gbxml->closed_spaces, 1U);
    });
  };
  EXPECT_LT(seconds(300), 32 * seconds(75));
}

TEST_F(GbxmlImport, MissingWallLeavesBothSpacesOpen) {
  EXPECT_EQ(Import(TwoRooms("")).info.gbxml->closed_spaces, 0U);
}

TEST_F(GbxmlImport, TextThatIsDividedIsReadWhole) {
  std::string text = TwoRooms(WallWithDoor({"a", "b"}));
  const std::string whole = "<Coordinate>4.000000<";
  for (size_t at = text.find(whole); at != std::string::npos;
       at = text.find(whole, at + 1)) {
    text.replace(at, whole.size(), "<Coordinate>4<!-- m --><![CDATA[.5]]><");
  }
  EXPECT_NEAR(Import(text).info.bounds.high.x, 4.5, 1e-12);
}

TEST_F(GbxmlImport, FeetBecomeMetres) {
  const Imported scene = Import(TwoRooms(WallWithDoor({"a", "b"}), "Yards"));
  EXPECT_NEAR(scene.info.bounds.high.x, 4 * 0.9144, 1e-12);
}

TEST_F(GbxmlImport, EverySpaceGetsALampOfItsOwn) {
  const Imported scene = Import(TwoRooms(WallWithDoor({"a", "b"})));
  std::array<int, 2> lamps{};
  for (const Face& face : scene.faces) {
    if (Emits(scene.info.materials[face.material.Index()])) {
      ASSERT_TRUE(face.front_space.has_value());
      EXPECT_EQ(face.back_space, face.front_space);
      EXPECT_LT(AreaVector(face.vertices).z, 0) << "lamps shine down";
      ++lamps[face.front_space->Index()];
    }
  }
  EXPECT_GE(lamps[0], 1);
  EXPECT_GE(lamps[1], 1);
}

TEST_F(GbxmlImport, StrippedScenesHaveNoSpaces) {
  const Imported scene =
      Import(TwoRooms(WallWithDoor({"a", "b"})), "{}", /*strip=*/true);
  EXPECT_TRUE(scene.info.spaces.empty());
  EXPECT_TRUE(scene.info.openings.empty());
  for (const Face& face : scene.faces) {
    EXPECT_FALSE(face.front_space || face.back_space);
  }
}

TEST_F(GbxmlImport, ErrorsNameTheSurface) {
  const auto error = [&](const std::string& between) {
    return ImportError(temp_.Write("s.xml", TwoRooms(between)));
  };
  EXPECT_NE(error(Surface("Roof", {"x"}, kWall)).find("Surface 's'"),
            std::string::npos);
  EXPECT_NE(error("<Surface id=\"q\"/>").find("Surface 'q'"),
            std::string::npos);
  EXPECT_NE(error("</Oops>").find("s.xml:1: not valid XML"), std::string::npos);
}

// The parser counts in the UTF-8 that it makes of the file.
TEST_F(GbxmlImport, LinesOfUtf16AreCounted) {
  const std::u16string text =
      u"<?xml version=\"1.0\" encoding=\"UTF-16\"?>\n<gbXML>\n<!-- "
      u"\u00fc\u4e2d "
      u"-->\n\n<a></b>\n</gbXML>\n";
  for (const bool is_big : {false, true}) {
    std::string bytes = is_big ? "\xfe\xff" : "\xff\xfe";
    for (const char16_t unit : text) {
      const auto low = static_cast<char>(unit & 0xff);
      const auto high = static_cast<char>(unit >> 8);
      bytes += is_big ? high : low;
      bytes += is_big ? low : high;
    }
    const std::string error = ImportError(temp_.Write("s.xml", bytes));
    EXPECT_NE(error.find("s.xml:5: not valid XML"), std::string::npos) << error;
  }
}

// A stray point or a wrong unit makes the building so large that its parts
// could not be placed.
TEST_F(GbxmlImport, WhatIsNoBuildingsSizeIsRefused) {
  const auto error = [&](const std::string& text) {
    return ImportError(temp_.Write("s.xml", text));
  };
  const std::vector<Point3> stray = {{1e6, 0, 0}, {2, 2, 0}, {2, 2, 3}};
  EXPECT_NE(error(TwoRooms(Surface("InteriorWall", {"a", "b"}, stray)))
                .find("Surface 's' is 1e+06 m long"),
            std::string::npos);
  const std::vector<Point3> lost = {{1e300, 0, 0}, {2, 2, 0}, {2, 2, 3}};
  EXPECT_NE(error(TwoRooms(Surface("Roof", {"a"}, lost)))
                .find("Surface 's': a CartesianPoint"),
            std::string::npos);
  for (const char* unit : {"Miles", "Millimeters"}) {
    const std::string message = error(TwoRooms(WallWithDoor({"a", "b"}), unit));
    EXPECT_NE(message.find(std::string("lengthUnit '") + unit + "'"),
              std::string::npos)
        << message;
  }
}

// A file of a few kilobytes unpacks to a hundred megabytes.
TEST_F(GbxmlImport, IsReadNoFurtherThanTheBudgetHolds) {
  const std::string blanks(size_t{100} << 20, ' ');
  const std::string path = temp_.Write("s.xml.gz", "");
  gzFile file = gzopen(path.c_str(), "wb");
  ASSERT_EQ(gzwrite(file, blanks.data(), static_cast<unsigned>(blanks.size())),
            static_cast<int>(blanks.size()));
  gzclose(file);
  MemoryBudget budget(uint64_t{16} << 20);
  const auto store = CreateStoreInMemory();
  const uint64_t before = ResidentBytes();
  try {
    ImportScene(path, {}, budget, *store);
    ADD_FAILURE() << "it was read";
  } catch (const DoesNotFitError& error) {
    // The cap that the message names is enough for the whole file.
    const std::string message = error.what();
    const std::string option = "--memory ";
    const size_t at = message.find(option);
    ASSERT_NE(at, std::string::npos) << message;
    EXPECT_GE(std::stoull(message.substr(at + option.size())) << 20,
              MemoryBudget::CapForBudget(BytesToImport(path)));
  }
  EXPECT_GE(BytesToImport(path), blanks.size());
  EXPECT_LT(ResidentBytes(), before + (uint64_t{32} << 20));
}

TEST_F(GbxmlImport, TheModelStaysChargedWhileThereIsOne) {
  const auto path =
      temp_.Write("s.xml", TwoRooms(Surface("InteriorWall", {"a"}, kWall)));
  MemoryBudget budget(uint64_t{16} << 20);
  {
    const GbxmlModel model = ReadGbxmlModel(path, false, budget);
    EXPECT_GE(
        budget.UsedBytes(),
        model.surfaces.size() * (sizeof(GbxmlSurface) + 4 * sizeof(Point3)));
    EXPECT_LT(budget.UsedBytes(), budget.PeakBytes() / 2);
  }
  EXPECT_EQ(budget.UsedBytes(), 0U);
}

struct Expected {
  const char* file;
  uint32_t spaces, surfaces, doors, open, shells;
};

TEST(RealGbxml, CountsAreThoseOfTheData) {
  ENFILADE_NEEDS_DATA();
  constexpr Expected kExpected[] = {
      {"london.xml", 50, 418, 42, 6, 50},
      {"bristol.xml", 87, 571, 30, 0, 87},
      {"boston-utf16.xml", 26, 245, 11, 13, 26},
      {"berlin1.xml.gz", 244, 1303, 92, 0, 244},
      {"berlin2.xml.gz", 388, 2131, 315, 0, 388},
      {"columbia-broken-shells.xml", 37, 715, 29, 15, 5}};
  ImportOptions options;
  options.default_luminaires = true;
  for (const Expected& e : kExpected) {
    const Imported scene = ImportFile(DataFolder() / "gbxml" / e.file, options);
    ASSERT_TRUE(scene.info.gbxml.has_value());
    EXPECT_EQ(scene.info.gbxml->spaces, e.spaces) << e.file;
    EXPECT_EQ(scene.info.gbxml->surfaces, e.surfaces) << e.file;
    EXPECT_EQ(scene.info.gbxml->interior_doors, e.doors) << e.file;
    EXPECT_EQ(scene.info.gbxml->open_boundaries, e.open) << e.file;
    EXPECT_EQ(scene.info.gbxml->closed_shells, e.shells) << e.file;
  }
}

TEST(RealGbxml, FacesLieBetweenTheSpacesTheyClaim) {
  ENFILADE_NEEDS_DATA();
  ImportOptions options;
  options.default_luminaires = true;
  for (const char* file : {"london.xml", "bristol.xml", "boston-utf16.xml"}) {
    const Imported scene = ImportFile(DataFolder() / "gbxml" / file, options);
    size_t checked = 0;
    const size_t wrong = WrongSides(scene, checked);
    EXPECT_EQ(wrong, 0U) << file << ", of " << checked;
    EXPECT_GT(checked, scene.faces.size() / 2) << file;
  }
}

TEST(RealObj, EveryBuildingImportsUnderTheBudget) {
  ENFILADE_NEEDS_DATA();
  const TempScene temp;
  ImportOptions options;
  options.default_luminaires = true;
  options.overrides =
      temp.Write("o.json", R"({"materials": {"*": {"reflectance": 0.5}}})");
  const std::pair<const char*, uint64_t> expected[] = {
      {"duplex.obj", 26720},
      {"townhouse.obj", 13882},
      {"schependomlaan.obj.gz", 410414}};
  for (const auto& [file, polygons] : expected) {
    const Imported scene = ImportFile(DataFolder() / "obj" / file, options);
    EXPECT_EQ(scene.info.input_polygons, polygons) << file;
    EXPECT_GT(scene.faces.size(), 10000U) << file;
  }
}

}  // namespace
}  // namespace enfilade
