#include "solver/reference/panel_solution.h"

#include "base/check.h"
#include "base/error.h"

#include <algorithm>

namespace enfilade {
namespace {

// The mean squared difference of two trees below their elements a and b, which
// lie on the same part of a patch.
double MeanSquare(const CellTree& tree_a,
                  ElementId a,
                  const CellTree& tree_b,
                  ElementId b) {
  const uint32_t child_a = tree_a.At(a).first_child;
  const uint32_t child_b = tree_b.At(b).first_child;
  double sum = 0;
  if (child_a == 0 && child_b == 0) {
    const auto value_a = tree_a.Sent()[a];
    const auto value_b = tree_b.Sent()[b];
    for (size_t c = 0; c < value_a.size(); ++c) {
      const auto d = static_cast<double>(value_a[c] - value_b[c]);
      sum += d * d / static_cast<double>(value_a.size());
    }
    return sum;
  }
  for (uint32_t c = 0; c < kChildren; ++c) {
    sum += MeanSquare(tree_a,
                      child_a == 0 ? a : ElementId(child_a + c),
                      tree_b,
                      child_b == 0 ? b : ElementId(child_b + c)) /
           kChildren;
  }
  return sum;
}

}  // namespace

void RunControl::Check(double fraction, std::string_view part) const {
  if (stop != nullptr && stop->load()) {
    throw InterruptedError("stopped as asked; finished finenesses are kept");
  }
  if (progress) {
    progress({part, fraction, {}});
  }
}

TreeSolution MakeTrees(const ReferenceScene& scene,
                       const Basis& haar,
                       const PanelSolution& solution) {
  ENFILADE_CHECK(haar.kind.order == 1, "order {}", haar.kind.order);
  const TreeShape shape{&haar, kRgbChannels};
  TreeSolution made;
  for (size_t c = 0; c < scene.CellCount(); ++c) {
    made.trees.emplace_back(shape, scene.PatchesOf(c));
    made.gathered.emplace_back(shape.Stride());
  }
  size_t cell = 0;
  for (size_t i = 0; i < solution.panels.size(); ++i) {
    const Panel& panel = solution.panels[i];
    while (panel.patch < scene.CellBegin(cell)) {
      --cell;
    }
    while (panel.patch >= scene.CellBegin(cell + 1)) {
      ++cell;
    }
    const PatchId patch(panel.patch - scene.CellBegin(cell));
    for (const ElementPath path : scene.TreePaths(panel)) {
      CellTree& tree = made.trees[cell];
      const ElementId e = tree.FindOrCreate(patch, path, scene.PatchesOf(cell));
      made.gathered[cell].GrowTo(tree.Size());
      for (size_t k = 0; k < kRgbChannels; ++k) {
        made.gathered[cell][e][k] =
            static_cast<float>(solution.irradiance[i][k]);
      }
    }
  }
  for (size_t c = 0; c < made.trees.size(); ++c) {
    CellTree& tree = made.trees[c];
    made.gathered[c].GrowTo(tree.Size());
    tree.Sent() = PushPull(
        {tree, scene.PatchesOf(c), scene.Surfaces(), &made.gathered[c]});
    tree.UpdateDetail();
  }
  return made;
}

double SquaredDifference(const ReferenceScene& scene,
                         const std::vector<CellTree>& a,
                         const std::vector<CellTree>& b) {
  double sum = 0;
  for (size_t c = 0; c < scene.CellCount(); ++c) {
    const auto patches = scene.PatchesOf(c);
    for (size_t p = 0; p < patches.size(); ++p) {
      if (patches[p].reflects) {
        sum += static_cast<double>(patches[p].area) *
               MeanSquare(a[c], ElementId(p), b[c], ElementId(p));
      }
    }
  }
  return sum;
}

}  // namespace enfilade
