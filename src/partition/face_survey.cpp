#include "partition/face_survey.h"

#include "partition/face_sorter.h"
#include "partition/patch_cutter.h"

#include <utility>

namespace enfilade {
namespace {

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
    survey_.patches[leaf.Index()] +=
        static_cast<uint32_t>(CountPatches(piece)) * sides;
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
