#include "partition/space_shells.h"

#include "base/planar_polygon.h"
#include "base/stop.h"
#include "base/winding_number.h"

namespace enfilade {
namespace {

// The triangles face into the Space.
struct Shell {
  Box3 bounds;
  std::vector<Triangle3> triangles;
};

class ShellCollector {
 public:
  ShellCollector(size_t spaces, MemoryBudget& budget)
      : shells_(spaces), charge_(budget, "the shells of the model's spaces") {}

  // Adds a polygon between two Spaces, or between a Space and the outside.
  void Add(const Polygon& polygon,
           const std::optional<SpaceId>& front,
           const std::optional<SpaceId>& back) {
    if (front == back) {
      return;
    }
    ForEachTriangle(polygon, [&](Point3 a, Point3 b, Point3 c) {
      if (front) {
        AddTriangle(*front, {a, b, c});
      }
      if (back) {
        AddTriangle(*back, {a, c, b});
      }
    });
  }

  [[nodiscard]] const std::vector<Shell>& Shells() const { return shells_; }

 private:
  void AddTriangle(SpaceId space, const Triangle3& t) {
    constexpr uint64_t kGrowth = 3;  // old and new array while a vector grows
    bytes_ += kGrowth * sizeof t;
    charge_.GrowTo(bytes_);
    Shell& shell = shells_[space.Index()];
    shell.bounds.Include(t.a);
    shell.bounds.Include(t.b);
    shell.bounds.Include(t.c);
    shell.triangles.push_back(t);
  }

  std::vector<Shell> shells_;
  GrowingCharge charge_;
  uint64_t bytes_ = 0;
};

std::optional<SpaceId> SpaceOf(const std::vector<Shell>& shells, Point3 p) {
  double best = 0.5;
  std::optional<SpaceId> space;
  for (uint32_t i = 0; i < shells.size(); ++i) {
    if (!shells[i].bounds.Contains(p)) {
      continue;
    }
    const double winding = -WindingNumber(shells[i].triangles, p);
    if (winding > best) {
      best = winding;
      space = SpaceId(i);
    }
  }
  return space;
}

}  // namespace

std::vector<std::optional<SpaceId>> SpacesOfLeaves(const BlockStorage& store,
                                                   const SceneInfo& info,
                                                   const LeafShapes& leaves,
                                                   MemoryBudget& budget) {
  ShellCollector collector(info.spaces.size(), budget);
  ForEachFace(store, [&collector](FaceId, const Face& face) {
    collector.Add(face.vertices, face.front_space, face.back_space);
  });
  for (const Opening& opening : info.openings) {
    collector.Add(opening.vertices, opening.front_space, opening.back_space);
  }
  std::vector<std::optional<SpaceId>> spaces;
  spaces.reserve(leaves.size());
  for (const LeafShape& leaf : leaves) {
    ThrowIfStopRequested();
    spaces.push_back(SpaceOf(collector.Shells(), leaf.center));
  }
  return spaces;
}

}  // namespace enfilade
