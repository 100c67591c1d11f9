#include "partition/wall_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace enfilade {
namespace {

constexpr double kLeastSplitterM2 = 0.05;
constexpr double kLargestLuminaireM2 = 4.0;
constexpr double kMostEmittingShare = 0.2;
constexpr double kGroupOffsetM = 1e-3;
constexpr double kGroupNormalStep = 1e-4;

uint64_t BytesOf(const WallFace& face) {
  return sizeof(WallFace) + face.polygon.capacity() * sizeof(Point3) +
         kAllocationHeaderBytes;
}

// Charges in steps, as the faces come.
class FaceCollector {
 public:
  FaceCollector(MemoryBudget& budget, WallFaces& walls)
      : budget_(&budget), walls_(&walls) {}

  // A polygon after which that share of the scene's faces was looked at.
  void Add(const Polygon& polygon, MaterialId material, double share) {
    share_ = share;
    for (const Polygon& part : PlanarParts(polygon)) {
      AddPlanar(part, material);
    }
  }

 private:
  void AddPlanar(const Polygon& polygon, MaterialId material) {
    const double area = PolygonArea(polygon);
    if (area < kLeastAreaM2) {
      return;
    }
    walls_->faces.push_back({polygon, PlaneOf(polygon), area, material, 0});
    bytes_ += BytesOf(walls_->faces.back());
    if (bytes_ > charged_) {
      charged_ = bytes_ + bytes_ / 2 + kChargeStepBytes;
      walls_->charge.Reset();
      walls_->charge = MemoryCharge(*budget_,
                                    charged_,
                                    "the walls of the scene",
                                    ComingBytes(charged_, share_));
    }
  }

  MemoryBudget* budget_;
  WallFaces* walls_;
  uint64_t bytes_ = 0;
  uint64_t charged_ = 0;
  double share_ = 1;
};

bool MaySplit(const Face& face, const SceneInfo& info) {
  if (!info.spaces.empty()) {
    return face.front_space != face.back_space;
  }
  return info.gbxml.has_value() ||
         Length(AreaVector(face.vertices)) >= kLeastSplitterM2;
}

// Small emitting faces hang in rooms and bound none, unless much of the scene
// emits, as in a furnace.
void RemoveLuminaires(const SceneInfo& info, std::vector<WallFace>& faces) {
  const auto emits = [&info](const WallFace& face) {
    return Emits(info.materials[face.material.Index()]);
  };
  double all_m2 = 0;
  double emitting_m2 = 0;
  for (const WallFace& face : faces) {
    all_m2 += face.area_m2;
    emitting_m2 += emits(face) ? face.area_m2 : 0;
  }
  if (emitting_m2 < kMostEmittingShare * all_m2) {
    std::erase_if(faces, [&emits](const WallFace& face) {
      return face.area_m2 < kLargestLuminaireM2 && emits(face);
    });
  }
}

// Sums the area that is square to each axis.
struct AxisAreas {
  std::array<double, 3> m2{};

  void Add(const Vec3& area) {
    const double length = Length(area);
    for (size_t axis = 0; axis < 3; ++axis) {
      if (std::abs(area[axis]) > 0.99 * length) {
        m2[axis] += length;
      }
    }
  }

  // A tie goes to z, then y.
  [[nodiscard]] Vec3 Up() const {
    if (m2[2] >= m2[1] && m2[2] >= m2[0]) {
      return {0, 0, 1};
    }
    return m2[1] >= m2[0] ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
  }
};

struct PlaneKey {
  std::array<int64_t, 3> normal{};
  double offset = 0;
};

// Of both sides of a plane the same.
PlaneKey KeyOf(const Plane& plane) {
  std::array<int64_t, 3> n{};
  for (size_t axis = 0; axis < 3; ++axis) {
    n[axis] = std::llround(plane.normal[axis] / kGroupNormalStep);
  }
  const bool flip = n < std::array<int64_t, 3>{-n[0], -n[1], -n[2]};
  if (flip) {
    return {{-n[0], -n[1], -n[2]}, -plane.offset};
  }
  return {n, plane.offset};
}

void NumberPlaneGroups(std::vector<WallFace>& faces) {
  std::vector<PlaneKey> keys;
  keys.reserve(faces.size());
  for (const WallFace& face : faces) {
    keys.push_back(KeyOf(face.plane));
  }
  std::vector<uint32_t> order(faces.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&keys](uint32_t a, uint32_t b) {
    return std::tie(keys[a].normal, keys[a].offset, a) <
           std::tie(keys[b].normal, keys[b].offset, b);
  });
  uint32_t group = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    if (i > 0) {
      const PlaneKey& before = keys[order[i - 1]];
      const PlaneKey& here = keys[order[i]];
      const bool same = before.normal == here.normal &&
                        here.offset - before.offset < kGroupOffsetM;
      group += same ? 0 : 1;
    }
    faces[order[i]].plane_group = group;
  }
}

}  // namespace

WallFaces GatherWallFaces(const BlockStorage& store,
                          const SceneInfo& info,
                          MemoryBudget& budget) {
  WallFaces walls;
  walls.all_split = info.gbxml.has_value() || !info.spaces.empty();
  AxisAreas areas;
  FaceCollector collector(budget, walls);
  ForEachFace(store, [&](FaceId id, const Face& face) {
    areas.Add(AreaVector(face.vertices));
    if (MaySplit(face, info)) {
      collector.Add(face.vertices,
                    face.material,
                    static_cast<double>(id.Index() + 1) /
                        static_cast<double>(info.faces));
    }
  });
  if (info.spaces.empty()) {
    RemoveLuminaires(info, walls.faces);
  }
  for (const Opening& opening : info.openings) {
    if (opening.vertices.size() >= 3) {
      collector.Add(opening.vertices, MaterialId(0U), 1);
    }
  }
  walls.up = areas.Up();
  NumberPlaneGroups(walls.faces);
  return walls;
}

}  // namespace enfilade
