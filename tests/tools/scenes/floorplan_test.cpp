// The office building and the stream it is written to.

#include "tools/scenes/floorplan.h"

#include "base/check.h"
#include "base/error.h"
#include "base/planar_polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "tests/tools/run_program.h"
#include "tests/tools/scene_obj_text.h"
#include "tools/scenes/layout.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade::testing {
namespace {

bool IsShell(const std::string& object) {
  for (const char* part :
       {"_floor", "_walls", "_ceiling", "_lamps", "_outside", "_doorway"}) {
    if (object.find(part) != std::string::npos) {
      return true;
    }
  }
  return false;
}

std::vector<ReadPolygon> ShellOf(const ReadScene& scene) {
  std::vector<ReadPolygon> shell;
  std::copy_if(scene.polygons.begin(),
               scene.polygons.end(),
               std::back_inserter(shell),
               [](const ReadPolygon& p) { return IsShell(p.object); });
  return shell;
}

// The rooms of a kind, by name, with their plan.
std::map<std::string, Rect> Floors(const ReadScene& scene,
                                   const std::string& kind) {
  std::map<std::string, Box3> boxes;
  for (const ReadPolygon& p : scene.polygons) {
    if (p.object.find(kind) != std::string::npos &&
        p.object.ends_with("_floor")) {
      boxes[RoomOf(p.object)].Include(BoundsOf(p.vertices));
    }
  }
  std::map<std::string, Rect> plans;
  for (const auto& [name, box] : boxes) {
    plans[name] = {box.low.x, box.high.x, box.low.y, box.high.y};
  }
  return plans;
}

struct Case {
  uint32_t rooms, storeys;
  double furniture;
  uint64_t seed;
};

class Floorplans : public ::testing::TestWithParam<Case> {
 protected:
  [[nodiscard]] static FloorplanOptions Options() {
    const Case c = GetParam();
    return {c.rooms, c.storeys, c.furniture, c.seed};
  }
};

INSTANTIATE_TEST_SUITE_P(Buildings,
                         Floorplans,
                         ::testing::Values(Case{1, 1, 1, 1},
                                           Case{2, 1, 0.5, 2},
                                           Case{3, 3, 0.5, 3},
                                           Case{5, 1, 1, 4},
                                           Case{17, 1, 0.5, 5},
                                           Case{60, 1, 0.5, 1},
                                           Case{61, 4, 1, 6},
                                           Case{200, 3, 0, 7}));

TEST_P(Floorplans, WallsAndSlabsBoundASolidWithoutGaps) {
  const std::vector<ReadPolygon> shell =
      ShellOf(Generate(WriteFloorplan, Options()));
  EXPECT_TRUE(EdgesCancel(shell));
  EXPECT_GT(EnclosedVolume(shell), 0) << "fronts face the air";
}

TEST_P(Floorplans, FacesAreSoundQuadrilaterals) {
  const ReadScene scene = Generate(WriteFloorplan, Options());
  EXPECT_TRUE(AllFacesAreSound(scene));
  EXPECT_TRUE(std::all_of(
      scene.polygons.begin(), scene.polygons.end(), [](const ReadPolygon& p) {
        return p.vertices.size() == 4;
      }));
}

TEST_P(Floorplans, HasTheRoomsThatWereAskedFor) {
  const ReadScene scene = Generate(WriteFloorplan, Options());
  EXPECT_EQ(Floors(scene, "_office").size() + Floors(scene, "_hall").size(),
            GetParam().rooms);
}

// The walk begins in the outline's first space and goes through doorways and up
// the stairs.
TEST_P(Floorplans, EverySpaceCanBeReachedOnFoot) {
  const FloorplanOptions options = Options();
  size_t spaces = 0;
  size_t doorways = 0;
  double y = 0;
  for (uint32_t wing = 0; wing < WingCount(options); ++wing) {
    const WingOutline outline = OutlineOfWing(options, wing, y);
    const WingPlan plan = PlanWing(options, 0, outline);
    y = outline.link_y1;
    spaces += plan.spaces.size();
    doorways += plan.doorways.size();
    for (const PlanSpace& space : plan.spaces) {
      const bool has_door =
          std::any_of(kSides.begin(), kSides.end(), [&](Side side) {
            const auto& holes = space.Wall(side).holes;
            return std::any_of(holes.begin(),
                               holes.end(),
                               [](const Rect& hole) { return hole.v0 == 0; });
          });
      EXPECT_TRUE(has_door) << space.name;
    }
  }
  EXPECT_GE(doorways + 1, spaces) << "a tree of doors at least";
}

TEST(Floorplan, NoReflectanceReaches09AndLampsLookDown) {
  const ReadScene scene = Generate(WriteFloorplan, {60, 2});
  for (const auto& [name, rgb] : scene.reflectance) {
    EXPECT_LT(MaxChannel(rgb), 0.9) << name;
  }
  size_t lamps = 0;
  for (const ReadPolygon& p : scene.polygons) {
    if (scene.exitance.contains(p.material)) {
      ++lamps;
      EXPECT_LT(AreaVector(p.vertices).z, 0) << p.object;
      EXPECT_GE(MaxChannel(scene.exitance.at(p.material)), 30);
      EXPECT_LE(MaxChannel(scene.exitance.at(p.material)), 60);
    }
  }
  EXPECT_GE(lamps, 60U);
}

// The look of a room is every vertex relative to the room's corner, with its
// material.
TEST(Floorplan, NoTwoRoomsAreAlike) {
  const ReadScene scene = Generate(WriteFloorplan, {300, 3, 0});
  const std::map<std::string, Rect> rooms = Floors(scene, "_office");
  std::map<std::string, std::string> looks;
  for (const ReadPolygon& p : scene.polygons) {
    const auto room = rooms.find(RoomOf(p.object));
    if (room == rooms.end() || p.object.ends_with("_outside")) {
      continue;
    }
    std::string& look = looks[room->first];
    look += p.material;
    for (const Point3 v : p.vertices) {
      look += fmt::format(
          " {:.3f} {:.3f}", v.x - room->second.u0, v.y - room->second.v0);
    }
  }
  std::set<std::string> different;
  for (const auto& [room, look] : looks) {
    different.insert(look);
  }
  EXPECT_EQ(looks.size(), rooms.size());
  EXPECT_EQ(different.size(), rooms.size());
}

TEST(Floorplan, OfficesAndHallsHaveUsualSizes) {
  const ReadScene scene = Generate(WriteFloorplan, {300, 1, 0});
  for (const auto& [name, plan] : Floors(scene, "_office")) {
    const double area = plan.Width() * plan.Height();
    EXPECT_GT(area, 9) << name;
    EXPECT_LT(area, 36) << name;
  }
  const auto halls = Floors(scene, "_hall");
  EXPECT_FALSE(halls.empty());
  for (const auto& [name, plan] : halls) {
    EXPECT_GT(plan.Width() * plan.Height(), 60) << name;
    EXPECT_LT(plan.Width() * plan.Height(), 150) << name;
  }
}

TEST(Floorplan, FurnitureStaysInsideItsRoomAndGrowsWithDensity) {
  const ReadScene scene = Generate(WriteFloorplan, {60, 1, 1.0});
  std::map<std::string, Rect> rooms = Floors(scene, "_office");
  rooms.merge(Floors(scene, "_hall"));
  for (const ReadPolygon& p : scene.polygons) {
    if (!IsShell(p.object)) {
      const Rect room = rooms.at(RoomOf(p.object));
      const Box3 box = BoundsOf(p.vertices);
      EXPECT_TRUE(room.Contains({box.low.x, box.high.x, box.low.y, box.high.y}))
          << p.object;
      EXPECT_GE(box.low.z, 0);
      EXPECT_LT(box.high.z, kClearHeight);
    }
  }
  const size_t half = Generate(WriteFloorplan, {60, 1, 0.5}).polygons.size();
  const size_t none = Generate(WriteFloorplan, {60, 1, 0.0}).polygons.size();
  EXPECT_GT(scene.polygons.size(), half + 2000);
  EXPECT_GT(half, none + 2000);
}

TEST(Floorplan, SameSeedSameBytes) {
  const TemporaryFolder dir;
  const auto text = [&](const char* name, uint64_t seed) {
    ObjWriter writer(dir.Path() / name);
    WriteFloorplan({40, 2, 0.5, seed}, writer);
    writer.Finish();
    const std::string all = ReadFile(dir.Path() / name);
    return all.substr(all.find("\no "));
  };
  EXPECT_EQ(text("a.obj", 5), text("b.obj", 5));
  EXPECT_NE(text("a.obj", 5), text("c.obj", 6));
}

TEST(Floorplan, OptionsOutOfRangeAreUsageErrors) {
  EXPECT_THROW(Generate(WriteFloorplan, {0, 1}), UsageError);
  EXPECT_THROW(Generate(WriteFloorplan, {60, 0}), UsageError);
  EXPECT_THROW(Generate(WriteFloorplan, {600, 201}), UsageError);
  EXPECT_THROW(Generate(WriteFloorplan, {3, 4}), UsageError);
  EXPECT_THROW(Generate(WriteFloorplan, {60, 1, 1.5}), UsageError);
  EXPECT_THROW(Generate(WriteFloorplan, {60, 1, -0.1}), UsageError);
}

// Runs `body` in a child process and returns the growth of its peak resident
// size in bytes; a negative number if it failed.
template <typename Body>
int64_t PeakGrowthInChild(const Body& body) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    const auto peak = [] {
      rusage usage{};
      getrusage(RUSAGE_SELF, &usage);
      return int64_t{usage.ru_maxrss} * 1024;
    };
    int64_t growth = -1;
    try {
      const int64_t before = peak();
      body();
      growth = peak() - before;
    } catch (...) {
      growth = -2;
    }
    const bool sent = write(ends[1], &growth, sizeof growth) == sizeof growth;
    _exit(sent ? 0 : 1);
  }
  int64_t growth = -3;
  EXPECT_EQ(read(ends[0], &growth, sizeof growth),
            static_cast<ssize_t>(sizeof growth));
  close(ends[0]);
  close(ends[1]);
  waitpid(child, nullptr, 0);
  return growth;
}

