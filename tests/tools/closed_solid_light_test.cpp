// A room with white cupboards: no light gets into them, and none comes out.

#include "solver/solution/solution.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Writes boxes and a lamp as OBJ.
class RoomWriter {
 public:
  explicit RoomWriter(const TemporaryFolder& folder)
      : obj_(folder / "room.obj") {
    std::ofstream(folder / "room.mtl")
        << "newmtl white\nKd .9 .9 .9\nnewmtl lamp\nKd 0 0 0\nKe 50 50 50\n";
    obj_ << "mtllib room.mtl\n";
  }

  // Writes a box, with its upper side if `top`.
  void AddBox(const Box3& box, bool top) {
    obj_ << "o box" << first_ << "\nusemtl white\n";
    for (const double z : {box.low.z, box.high.z}) {
      Vertex(box.low.x, box.low.y, z);
      Vertex(box.high.x, box.low.y, z);
      Vertex(box.high.x, box.high.y, z);
      Vertex(box.low.x, box.high.y, z);
    }
    // The faces are wound either way, as exporters wind them.
    Face({0, 1, 2, 3});
    Face({0, 1, 5, 4});
    Face({1, 5, 6, 2});
    Face({2, 3, 7, 6});
    Face({3, 0, 4, 7});
    if (top) {
      Face({4, 5, 6, 7});
    }
    first_ += 8;
  }

  // Writes a lamp that faces down.
  void AddLamp(Point3 corner, double size) {
    obj_ << "o lamp\nusemtl lamp\n";
    Vertex(corner.x, corner.y, corner.z);
    Vertex(corner.x, corner.y + size, corner.z);
    Vertex(corner.x + size, corner.y + size, corner.z);
    Vertex(corner.x + size, corner.y, corner.z);
    Face({0, 1, 2, 3});
    first_ += 4;
  }

 private:
  void Vertex(double x, double y, double z) {
    obj_ << "v " << x << ' ' << y << ' ' << z << '\n';
  }

  void Face(const std::vector<int>& corners) {
    obj_ << 'f';
    for (const int c : corners) {
      obj_ << ' ' << first_ + c;
    }
    obj_ << '\n';
  }

  std::ofstream obj_;
  int first_ = 1;
};

constexpr Box3 kCupboard{{1, 1, 0.2}, {1.8, 1.5, 1.4}};

// The largest radiosity on sides that look into the cupboard, and how many
// elements they have.
struct Inside {
  double brightest = 0;
  size_t leaves = 0;
};

Inside Solve(bool cupboard_is_closed) {
  const TemporaryFolder folder;
  {
    RoomWriter writer(folder);
    writer.AddBox({{0, 0, 0}, {4, 3, 2.5}}, true);
    writer.AddBox(kCupboard, cupboard_is_closed);
    writer.AddLamp({2, 1.5, 2.4}, 0.5);
  }
  const ProgramResult solved = RunProgram({"solve",
                                           folder / "room.obj",
                                           "-o",
                                           folder / "room.enf",
                                           "--error",
                                           "0.1"});
  EXPECT_EQ(solved.exit_code, 0) << solved.err;
  const auto store = OpenStore(folder / "room.enf", StoreAccess::kRead);
  MemoryBudget budget(1ULL << 28);
  const Solution solution(*store, budget);
  Inside inside;
  for (size_t i = 0; i < solution.CellCount(); ++i) {
    const CellPatches cell = LoadCellPatches(*store, CellId(i));
    solution.ForEachLeaf(CellId(i), [&](const LeafElement& leaf) {
      const Vec3 normal = PatchNormal(cell.patches[leaf.patch.Index()]);
      const Point3 before = leaf.corners[0] +
                            (leaf.corners[2] - leaf.corners[0]) * 0.5 +
                            normal * 1e-3;
      if (kCupboard.Overlaps({before, before})) {
        ++inside.leaves;
        for (const Rgb& radiosity : leaf.radiosity) {
          inside.brightest = std::max(inside.brightest, radiosity[0]);
        }
      }
    });
  }
  return inside;
}

TEST(ClosedSolidLight, CupboardIsDarkAndIsNotRefined) {
  const Inside inside = Solve(true);
  EXPECT_EQ(inside.brightest, 0);
  EXPECT_EQ(inside.leaves, 6U);
}

TEST(ClosedSolidLight, CupboardWithoutItsTopIsLit) {
  const Inside inside = Solve(false);
  EXPECT_GT(inside.brightest, 1);
  EXPECT_GT(inside.leaves, 50U);
}

}  // namespace
}  // namespace enfilade
