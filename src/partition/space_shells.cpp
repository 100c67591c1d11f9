#include "partition/space_shells.h"

#include "base/photometry.h"
#include "base/stop.h"

namespace enfilade {
namespace {

// A triangle of a shell, counter-clockwise seen from inside the Space.
struct ShellTriangle {
  Point3 a, b, c;
};

struct Shell {
  Box3 bounds;
  std::vector<ShellTriangle> triangles;
};

double WindingNumber(const Shell& shell, Point3 p) {
  double sum = 0;
  for (const ShellTriangle& t : shell.triangles) {
    sum -= SolidAngle(t.a - p, t.b - p, t.c - p);
  }
  return sum / (4 * kPi);
}

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
    for (size_t i = 1; i + 1 < polygon.size(); ++i) {
      const ShellTriangle t{polygon[0], polygon[i], polygon[i + 1]};
      if (front) {
        AddTriangle(*front, t);
      }
      if (back) {
        AddTriangle(*back, {t.a, t.c, t.b});
      }
    }
  }

  [[nodiscard]] const std::vector<Shell>& Shells() const { return shells_; }

 private:
  void AddTriangle(SpaceId space, const ShellTriangle& t) {
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
    const double winding = WindingNumber(shells[i], p);
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