TEST(Streaming, AMillionPolygonsNeedNoMemory) {
  const TemporaryFolder dir;
  uint64_t polygons = 0;
  const int64_t growth = PeakGrowthInChild([&] {
    ObjWriter writer(dir.Path() / "large.obj");
    WriteFloorplan({5200, 4, 0.5}, writer);
    writer.Finish();
    polygons = writer.Polygons();
    ENFILADE_CHECK(polygons > 1'000'000, "only {} polygons", polygons);
  });
  EXPECT_GE(growth, 0);
  EXPECT_LT(growth, 4 << 20);
  EXPECT_GT(std::filesystem::file_size(dir.Path() / "large.obj"), 50U << 20);
}

TEST(Streaming, AFileThatCannotGrowIsADiskErrorAndLeavesNothing) {
  const TemporaryFolder dir;
  const int64_t growth = PeakGrowthInChild([&] {
    std::signal(SIGXFSZ, SIG_IGN);  // NOLINT(cert-err33-c): cannot fail
    const rlimit limit = {100'000, 100'000};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      ObjWriter writer(dir.Path() / "scene.obj");
      WriteFloorplan({60, 1}, writer);
      writer.Finish();
    } catch (const DiskError&) {
      return;
    }
    throw DiskError("expected");
  });
  EXPECT_GE(growth, 0) << "no DiskError was thrown";
  EXPECT_TRUE(std::filesystem::is_empty(dir.Path()));
}

TEST(Streaming, AMissingFolderIsADiskErrorAndAnotherSuffixAUsageError) {
  const TemporaryFolder dir;
  EXPECT_THROW(ObjWriter(dir.Path() / "none" / "scene.obj"), DiskError);
  EXPECT_THROW(ObjWriter(dir.Path() / "scene.ply"), UsageError);
  EXPECT_TRUE(std::filesystem::is_empty(dir.Path()));
}

TEST(Streaming, AFailedRunKeepsTheFormerScene) {
  const TemporaryFolder dir;
  const auto path = dir.Path() / "scene.obj";
  {
    ObjWriter writer(path);
    writer.AddPolygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    writer.Finish();
  }
  const std::string former = ReadFile(path);
  { const ObjWriter abandoned(path); }
  EXPECT_EQ(ReadFile(path), former);
  EXPECT_FALSE(std::filesystem::exists(dir.Path() / "scene.obj.part"));
}

}  // namespace
}  // namespace enfilade::testing
