#include "tools/verify/seen.h"

#include "base/random.h"

#include <tuple>

#include "tests/budgets.h"
#include "tests/tools/verify_fake_building.h"
#include "tools/verify/paths.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr uint64_t kMostBytes = 16ULL << 20;

// Two rooms of one cell each, 4 m wide, with an opaque slab between them; each
// has ten lamps near its ceiling, black, of exitance 1.
class TwoRooms {
 public:
  TwoRooms() {
    const MaterialId grey = building_.AddMaterial({.5, .5, .5}, {});
    const MaterialId light = building_.AddMaterial({}, {1, 1, 1});
    for (int room = 0; room < 2; ++room) {
      if (room > 0) {
        building_.AddCell();
      }
      const double z = room * 3.0;
      building_.Add({0, 0, z}, {4, 0, 0}, {0, 4, 0}, grey);
      building_.Add({0, 0, z + 2.9}, {0, 4, 0}, {4, 0, 0}, grey);
      for (int i = 0; i < 10; ++i) {
        const Point3 o{.3 + i % 5 * .8, .5 + i / 5 * 2.0, z + 2.5};
        building_.Add(o, {0, .3, 0}, {.2, 0, 0}, light);
      }
    }
  }

  [[nodiscard]] const BuildingView& View() const { return building_.View(); }

 private:
  FakeBuilding building_;
};

TEST(SeenEmittersTest, ChoicesGoToTheLampsOfTheRoom) {
  const TwoRooms rooms;
  MemoryBudget budget(kModest);
  const EmitterTree tree(rooms.View(), budget, 1 << 20);
  SeenEmitters seen(tree);
  EXPECT_GT(seen.Learn(rooms.View(), budget, kMostBytes, 1), 0U);
  // The point lies on the floor of the lower room: the lamps behind the slab
  // overhead are in front of it as well.
  const Point3 x{1, 1, 0};
  int own = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto choice = seen.Choose(CellId(0U), x, {0, 0, 1}, (i + .5) / 1000);
    ASSERT_TRUE(choice);
    own += choice->emitter->cell == CellId(0U) ? 1 : 0;
  }
  EXPECT_GE(own, 850);
}

// The sky before a window is a cell of its own, which has no point that could
// receive.
TEST(SeenEmittersTest, ASkyThatReflectsNothingIsSeenAndSeesNothing) {
  FakeBuilding building;
  const MaterialId grey = building.AddMaterial({.5, .5, .5}, {});
  const MaterialId sky = building.AddMaterial({}, {1, 1, 1});
  building.Add({0, 0, 0}, {4, 0, 0}, {0, 4, 0}, grey);
  building.AddCell();
  building.Add({5, 0, 0}, {0, 0, 4}, {0, 4, 0}, sky);
  MemoryBudget budget(kModest);
  const EmitterTree tree(building.View(), budget, 1 << 20);
  SeenEmitters seen(tree);
  EXPECT_GT(seen.Learn(building.View(), budget, kMostBytes, 1), 0U);
  const auto choice = seen.Choose(CellId(0U), {1, 1, 0}, {0, 0, 1}, .5);
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->emitter->cell, CellId(1U));
}

// A bulb is in a box that is open below, 5 mm above the floor: hardly a point
// of the room sees the bulb, and points inside the box see nothing else.
// Returns how many of a thousand choices from there are of the bulb. Lengths
// are from `corner`, that of the room.
int ChoicesOfTheBulbInItsShade(Point3 corner) {
  FakeBuilding building;
  const MaterialId grey = building.AddMaterial({.5, .5, .5}, {});
  const MaterialId light = building.AddMaterial({}, {1, 1, 1});
  const MaterialId bulb = building.AddMaterial({}, {100, 100, 100});
  building.Add(corner, {4, 0, 0}, {0, 4, 0}, grey);
  building.Add(corner + Vec3{1, 1, 2.5}, {0, 1, 0}, {1, 0, 0}, light);
  const Point3 low = corner + Vec3{2, 2, .005};
  const Vec3 x{.1, 0, 0};
  const Vec3 y{0, .1, 0};
  const Vec3 z{0, 0, .1};
  for (const auto& [origin, u, v] : {std::tuple(low, y, z),
                                     std::tuple(low + x, y, z),
                                     std::tuple(low, x, z),
                                     std::tuple(low + y, x, z),
                                     std::tuple(low + z, x, y)}) {
    building.Add(origin, u, v, grey);
    building.Add(origin, v, u, grey);
  }
  building.Add(corner + Vec3{2.03, 2.03, .09}, {0, .04, 0}, {.04, 0, 0}, bulb);
  MemoryBudget budget(kModest);
  const EmitterTree tree(building.View(), budget, 1 << 20);
  SeenEmitters seen(tree);
  seen.Learn(building.View(), budget, kMostBytes, 1);
  int inside = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto choice = seen.Choose(
        CellId(0U), corner + Vec3{2.05, 2.07, 0}, {0, 0, 1}, (i + .5) / 1000);
    inside += choice && choice->emitter->material == bulb ? 1 : 0;
  }
  return inside;
}

