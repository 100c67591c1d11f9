// Floor plans furnished with pieces from OBJ files.

#include "base/error.h"
#include "scene/import.h"
#include "scene/instance_line.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include "tests/tools/scene_obj_text.h"
#include "tools/scenes/layout.h"
#include "tools/scenes/piece_furnisher.h"
#include "tools/scenes/piece_library.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

namespace enfilade::testing {
namespace {

// A wedge with Y up in the given units: five faces, its rear (-Z) upright.
std::string Wedge(double width, double height, double depth) {
  std::string text = "mtllib none.mtl\nusemtl oak\n";
  for (const double x : {3.0, 3.0 + width}) {
    text += fmt::format(
        "v {} 7 5\nv {} 7 {}\nv {} {} 5\n", x, x, 5 + depth, x, 7 + height);
  }
  return text +
         "f 1 3 6 4\nf 1 4 5 2\nf 2 5 6 3\nf 1 2 3\nusemtl brass\n"
         "f 4 6 5\nf 1 2\n";
}

class Pieces : public ::testing::Test {
 protected:
  Pieces() {
    std::filesystem::create_directory(dir_.Path() / "in");
    WriteFile(dir_ / "in/table.obj", Wedge(120, 75, 60));
    WriteFile(dir_ / "in/a stool.obj", Wedge(40, 45, 35));
  }

  FloorplanOptions Options(uint32_t rooms) {
    FloorplanOptions options;
    options.rooms = rooms;
    options.pieces.folder = dir_.Path() / "in";
    options.note = [this](const std::string& note) { notes_ += note + "\n"; };
    return options;
  }

  std::filesystem::path Write(const FloorplanOptions& options,
                              const std::string& name = "out.obj") {
    ObjWriter writer(dir_.Path() / name);
    WriteFloorplan(options, writer);
    writer.Finish();
    polygons_ = writer.Polygons();
    return dir_.Path() / name;
  }

