#include "partition/face_survey.h"

#include "partition/face_sorter.h"
#include "partition/patch_cutter.h"

#include <utility>

namespace enfilade {
namespace {

// The most patches that a polygon is cut into (patch_cutter.h).
uint32_t CountPatches(const Polygon& polygon) {
  const auto n = static_cast<uint32_t>(polygon.size());
  if (n == 4) {
    const Vec3 u = polygon[1] - polygon[0];
    const bool is_parallelogram =
        Length(u - (polygon[2] - polygon[3])) < kRoundingM;
    return is_parallelogram
               ? static_cast<uint32_t>(LongParts(u, polygon[3] - polygon[0]))
               : 2;
  }
  return n < 3 ? 0 : n - 2;
}

class Surveyor : public FaceSorter {
 public:
  Surveyor(const BspTree& tree, MemoryBudget& budget) : FaceSorter(tree) {
    survey_.charge =
        MemoryCharge(budget,
                     tree.nodes.size() * sizeof(uint64_t) +
                         tree.leaf_count * (sizeof(uint32_t) + sizeof(float)),
                     "the faces of convex regions");
    survey_.cover_bytes.resize(tree.nodes.size());
    survey_.patches.resize(tree.leaf_count);
    survey_.area_m2.resize(tree.leaf_count);
  }

  FaceSurvey Finish() { return std::move(survey_); }

 private:
  void AddToLeaf(LeafId leaf, const Polygon& piece, uint32_t sides) override {
    survey_.patches[leaf.Index()] += CountPatches(piece) * sides;
    survey_.area_m2[leaf.Index()] +=
        static_cast<float>(PolygonArea(piece) * sides);
  }

  void AddCover(NodeId node, const Polygon& piece) override {
    survey_.cover_bytes[node.Index()] += BytesOfCover(piece);
  }

  FaceSurvey survey_;
};

}  // namespace

FaceSurvey SurveyFaces(const BlockStorage& store,
                       const BspTree& tree,
                       MemoryBudget& budget) {
  Surveyor surveyor(tree, budget);
  surveyor.AddAll(store);
  return surveyor.Finish();
}

}  // namespace enfilade
