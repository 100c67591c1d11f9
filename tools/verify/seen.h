// Which emitters each cell sees, found by rays, for choosing among them.
//
// The tree over the emitters (lights.h) knows nothing of walls: of the
// lamps of a building it would spend most samples on those of other rooms. So
// every cell keeps the lamps (the facets of a bulb, or an emitter of its own)
// that rays found to be seen from its patches, each with the share of the rays
// to it that got through, or a little where none did; and a choice from x in
// cell c is the mixture
//
//   P(e | x, c) = t P_tree(e | x) + (1 - t) P_l(e | x) *
//                 share_c(l) I(l, x) / sum over the list of the same
//
//   I(l, x) = power_l max(0, n_x d + R) max(0, R - n_l d) / max(d^2, R^2)^2
//
// for d from x to the centre of the bounding sphere, of radius R, of the lamp l
// that e is in: what l sends to x if nothing is between, up to a factor, and
// not zero if it sends any. P_l is the walk of the tree below l; a bulb looks
// everywhere: |d| stands for -n_l d. What is near is seen whatever the rays of
// the cell say, as from inside of a shade: share_c(l) is (3 R / |d|)^2 at
// least, and no more than 1. What the rays missed has a chance by the tree (and
// is found by scattered rays): nothing biases the sum.

#pragma once

#include "base/memory.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tools/building_view.h"
#include "tools/verify/cell_lists.h"
#include "tools/verify/geometry.h"
#include "tools/verify/lights.h"

namespace enfilade {

class SeenEmitters {
 public:
  // Nothing is known to be seen: every choice is the tree's.
  explicit SeenEmitters(const EmitterTree& tree) : tree_(&tree) {}

  // Traces a fixed number of rays per cell, a pure function of the scene, the
  // tree and `key`. Keeps at most what `max_bytes` hold, charged to the
  // budget: cells beyond that keep no list. Returns the rays traced.
  uint64_t Learn(const BuildingView& view,
                 MemoryBudget& budget,
                 uint64_t max_bytes,
                 uint64_t key);

  // As EmitterTree::Choose and Density, from a point of a cell, if that
  // is known. Density: at the patch of y.
  [[nodiscard]] std::optional<EmitterTree::Choice> Choose(
      std::optional<CellId> at, Point3 x, Vec3 normal, double s) const;
  [[nodiscard]] double Density(std::optional<CellId> at,
                               Point3 x,
                               Vec3 normal,
                               const PatchPoint& y) const;

 private:
  struct Seen {
    uint32_t lamp = 0;
    float power = 0;
    float share = 0;  // of the rays that got through
    float radius = 0;
    float roundness = 0;  // 1: it looks everywhere, and the normal is zero
    std::array<float, 3> center{};
    std::array<float, 3> normal{};
  };

  struct Weights;

  uint64_t LearnCells(const BuildingView& view,
                      uint64_t group_cells,
                      uint64_t key);
  uint64_t Test(const BuildingView& view,
                CellId cell,
                std::span<const Receiver> points,
                std::span<const uint32_t> candidates,
                uint64_t key);
  [[nodiscard]] Seen MakeSeen(uint32_t lamp, double share) const;
  [[nodiscard]] bool HasEmitterIn(CellId cell,
                                  const EmitterTree::Lamp& lamp) const;
  [[nodiscard]] double ListProbability(std::span<const Seen> list,
                                       const Weights& weights,
                                       uint32_t emitter,
                                       Point3 x,
                                       Vec3 normal) const;
  [[nodiscard]] static Weights WeightsAt(std::span<const Seen> list,
                                         Point3 x,
                                         Vec3 normal);

  const EmitterTree* tree_;
  CellLists<Seen> lists_;
};

}  // namespace enfilade
