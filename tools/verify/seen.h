// Which emitters each cell sees, found by rays, for choosing among them.
//
// The tree over the emitters (lights.h) ignores walls, so in a building it
// would spend most samples on the lamps of other rooms. Every cell therefore
// keeps a list of the lamps (the facets of a bulb, or a single emitter) of the
// cells in its survey (survey.h). Each lamp has the share of the test rays to
// it that got through, or a small share if none did. The probability of a
// choice from x in cell c is the mixture
//
//   P(e | x, c) = t P_tree(e | x) + (1 - t) P_l(e | x) *
//                 share_c(l) I(l, x) / sum over the list of the same
//
//   I(l, x) = power_l max(0, n_x d + R) max(0, R - n_l d) / max(d^2, R^2)^2
//
// Here l is the lamp that e belongs to, and d is the vector from x to the
// centre of its bounding sphere, of radius R. I(l, x) is what l sends to x if
// nothing is between, up to a factor, and positive if l can send any light. P_l
// is the probability of the walk of the tree below l. A bulb emits in all
// directions, so |d| replaces -n_l d for it. A near lamp counts as seen
// whatever the rays of the cell say, as from inside a shade: share_c(l) is at
// least (3 R / |d|)^2 and at most 1. Lamps that the rays missed have a chance
// by the tree and are found by scattered rays, so that nothing biases the sum.

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
  // Starts without lists: every choice is the tree's.
  explicit SeenEmitters(const EmitterTree& tree) : tree_(&tree) {}

  // Finds the lists by a bounded number of rays per cell. They are a pure
  // function of the scene, the tree, `max_bytes` and `key`. Keeps at most
  // `max_bytes`, charged to the budget; if that is too little, the lists keep
  // the strongest lamps. Returns the number of rays traced.
  uint64_t Learn(const BuildingView& view,
                 MemoryBudget& budget,
                 uint64_t max_bytes,
                 uint64_t key);

  // As EmitterTree::Choose and Density, from a point x of the cell `at`, if the
  // cell is known. Density is that of the patch of y.
  [[nodiscard]] std::optional<EmitterTree::Choice> Choose(
      std::optional<CellId> at, Point3 x, Vec3 normal, double s) const;
  [[nodiscard]] double Density(std::optional<CellId> at,
                               Point3 x,
                               Vec3 normal,
                               const PatchPoint& y) const;

 private:
  struct Seen {
    uint32_t lamp = 0;
    float share = 0;  // of the rays that got through
  };

  // What the weights need of a lamp.
  struct LampShape {
    float power = 0;
    float radius = 0;
    float roundness = 0;  // 1: emits in all directions, normal is zero
    std::array<float, 3> center{};  // from middle_
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
  [[nodiscard]] LampShape ShapeOf(const EmitterTree::Lamp& lamp) const;
  [[nodiscard]] bool HasEmitterIn(CellId cell,
                                  const EmitterTree::Lamp& lamp) const;
  [[nodiscard]] double ListProbability(std::span<const Seen> list,
                                       const Weights& weights,
                                       uint32_t emitter,
                                       Point3 x,
                                       Vec3 normal) const;
  [[nodiscard]] Weights WeightsAt(std::span<const Seen> list,
                                  Point3 x,
                                  Vec3 normal) const;

  const EmitterTree* tree_;
  // Of the scene: single precision suffices for positions relative to it, also
  // in map coordinates.
  Point3 middle_;
  MemoryCharge shapes_charge_;
  std::vector<LampShape> shapes_;  // in the order of the tree's lamps
  CellLists<Seen> lists_;
};

}  // namespace enfilade
