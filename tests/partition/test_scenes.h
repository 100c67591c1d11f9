// Small buildings for the tests of the partition.

#pragma once

#include "base/memory.h"
#include "partition/bsp_tree.h"
#include "partition/overlap.h"
#include "partition/partition.h"
#include "scene/scene_store.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace enfilade::testing {

inline constexpr Vec3 kUp{0, 0, 1};

// By FaceId, of faces that these patches are all of.
inline std::vector<FaceFacts> FactsOf(const std::vector<Patch>& patches) {
  std::array<std::vector<float>, 2> areas;  // of the fronts, of the backs
  for (const Patch& p : patches) {
    for (std::vector<float>& side : areas) {
      side.resize(std::max<size_t>(side.size(), p.face.Index() + 1));
    }
    areas[p.is_back ? 1 : 0][p.face.Index()] +=
        static_cast<float>(PatchArea(p));
  }
  std::vector<FaceFacts> faces;
  for (size_t i = 0; i < areas[0].size(); ++i) {
    faces.push_back({std::max(areas[0][i], areas[1][i]), 0});
  }
  return faces;
}

// Separates overlaps under a budget that never runs out.
inline OverlapCounts Separate(std::vector<Patch>& patches) {
  MemoryBudget budget(uint64_t{1} << 40);
  return SeparateOverlaps(patches, FactsOf(patches), budget);
}

// Collects faces; grey is material 0, one-sided grey is material 1, and
// material 2 emits.
class SceneBuilder {
 public:
  void Add(std::vector<Point3> polygon, MaterialId material = MaterialId(0U)) {
    faces_.push_back({material,
                      ObjectId(0U),
                      std::move(polygon),
                      std::nullopt,
                      std::nullopt,
                      std::nullopt,
                      0});
  }

  // A rectangle square to an axis (0 x, 1 y, 2 z) at a coordinate; low and
  // high are the other two coordinates in the order of the axes.
  struct Rectangle {
    size_t axis;
    double at;
    double low_a, low_b, high_a, high_b;
  };

  void Add(const Rectangle& r, MaterialId material = MaterialId(0U)) {
    const auto point = [&r](double a, double b) {
      return r.axis == 0   ? Point3{r.at, a, b}
             : r.axis == 1 ? Point3{a, r.at, b}
                           : Point3{a, b, r.at};
    };
    Add(std::vector<Point3>{point(r.low_a, r.low_b),
                            point(r.high_a, r.low_b),
                            point(r.high_a, r.high_b),
                            point(r.low_a, r.high_b)},
        material);
  }

  // Turns all faces about the z axis.
  void Turn(double radians) {
    const double c = std::cos(radians);
    const double s = std::sin(radians);
    for (Face& face : faces_) {
      for (Point3& p : face.vertices) {
        p = {c * p.x - s * p.y, s * p.x + c * p.y, p.z};
      }
    }
  }

  // A rectangle with a rectangular hole: four faces of one surface.
  void AddWithHole(const Rectangle& r, const Rectangle& hole) {
    const size_t axis = r.axis;
    const double at = r.at;
    const size_t first = faces_.size();
    AddUnlessFlat({axis, at, r.low_a, r.low_b, hole.low_a, r.high_b});
    AddUnlessFlat({axis, at, hole.high_a, r.low_b, r.high_a, r.high_b});
    AddUnlessFlat({axis, at, hole.low_a, r.low_b, hole.high_a, hole.low_b});
    AddUnlessFlat({axis, at, hole.low_a, hole.high_b, hole.high_a, r.high_b});
    const auto area = [](const Rectangle& x) {
      return (x.high_a - x.low_a) * (x.high_b - x.low_b);
    };
    for (size_t i = first; i < faces_.size(); ++i) {
      faces_[i].surface_m2 = area(r) - area(hole);
    }
  }

  // The six sides of a box, facing outwards.
  void AddBox(const Box3& box, MaterialId material = MaterialId(0U)) {
    const Point3 l = box.low;
    const Point3 h = box.high;
    Add({0, h.x, l.y, l.z, h.y, h.z}, material);
    Add({2, h.z, l.x, l.y, h.x, h.y}, material);
    Add(
        Polygon{
            {l.x, l.y, l.z}, {l.x, l.y, h.z}, {l.x, h.y, h.z}, {l.x, h.y, l.z}},
        material);
    Add(
        Polygon{
            {l.x, l.y, l.z}, {l.x, h.y, l.z}, {h.x, h.y, l.z}, {h.x, l.y, l.z}},
        material);
    Add(
        Polygon{
            {l.x, l.y, l.z}, {h.x, l.y, l.z}, {h.x, l.y, h.z}, {l.x, l.y, h.z}},
        material);
    Add(
        Polygon{
            {l.x, h.y, l.z}, {l.x, h.y, h.z}, {h.x, h.y, h.z}, {h.x, h.y, l.z}},
        material);
  }

  // The same box, marked as a closed solid.
  void AddSolid(const Box3& box, MaterialId material = MaterialId(0U)) {
    const size_t first = faces_.size();
    AddBox(box, material);
    for (size_t i = first; i < faces_.size(); ++i) {
      faces_[i].solid = ClosedSolid{box, false};
    }
  }

  [[nodiscard]] const std::vector<Face>& Faces() const { return faces_; }

  // A store that holds the scene.
  [[nodiscard]] std::unique_ptr<BlockStorage> Store() const {
    auto store = CreateStoreInMemory();
    SceneWriter writer(*store);
    for (const Face& face : faces_) {
      writer.Add(face);
    }
    SceneInfo info;
    info.source_path = "test.obj";
    info.materials = {{"grey", {0.5, 0.5, 0.5}, {}, 2, false},
                      {"one-sided", {0.5, 0.5, 0.5}, {}, 1, false},
                      {"lamp", {}, {10, 10, 10}, 2, false}};
    writer.Finish(std::move(info));
    return store;
  }

 private:
  void AddUnlessFlat(const Rectangle& r) {
    if (r.high_a - r.low_a > 0 && r.high_b - r.low_b > 0) {
      Add(r);
    }
  }

  std::vector<Face> faces_;
};

// A built partition with the look-ups that tests need.
class Built {
 public:
  explicit Built(const SceneBuilder& scene,
                 const PartitionOptions& options = {})
      : store(scene.Store()),
        partition(BuildPartition(*store, options, budget)),
        locator(*store) {}

  [[nodiscard]] CellId At(Point3 p) const { return locator.Locate(p); }

  // The portals between two cells.
  [[nodiscard]] std::vector<Portal> Between(CellId a, CellId b) const {
    std::vector<Portal> found;
    for (const Portal& portal : partition.portals) {
      if ((portal.front == a && portal.back == b) ||
          (portal.front == b && portal.back == a)) {
        found.push_back(portal);
      }
    }
    return found;
  }

  MemoryBudget budget{256ULL << 20};
  std::unique_ptr<BlockStorage> store;
  Partition partition;
  PartitionLocator locator;
};

// Two rooms of 4 x 3 x 2.7 m side by side along x, a door of 0.9 x 2.1 m in
// the thin wall between them, at y = 1.
inline SceneBuilder TwoRoomsWithDoor() {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {8, 3, 2.7}});
  scene.AddWithHole({0, 4, 0, 0, 3, 2.7}, {0, 4, 1, 0, 1.9, 2.1});
  return scene;
}

}  // namespace enfilade::testing