  std::string Error(const FloorplanOptions& options) {
    try {
      Write(options);
    } catch (const enfilade::Error& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder dir_;
  std::string notes_;
  uint64_t polygons_ = 0;
};

struct Placed {
  std::string object;
  std::string piece;
  Rect plan;  // of the rectangle around the turned piece
  double z = 0;
};

// The instances of a scene, with the pieces' sizes by their files.
std::vector<Placed> InstancesOf(const std::filesystem::path& obj,
                                const std::vector<Piece>& pieces) {
  std::vector<Placed> placed;
  std::istringstream in(ReadFile(obj));
  std::string object;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("o ")) {
      object = line.substr(2);
    }
    const auto words = WordsAfterInstance(line);
    if (!words) {
      continue;
    }
    const InstanceReading read = ReadInstance(*words);
    EXPECT_TRUE(read.instance) << read.error;
    const auto piece =
        std::find_if(pieces.begin(), pieces.end(), [&](const Piece& p) {
          return p.file == read.instance->piece;
        });
    Placed p;
    p.object = object;
    p.piece = piece->name;
    Box3 box;
    for (const double x : {-piece->width / 2, piece->width / 2}) {
      for (const double y : {-piece->depth / 2, piece->depth / 2}) {
        box.Include(read.instance->placement.At({x, y, 0}));
      }
    }
    p.plan = {box.low.x, box.high.x, box.low.y, box.high.y};
    p.z = box.low.z;
    placed.push_back(p);
  }
  return placed;
}

// Rooms of the plan by name, with the floor's height.
std::map<std::string, std::pair<PlanSpace, double>> RoomsOf(
    const FloorplanOptions& options) {
  std::map<std::string, std::pair<PlanSpace, double>> rooms;
  ForEachWing(options, [&](uint32_t storey, const WingPlan& plan) {
    for (const PlanSpace& space : plan.spaces) {
      rooms[space.name] = {space, RoundToMillimetre(storey * kStoreyHeight)};
    }
  });
  return rooms;
}

TEST_F(Pieces, AreCopiedUprightInMetresWithTheirRearAtMinusY) {
  const auto pieces =
      CopyPieces(Options(1).pieces, dir_.Path() / "out.obj", Options(1).note);
  ASSERT_EQ(pieces.size(), 2U);
  EXPECT_EQ(pieces[0].name, "a-stool");
  EXPECT_EQ(pieces[1].file, "out_pieces/table.obj");
  EXPECT_EQ(pieces[1].polygons, 5U) << "the line of two vertices is no face";
  EXPECT_NEAR(pieces[1].width, 1.2, 1e-9);
  EXPECT_NEAR(pieces[1].depth, 0.6, 1e-9);
  EXPECT_NEAR(pieces[1].height, 0.75, 1e-9);
  EXPECT_NE(notes_.find("a centimetre"), std::string::npos);
  const std::string text = ReadFile(dir_.Path() / pieces[1].file);
  EXPECT_NE(text.find("v 0.6 -0.3 0.75\n"), std::string::npos) << text;
  EXPECT_EQ(text.find("v 0.6 0.3 0.75\n"), std::string::npos) << text;
  EXPECT_NE(text.find("v 0.6 0.3 0\n"), std::string::npos) << text;
  EXPECT_NE(ReadFile(dir_ / "out_pieces/table.mtl").find("newmtl oak\nKd"),
            std::string::npos);
}

// The way through a door and 0.9 m on both sides of it.
Rect WayThrough(const PlanDoorway& door) {
  constexpr double kWay = 0.9;
  const Rect& gap = door.opening;
  return door.axis == Axis::kX
             ? Rect{door.from - kWay, door.to + kWay, gap.u0, gap.u1}
             : Rect{gap.u0, gap.u1, door.from - kWay, door.to + kWay};
}

TEST_F(Pieces, KeepOffTheWaysThroughDoors) {
  const FloorplanOptions options = Options(60);
  const auto obj = Write(options);
  const auto placed =
      InstancesOf(obj, CopyPieces(options.pieces, dir_.Path() / "out.obj", {}));
  EXPECT_FALSE(placed.empty());
  ForEachWing(options, [&](uint32_t, const WingPlan& plan) {
    for (const PlanDoorway& door : plan.doorways) {
      for (const Placed& p : placed) {
        EXPECT_FALSE(p.plan.Overlaps(WayThrough(door))) << p.object;
      }
    }
  });
}

TEST_F(Pieces, StandOnTheFloorOfTheirRoomsAndKeepOffWallsAndEachOther) {
  FloorplanOptions options = Options(60);
  options.storeys = 3;
  const auto obj = Write(options);
  const auto rooms = RoomsOf(options);
  const auto placed =
      InstancesOf(obj, CopyPieces(options.pieces, dir_.Path() / "out.obj", {}));
  ASSERT_EQ(placed.size(), 60U * options.pieces_per_room);
  for (size_t i = 0; i < placed.size(); ++i) {
    const auto& [room, floor_z] = rooms.at(RoomOf(placed[i].object));
    EXPECT_EQ(placed[i].z, floor_z);
    EXPECT_TRUE(room.Box().Contains(placed[i].plan)) << placed[i].object;
    for (size_t k = 0; k < i; ++k) {
      EXPECT_FALSE(placed[k].z == floor_z &&
                   placed[k].plan.Overlaps(placed[i].plan))
          << placed[i].object << " and " << placed[k].object;
    }
  }
}

TEST_F(Pieces, NoTwoRoomsAreFurnishedAlike) {
  const FloorplanOptions options = Options(300);
  const auto obj = Write(options);
  const auto rooms = RoomsOf(options);
  std::map<std::string, std::string> looks;
  for (const Placed& p : InstancesOf(
           obj, CopyPieces(options.pieces, dir_.Path() / "out.obj", {}))) {
    const Rect box = rooms.at(RoomOf(p.object)).first.Box();
    looks[RoomOf(p.object)] += fmt::format("{} {:.3f} {:.3f} {:.3f};",
                                           p.piece,
                                           p.plan.u0 - box.u0,
                                           p.plan.v0 - box.v0,
                                           p.plan.u1 - box.u0);
  }
  std::set<std::string> different;
  for (const auto& [room, look] : looks) {
    different.insert(look);
  }
  EXPECT_EQ(looks.size(), 300U);
  EXPECT_EQ(different.size(), looks.size());
}

TEST_F(Pieces, SameSeedSameBytesOfTheSceneAndThePieces) {
  FloorplanOptions options = Options(20);
  const auto all = [&] {
    std::string text = ReadFile(Write(options));
    for (const char* name : {"table.obj", "table.mtl", "a-stool.obj"}) {
      text += ReadFile(dir_.Path() / "out_pieces" / name);
    }
    return text;
  };
  const std::string first = all();
  EXPECT_EQ(all(), first);
  options.seed = 2;
  EXPECT_NE(all(), first);
}

TEST_F(Pieces, ImportFindsThePolygonsThatWereCounted) {
  const auto obj = Write(Options(12));
  const auto store = CreateStoreInMemory();
  MemoryBudget budget(uint64_t{64} << 20);
  EXPECT_EQ(ImportScene(obj, {}, budget, *store).input_polygons, polygons_);
  FloorplanOptions empty = Options(12);
  empty.pieces_per_room = 0;
  const uint64_t furnished = polygons_;
  Write(empty);
  EXPECT_EQ(furnished - polygons_, 12U * 5 * 5) << "rooms, pieces, faces";
}

TEST_F(Pieces, APieceLargerThanAnyRoomIsLeftOutWithANote) {
  WriteFile(dir_ / "in/ship.obj", Wedge(4000, 200, 1500));
  WriteFile(dir_ / "in/mast.obj", Wedge(20, 400, 20));
  const std::string text = ReadFile(Write(Options(8)));
  EXPECT_EQ(text.find("ship"), std::string::npos);
  EXPECT_NE(notes_.find("ship (40.00 x 15.00 x 2.00 m) is larger"),
            std::string::npos)
      << notes_;
  EXPECT_NE(notes_.find("mast (0.20 x 0.20 x 4.00 m) is larger"),
            std::string::npos)
      << notes_;
}

TEST_F(Pieces, FaultsOfTheFolderAreNamed) {
  FloorplanOptions options = Options(4);
  options.pieces.folder = dir_.Path() / "none";
  EXPECT_NE(Error(options).find("none: is not a folder"), std::string::npos);
  std::filesystem::create_directory(options.pieces.folder);
  EXPECT_NE(Error(options).find("holds no OBJ file"), std::string::npos);
  WriteFile(dir_ / "none/readme.txt", "text");
  EXPECT_NE(Error(options).find("holds no OBJ file"), std::string::npos);
  WriteFile(dir_ / "none/e.obj", "v 0 0 0\n");
  EXPECT_NE(Error(options).find("none of its 1 OBJ files has a face"),
            std::string::npos);
  WriteFile(dir_ / "none/f.obj", "v 0 0 0\nf 1 2 x\n");
  EXPECT_NE(Error(options).find("f.obj:2: 'x'"), std::string::npos);
  options = Options(4);
  options.pieces.metres_per_unit = 1;
  EXPECT_NE(Error(options).find("every piece is larger"), std::string::npos);
  options.pieces.metres_per_unit = -1;
  EXPECT_THROW(Write(options), UsageError);
  EXPECT_FALSE(std::filesystem::exists(dir_ / "out.obj"));
}

// Names in files end at blanks: a blank in the scene's name stays out of those
// of its pieces, and materials that differ by one stay apart.
TEST_F(Pieces, BlanksInNamesAreNotWritten) {
  std::filesystem::create_directory(dir_ / "blank");
  WriteFile(dir_ / "blank/box.mtl",
            "newmtl a b\nKd 0.1 0.1 0.1\nnewmtl a_b\nKd 0.7 0.7 0.7\n");
  WriteFile(dir_ / "blank/box.obj",
            "mtllib box.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\n"
            "usemtl a b\nf 1 2 3 4\nusemtl a_b\nf 1 5 4\n");
  const auto made = RunProgram({"scene",
                                "floorplan",
                                "--rooms",
                                "4",
                                "--pieces",
                                dir_ / "blank",
                                dir_ / "my office.obj"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const auto info = RunProgram({"info", dir_ / "my office.obj"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_TRUE(std::filesystem::exists(dir_ / "my_office_pieces/box.obj"));
  const std::string materials = ReadFile(dir_ / "my_office_pieces/box.mtl");
  EXPECT_NE(materials.find("newmtl a_b\n"), std::string::npos) << materials;
  EXPECT_NE(materials.find("newmtl a_b-2\n"), std::string::npos) << materials;
}

TEST_F(Pieces, TheCommandLineFurnishesAndKeepsOptionsApart) {
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"scene", "floorplan", "--rooms", "9"});
    arguments.push_back(dir_ / "cli.obj");
    return RunProgram(arguments);
  };
  const auto made = run({"--pieces",
                         dir_ / "in",
                         "--pieces-per-room",
                         "2",
                         "--piece-unit",
                         "0.01"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const std::string text = ReadFile(dir_ / "cli.obj");
  size_t lines = 0;
  for (size_t at = text.find("#instance"); at != std::string::npos;
       at = text.find("#instance", at + 1)) {
    ++lines;
  }
  EXPECT_EQ(lines, 18U);
  EXPECT_EQ(run({"--pieces", dir_ / "in", "--furniture", "1"}).exit_code, 2);
  EXPECT_EQ(run({"--pieces-per-room", "2"}).exit_code, 2);
  EXPECT_EQ(run({"--pieces", dir_ / "none"}).exit_code, 3);
}

}  // namespace
}  // namespace enfilade::testing