TEST(SeenEmittersTest, ABulbInAShadeIsChosenInsideOfIt) {
  EXPECT_GE(ChoicesOfTheBulbInItsShade({}), 800);
}

// Where floats are half a metre apart, and those nearest to the bulb and to the
// point differ.
TEST(SeenEmittersTest, ABulbIsChosenInMapCoordinatesToo) {
  EXPECT_GE(ChoicesOfTheBulbInItsShade({430'000.3, 5'400'000.69, 120.1}), 800);
}

// A room with two bulbs, cubes of 24 facets each, and a panel of four squares.
class BulbRoom {
 public:
  BulbRoom() {
    const MaterialId grey = building_.AddMaterial({.5, .5, .5}, {});
    const MaterialId light = building_.AddMaterial({}, {1, 1, 1});
    building_.AddRoom({4, 4, 3}, grey);
    for (const Point3 o : {Point3{1, 1, 1}, Point3{3, 2.5, 2}}) {
      AddBulb(o, light);
    }
    for (int i = 0; i < 4; ++i) {
      const Point3 o{1 + i % 2 * .5, 3 + i / 2 * .4, 2.9};
      building_.Add(o, {0, .4, 0}, {.5, 0, 0}, light);
    }
  }

  [[nodiscard]] const BuildingView& View() const { return building_.View(); }

 private:
  // Adds a cube whose faces look outward, each in four quarters.
  void AddBulb(Point3 o, MaterialId light) {
    constexpr double kHalf = .05;
    const Vec3 x{kHalf, 0, 0};
    const Vec3 y{0, kHalf, 0};
    const Vec3 z{0, 0, kHalf};
    for (const auto& [origin, u, v] : {std::tuple(o, y, x),
                                       std::tuple(o + z * 2, x, y),
                                       std::tuple(o, x, z),
                                       std::tuple(o + y * 2, z, x),
                                       std::tuple(o, z, y),
                                       std::tuple(o + x * 2, y, z)}) {
      for (int i = 0; i < 4; ++i) {
        building_.Add(origin + u * (i % 2) + v * (i / 2), u, v, light);
      }
    }
  }

  FakeBuilding building_;
};

TEST(EmitterTreeTest, FacetsOfBulbsAreLampsAndPanelsAreNot) {
  const BulbRoom room;
  MemoryBudget budget(kModest);
  const EmitterTree tree(room.View(), budget, 1 << 20);
  ASSERT_EQ(tree.Emitters().size(), 52U);
  uint32_t next = 0;
  for (const EmitterTree::Lamp& lamp : tree.Lamps()) {
    EXPECT_EQ(lamp.first, next) << "emitters are in one lamp each";
    next += lamp.count;
    for (uint32_t i = lamp.first; i < next; ++i) {
      EXPECT_EQ(&tree.Lamps()[tree.LampOf(i)], &lamp);
      const bool is_panel = tree.Emitters()[i].origin.z > 2.8;
      EXPECT_TRUE(!is_panel || lamp.count == 1);
    }
  }
  EXPECT_EQ(next, 52U);
  EXPECT_LE(tree.Lamps().size(), 4U + 48 / 2) << "facets are in lamps";
}

// An estimator weighed with the densities is right only if each density is the
// probability of being chosen. Returns how many of the numbers choose nothing,
// because they come to a node of the tree below which all emitters look away.
int ExpectDensitiesOfChoices(const BuildingView& view) {
  MemoryBudget budget(kModest);
  const EmitterTree tree(view, budget, 1 << 20);
  SeenEmitters seen(tree);
  seen.Learn(view, budget, kMostBytes, 1);
  enfilade::Random random(3);
  int none_of_all = 0;
  for (int k = 0; k < 20; ++k) {
    const Point3 x{random.Next() * 4, random.Next() * 4, 0};
    constexpr int kGrid = 4000;
    std::vector<int> chosen(tree.Emitters().size());
    int none = 0;
    int intervals = 0;  // of the numbers that choose nothing
    bool was_chosen = true;
    for (int i = 0; i < kGrid; ++i) {
      const auto choice =
          seen.Choose(CellId(0U), x, {0, 0, 1}, (i + .5) / kGrid);
      intervals += was_chosen && !choice ? 1 : 0;
      was_chosen = choice.has_value();
      if (!choice) {
        ++none;
        continue;
      }
      const Emitter& e = *choice->emitter;
      ++chosen[static_cast<size_t>(choice->emitter - tree.Emitters().data())];
      EXPECT_NEAR(
          seen.Density(CellId(0U), x, {0, 0, 1}, {e.cell, e.patch, 0, 0}) *
              e.area,
          choice->probability,
          1e-12);
    }
    double sum = 0;
    for (size_t i = 0; i < chosen.size(); ++i) {
      const Emitter& e = tree.Emitters()[i];
      const double p =
          seen.Density(CellId(0U), x, {0, 0, 1}, {e.cell, e.patch, 0, 0}) *
          e.area;
      // Every emitter owns at most two intervals of the numbers.
      EXPECT_NEAR(chosen[i], p * kGrid, 3);
      sum += p;
    }
    // The grid tells an interval's length to one step.
    EXPECT_NEAR(sum,
                1 - none / static_cast<double>(kGrid),
                intervals / static_cast<double>(kGrid) + 1e-9);
    EXPECT_LT(none, kGrid / 2);
    none_of_all += none;
  }
  return none_of_all;
}

TEST(SeenEmittersTest, DensitiesAgreeWithChoosing) {
  EXPECT_EQ(ExpectDensitiesOfChoices(TwoRooms().View()), 0);
}

TEST(SeenEmittersTest, DensitiesAgreeWithChoosingAmongBulbs) {
  EXPECT_GT(ExpectDensitiesOfChoices(BulbRoom().View()), 0);
}

// The same light with and without the lists, and less noise with them.
TEST(SeenEmittersTest, LearningKeepsTheMeanAndLowersTheNoise) {
  const TwoRooms rooms;
  MemoryBudget budget(kModest);
  PathTracer plain(rooms.View(), budget);
  PathTracer learned(rooms.View(), budget);
  learned.LearnEmitters(budget, 1);
  const std::vector<Receiver> receivers(512,
                                        {{1, 1, 0}, {0, 0, 1}, CellId(0U)});
  double means[2];
  double variances[2];
  for (int k = 0; k < 2; ++k) {
    PathTracer& tracer = k == 0 ? plain : learned;
    const auto h = tracer.Irradiance(receivers, 5, 4, GatherMode::kPaths, {});
    double sum = 0;
    double squares = 0;
    for (const Rgb& value : h) {
      sum += value[0] / 512;
      squares += value[0] * value[0] / 512;
    }
    means[k] = sum;
    variances[k] = squares - sum * sum;
  }
  EXPECT_NEAR(
      means[0], means[1], 5 * std::sqrt((variances[0] + variances[1]) / 512));
  EXPECT_LT(variances[1], .9 * variances[0]);
}

// Cells are searched in larger groups where there is more memory.
TEST(SeenEmittersTest, TheListsDoNotDependOnTheMemory) {
  const TwoRooms rooms;
  MemoryBudget budget(kModest);
  const EmitterTree tree(rooms.View(), budget, 1 << 20);
  SeenEmitters much(tree);
  SeenEmitters little(tree);
  EXPECT_EQ(much.Learn(rooms.View(), budget, kMostBytes, 1),
            little.Learn(rooms.View(), budget, 300000, 1));
  for (int i = 0; i < 100; ++i) {
    const double s = (i + .5) / 100;
    const auto a = much.Choose(CellId(1U), {1, 1, 3}, {0, 0, 1}, s);
    const auto b = little.Choose(CellId(1U), {1, 1, 3}, {0, 0, 1}, s);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) {
      continue;  // the tree met lamps that all look away
    }
    EXPECT_EQ(a->emitter, b->emitter);
    EXPECT_EQ(a->probability, b->probability);
  }
}

// Four lamps of each room find room; they are of the room itself.
TEST(SeenEmittersTest, WithLittleMemoryTheStrongestLampsAreKept) {
  const TwoRooms rooms;
  MemoryBudget budget(kModest);
  const EmitterTree tree(rooms.View(), budget, 1 << 20);
  constexpr uint64_t kStep = 1024;
  uint64_t least_bytes = kStep;
  while (SeenEmitters(tree).Learn(rooms.View(), budget, least_bytes, 1) == 0) {
    least_bytes += kStep;
    ASSERT_LT(least_bytes, kMostBytes);
  }
  // Between the last step and this one there is room for the lists alone.
  constexpr uint64_t kEntries = 8;
  SeenEmitters seen(tree);
  seen.Learn(rooms.View(), budget, least_bytes + 8 * kEntries, 1);
  for (const uint32_t room : {0U, 1U}) {
    const Point3 x{1, 1, 3.0 * room};
    int own = 0;
    for (int i = 0; i < 1000; ++i) {
      const auto choice =
          seen.Choose(CellId(room), x, {0, 0, 1}, (i + .5) / 1000);
      own += choice && choice->emitter->cell == CellId(room) ? 1 : 0;
    }
    EXPECT_GE(own, 850) << room;
  }
}

TEST(SeenEmittersTest, WithoutMemoryTheTreeChooses) {
  const TwoRooms rooms;
  MemoryBudget budget(kModest);
  const EmitterTree tree(rooms.View(), budget, 1 << 20);
  SeenEmitters seen(tree);
  EXPECT_EQ(seen.Learn(rooms.View(), budget, 1000, 1), 0U);
  for (int i = 0; i < 100; ++i) {
    const double s = (i + .5) / 100;
    const auto a = seen.Choose(CellId(0U), {1, 1, 0}, {0, 0, 1}, s);
    const auto b = tree.Choose({1, 1, 0}, {0, 0, 1}, s);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->emitter, b->emitter);
    EXPECT_EQ(a->probability, b->probability);
  }
}

}  // namespace
}  // namespace enfilade
