#include "partition/walls.h"

#include "partition/plane_groups.h"

#include <cmath>
#include <functional>

namespace enfilade {
namespace {

constexpr double kLeastSplitterM2 = 0.05;
constexpr double kLargestLuminaireM2 = 4.0;
constexpr double kMostEmittingShare = 0.2;

bool MaySplit(const Face& face, const SceneInfo& info) {
  if (!info.spaces.empty()) {
    return face.front_space != face.back_space;
  }
  return info.gbxml.has_value() ||
         PolygonArea(face.vertices) >= kLeastSplitterM2;
}

// Reads the walls one after another, as often as needed.
class WallReader {
 public:
  WallReader(const BlockStorage& store, const SceneInfo& info)
      : store_(&store), info_(&info) {}

  // Gets a planar wall and its plane. `share` is the share of the scene's faces
  // that were read so far.
  using Visitor = std::function<void(
      const Polygon& wall, const Plane& plane, double share)>;

  // Finds whether small emitting faces count as luminaires. To be called once,
  // before ForEach. A luminaire hangs in a room and bounds none. Small emitting
  // faces are luminaires unless much of the scene emits, as in a furnace.
  void FindLuminaires() {
    double all_m2 = 0;
    double emitting_m2 = 0;
    ForEachFace(*store_, [&](FaceId, const Face& face) {
      if (MaySplit(face, *info_)) {
        VisitParts(face.vertices, [&](const Polygon&, double area_m2) {
          all_m2 += area_m2;
          emitting_m2 += EmitsLight(face) ? area_m2 : 0;
        });
      }
    });
    without_luminaires_ =
        info_->spaces.empty() && emitting_m2 < kMostEmittingShare * all_m2;
  }

  void ForEach(const Visitor& visit) const {
    ForEachFace(*store_, [&](FaceId id, const Face& face) {
      if (!MaySplit(face, *info_)) {
        return;
      }
      const double share = static_cast<double>(id.Index() + 1) /
                           static_cast<double>(info_->faces);
      const bool may_hang = without_luminaires_ && EmitsLight(face);
      VisitParts(face.vertices, [&](const Polygon& part, double area_m2) {
        if (!may_hang || area_m2 >= kLargestLuminaireM2) {
          visit(part, PlaneOf(part), share);
        }
      });
    });
    for (const Opening& opening : info_->openings) {
      if (opening.vertices.size() >= 3) {
        VisitParts(opening.vertices, [&](const Polygon& part, double) {
          visit(part, PlaneOf(part), 1);
        });
      }
    }
  }

 private:
  [[nodiscard]] bool EmitsLight(const Face& face) const {
    return Emits(info_->materials[face.material.Index()]);
  }

  static void VisitParts(
      const Polygon& polygon,
      const std::function<void(const Polygon& part, double area_m2)>& visit) {
    for (const Polygon& part : PlanarParts(polygon)) {
      const double area_m2 = PolygonArea(part);
      if (area_m2 >= kLeastAreaM2) {
        visit(part, area_m2);
      }
    }
  }

  const BlockStorage* store_;
  const SceneInfo* info_;
  bool without_luminaires_ = false;
};

}  // namespace

Walls GatherWalls(const BlockStorage& store,
                  const SceneInfo& info,
                  MemoryBudget& budget,
                  ScratchShelf& shelf) {
  Walls walls{FragmentList(shelf), {}};
  walls.rules.all_split = info.gbxml.has_value() || !info.spaces.empty();
  WallReader reader(store, info);
  reader.FindLuminaires();
  walls.rules.up = info.y_is_up ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  PlaneGroups groups(info.bounds.Center(), budget);
  reader.ForEach([&groups](const Polygon&, const Plane& plane, double share) {
    groups.Add(plane, share);
  });
  groups.Number();
  reader.ForEach([&](const Polygon& wall, const Plane& plane, double) {
    walls.fragments.Add({wall, plane, groups.Of(plane)});
  });
  return walls;
}

}  // namespace enfilade
