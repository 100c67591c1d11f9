// The element trees of coplanar patches, refined for display until they are
// balanced: touching leaves differ by at most one level (Willmott and Heckbert
// 1997, section 2.5). Since patches have no common levels, the rule compares
// lengths: the longest edge of a leaf is at most twice that of every leaf that
// it touches, even if only at a corner. A leaf lower than twice kCrackM is not
// split for that.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "partition/patch.h"
#include "solver/elements/basis.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/solution/coplanar.h"
#include "solver/solution/plane_index.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace enfilade {

// An element of the display trees. The first indices are those of the roots,
// which are the patches of the group in their order; the four children of an
// element have consecutive indices above that of their parent.
struct DisplayElement {
  uint32_t parent = 0;       // of a root: itself
  uint32_t first_child = 0;  // 0: a leaf
  uint32_t root = 0;
  std::optional<ElementId> source;  // in the solution's tree, if any
  ElementFrame frame;
};

class DisplayForest {
 public:
  // Copies the trees of a group from the solution's tree.
  DisplayForest(const CellTree& tree,
                const CoplanarPatches& cell,
                size_t group,
                MemoryBudget& budget);

  // Splits leaves until the forest is balanced.
  void Balance();

  // Splits every leaf once.
  void SplitLeaves();

  [[nodiscard]] size_t Size() const { return elements_.size(); }

  [[nodiscard]] const DisplayElement& At(size_t e) const {
    return elements_[e];
  }

  [[nodiscard]] bool IsLeaf(size_t e) const {
    return elements_[e].first_child == 0;
  }

  [[nodiscard]] PatchShape ShapeOf(size_t e) const {
    return roots_[elements_[e].root].shape;
  }

  [[nodiscard]] PatchId PatchOf(size_t e) const {
    return roots_[elements_[e].root].patch;
  }

  [[nodiscard]] size_t CornerCount(size_t e) const {
    return enfilade::CornerCount(ShapeOf(e));
  }

  // The point with coordinates `p` within element e.
  [[nodiscard]] PlanePoint PointOn(size_t e, UnitPoint p) const;

  // Coordinates of a point within element e.
  [[nodiscard]] UnitPoint LocalOf(size_t e, PlanePoint p) const;

  // The longest edge, metres.
  [[nodiscard]] double EdgeOf(size_t e) const;

  // The height over the longest edge, metres.
  [[nodiscard]] double HeightOf(size_t e) const;

  // Points closer than this are one point, metres: kCrackM or, if the lowest
  // leaf is lower than 8 kCrackM, an eighth of its height.
  [[nodiscard]] double ToleranceM() const { return tolerance_m_; }

  // The leaves that contain `p` or come closer to it than twice the tolerance,
  // in a fixed order.
  void LeavesAt(PlanePoint p, std::vector<uint32_t>* leaves) const;

  // The root of a patch. Requires a patch of the group.
  [[nodiscard]] size_t RootOf(PatchId patch) const;

  // The leaf of a patch at patch coordinates `p`. Requires a patch of the
  // group.
  [[nodiscard]] size_t LeafOf(PatchId patch, UnitPoint p) const;

  [[nodiscard]] const PatchPlane& Frame() const { return frame_; }

 private:
  struct Root {
    PatchId patch;
    PatchShape shape{};
    PlanePoint origin, u, v;
    double longest_m = 0;
    // Height over the longest edge.
    double height_m = 0;
  };

  void AddRoot(const Patch& patch, PatchId id);
  void CopyTree(const CellTree& tree);
  [[nodiscard]] uint64_t BytesFor(size_t elements) const;
  void Reserve(size_t elements);
  void Split(size_t e);
  void SplitIfLarger(size_t e, double most_m, std::vector<uint32_t>* work);
  void DescendTo(PlanePoint p,
                 size_t root,
                 std::vector<uint32_t>* leaves) const;
  void EndPass();
  [[nodiscard]] bool Contains(size_t e, PlanePoint p, double margin_m) const;

  PatchPlane frame_;
  std::vector<Root> roots_;
  std::vector<DisplayElement> elements_;
  std::vector<PlaneIndex> index_;  // a single index, over the roots
  double tolerance_m_ = 0;
  GrowingCharge charge_;
};

}  // namespace enfilade
