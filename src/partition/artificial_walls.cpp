#include "partition/artificial_walls.h"

#include "base/stop.h"
#include "partition/face_sorter.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

namespace enfilade {
namespace {

// No part is made thinner than this.
constexpr double kLeastPartM = 0.2;
// Each part of a leaf is aimed to hold this share of the most patches, because
// a face that reaches into both parts counts twice.
constexpr double kAimedShare = 0.75;
constexpr int kMostRounds = 12;
// The most centers in memory at once, unless one leaf has more. Does not depend
// on the memory cap, because the leaves' numbers depend on it.
constexpr uint64_t kMostCenters = (12ULL << 20) / sizeof(Point3);

using Centers = std::map<uint32_t, std::vector<Point3>>;  // by LeafId

// Crowded leaves that are relieved at once: those from `first` up to, but not
// including, `end`.
struct LeafBatch {
  uint32_t first = 0;
  uint32_t end = 0;
  uint64_t patches = 0;       // of its crowded leaves together
  uint64_t most_patches = 0;  // of the most crowded leaf
};

// Returns the batch that begins at the leaf `first`.
LeafBatch NextBatch(const FaceSurvey& survey,
                    uint32_t most_patches,
                    uint32_t first) {
  LeafBatch batch{first, first, 0, 0};
  for (; batch.end < survey.patches.size(); ++batch.end) {
    const uint64_t patches = survey.patches[batch.end];
    if (patches <= most_patches) {
      continue;
    }
    if (batch.patches > 0 && batch.patches + patches > kMostCenters) {
      break;
    }
    batch.patches += patches;
    batch.most_patches = std::max(batch.most_patches, patches);
  }
  return batch;
}

// Collects the centers of the pieces of faces in the crowded leaves of a batch.
class CenterCollector : public FaceSorter {
 public:
  CenterCollector(const BspTree& tree,
                  const FaceSurvey& survey,
                  uint32_t most_patches,
                  const LeafBatch& batch)
      : FaceSorter(tree) {
    for (uint32_t leaf = batch.first; leaf < batch.end; ++leaf) {
      if (survey.patches[leaf] > most_patches) {
        centers_[leaf].reserve(survey.patches[leaf]);
      }
    }
  }

  Centers Take() { return std::move(centers_); }

 private:
  void AddToLeaf(LeafId leaf,
                 const Polygon& piece,
                 uint32_t /*sides*/) override {
    const auto found = centers_.find(leaf.value);
    if (found != centers_.end()) {
      found->second.push_back(VertexMean(piece));
    }
  }

  void AddCover(NodeId /*node*/, const Polygon& /*piece*/) override {}

  Centers centers_;
};

// Replaces crowded leaves by subtrees. Cuts the regions of the leaves out again
// on the way down, because the regions are not kept.
class LeafCutter {
 public:
  LeafCutter(const FaceSurvey& survey, uint32_t most_patches, BuiltTree& built)
      : survey_(&survey), most_patches_(most_patches), built_(&built) {}

  // Returns the child that stands in the place of `child`.
  BspChild Relieve(BspChild child,
                   const ConvexRegion& region,
                   Centers& centers) {
    if (child.IsLeaf()) {
      const auto found = centers.find(child.Leaf().value);
      if (found == centers.end()) {
        return child;
      }
      const double patches = survey_->patches[child.Leaf().Index()];
      const double per_center =
          patches / static_cast<double>(found->second.size());
      return Cut(child.Leaf(), region, std::move(found->second), per_center);
    }
    const size_t id = child.Node().Index();
    const Plane plane = built_->tree.nodes[id].plane;
    const ConvexRegion::Halves halves = region.Cut(plane);
    const BspChild front =
        Relieve(built_->tree.nodes[id].front, halves.front, centers);
    const BspChild back =
        Relieve(built_->tree.nodes[id].back, halves.back, centers);
    built_->tree.nodes[id].front = front;
    built_->tree.nodes[id].back = back;
    return child;
  }

  [[nodiscard]] bool CutAny() const { return cut_any_; }

 private:
  BspChild Cut(LeafId leaf,
               const ConvexRegion& region,
               std::vector<Point3> centers,
               double patches_per_center) {
    ThrowIfStopRequested();
    const double patches =
        static_cast<double>(centers.size()) * patches_per_center;
    const auto plane = patches > kAimedShare * most_patches_
                           ? MedianPlane(region, centers)
                           : std::nullopt;
    if (!plane) {
      built_->leaves[leaf.Index()] = ShapeOf(region);
      return BspChild(leaf);
    }
    cut_any_ = true;
    const NodeId id(built_->tree.nodes.size());
    built_->tree.nodes.push_back({*plane, {}, {}});
    built_->sections.push_back(region.CrossSection(*plane));
    const auto middle = std::partition(
        centers.begin(), centers.end(), [&plane](const Point3& p) {
          return plane->Distance(p) >= 0;
        });
    std::vector<Point3> behind(middle, centers.end());
    centers.erase(middle, centers.end());
    const ConvexRegion::Halves halves = region.Cut(*plane);
    const BspChild front =
        Cut(leaf, halves.front, std::move(centers), patches_per_center);
    built_->leaves.emplace_back();
    const LeafId added(built_->leaves.size() - 1);
    const BspChild back =
        Cut(added, halves.back, std::move(behind), patches_per_center);
    built_->tree.nodes[id.Index()].front = front;
    built_->tree.nodes[id.Index()].back = back;
    return BspChild(id);
  }

  // The plane through the median of the centers, perpendicular to the longest
  // axis for which both parts are thick enough; nullopt if there is none.
  static std::optional<Plane> MedianPlane(const ConvexRegion& region,
                                          std::vector<Point3>& centers) {
    const Vec3 extent = region.Bounds().Extent();
    std::array<size_t, 3> axes{0, 1, 2};
    std::stable_sort(axes.begin(), axes.end(), [&extent](size_t a, size_t b) {
      return extent[a] > extent[b];
    });
    for (const size_t axis : axes) {
      const auto middle =
          centers.begin() + static_cast<std::ptrdiff_t>(centers.size() / 2);
      std::nth_element(centers.begin(),
                       middle,
                       centers.end(),
                       [axis](const Point3& a, const Point3& b) {
                         return a[axis] < b[axis];
                       });
      const Vec3 normal{
          axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
      const Plane plane{normal, (*middle)[axis]};
      const auto thickness = region.ThicknessAt(plane);
      if (std::min(thickness.front_m, thickness.back_m) > kLeastPartM) {
        return plane;
      }
    }
    return std::nullopt;
  }

  const FaceSurvey* survey_;
  uint32_t most_patches_;
  BuiltTree* built_;
  bool cut_any_ = false;
};

bool IsAnyCrowded(const FaceSurvey& survey, uint32_t most_patches) {
  return std::any_of(
      survey.patches.begin(),
      survey.patches.end(),
      [most_patches](uint32_t patches) { return patches > most_patches; });
}

}  // namespace

FaceSurvey RelieveCrowdedLeaves(const BlockStorage& store,
                                uint32_t most_patches,
                                MemoryBudget& budget,
                                BuiltTree& built) {
  FaceSurvey survey = SurveyFaces(store, built.tree, budget);
  for (int round = 0; round < kMostRounds; ++round) {
    if (!IsAnyCrowded(survey, most_patches)) {
      break;
    }
    LeafCutter cutter(survey, most_patches, built);
    for (LeafBatch batch = NextBatch(survey, most_patches, 0);
         batch.patches > 0;
         batch = NextBatch(survey, most_patches, batch.end)) {
      // The survey has counted a patch or more of each piece, which makes one
      // center. Cutting a leaf copies half of its centers, then half of those,
      // and so on.
      const MemoryCharge charge(
          budget,
          (batch.patches + batch.most_patches) * sizeof(Point3),
          "the faces of crowded rooms");
      CenterCollector collector(built.tree, survey, most_patches, batch);
      collector.AddAll(store);
      Centers centers = collector.Take();
      built.tree.root = cutter.Relieve(
          built.tree.root, ConvexRegion(built.tree.box), centers);
    }
    built.tree.leaf_count = static_cast<uint32_t>(built.leaves.size());
    if (!cutter.CutAny()) {
      break;
    }
    survey = {};
    survey = SurveyFaces(store, built.tree, budget);
  }
  return survey;
}

}  // namespace enfilade
