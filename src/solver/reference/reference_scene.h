// A whole scene in core, as the reference methods see it: all patches of all
// cells, what blocks rays, and the exchange of light between two panels. A
// panel is a piece of a patch on which irradiance is one constant.
//
//   paper      here               unit
//   A_i        Panel::end.area    m2
//   F_ij       Exchange / A_i     1: share of what leaves i that arrives at j,
//                                 and of i's hemisphere that j fills
//   A_i F_ij   Exchange           m2; symmetric (reciprocity) to the last bit
//   V_ij       in Exchange        share of 16 rays that are not blocked

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "scene/scene_store.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/push_pull.h"
#include "solver/transfer/form_factor.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace enfilade {

// The reference methods take no more panels than this.
inline constexpr size_t kMostPanels = 20000;
// That substructuring may make of them, split ones included.
inline constexpr size_t kMostPanelReceivers = 2 * kMostPanels;

// A long parallelogram is cut across into 2^k strips before it is quartered, so
// that panels are about as long as wide. Strip i of 2^k has the number
// 2^k - 1 + i; number 0 is the whole patch.
struct Panel {
  uint32_t patch = 0;  // of all cells, in their order
  uint32_t strip = 0;
  ElementPath path = kRootPath;  // below the strip
  TransferEnd end;
};

// Where a panel of a parallelogram lies on its patch, in patch coordinates.
struct PanelRect {
  float a_low = 0, a_high = 1, b_low = 0, b_high = 1;
};

// The halvings k of strip 2^k - 1 + i.
size_t StripLevel(uint32_t strip);

// The order by which (i, j) and (j, i) are told apart.
bool ComesBefore(const Panel& i, const Panel& j);

class ReferenceScene {
 public:
  // Reads scene and partition from the store. Throws DoesNotFitError, which
  // names what would do, if the scene has more than kMostPanels patches or the
  // budget does not hold the scene.
  ReferenceScene(const BlockStorage& store,
                 uint64_t seed,
                 MemoryBudget& budget);

  // Cell c has the patches from CellBegin(c) to CellBegin(c + 1).
  [[nodiscard]] size_t CellCount() const { return cell_begins_.size() - 1; }

  [[nodiscard]] size_t CellBegin(size_t cell) const {
    return cell_begins_[cell];
  }

  [[nodiscard]] std::span<const PatchGeometry> PatchesOf(size_t cell) const {
    return std::span(patches_).subspan(
        cell_begins_[cell], cell_begins_[cell + 1] - cell_begins_[cell]);
  }

  [[nodiscard]] PatchShape ShapeOf(uint32_t patch) const {
    return patches_[patch].shape;
  }

  [[nodiscard]] const SurfaceTable& Surfaces() const { return surfaces_; }

  // Reflectance and exitance of a panel; zero where it does not reflect or
  // does not emit.
  [[nodiscard]] Rgb ReflectanceOf(const Panel& panel) const;
  [[nodiscard]] Rgb ExitanceOf(const Panel& panel) const;

  // The longest edge of a patch that sees another one, m.
  [[nodiscard]] double LongestEdge() const;

  [[nodiscard]] Panel PanelAt(uint32_t patch,
                              uint32_t strip,
                              ElementPath path) const;

  // Requires a panel of a parallelogram.
  [[nodiscard]] PanelRect RectOf(const Panel& panel) const;

  // The number of the strip, of the 2^k strips of a patch, in which the point
  // lies. The point is converted from patch coordinates to coordinates in that
  // strip.
  [[nodiscard]] uint32_t StripAt(uint32_t patch, size_t k, UnitPoint* p) const;

  // Whether `inner` is part of `outer`. Requires that `inner` is no larger.
  [[nodiscard]] bool Covers(const Panel& outer, const Panel& inner) const;

  // The elements of the patch's tree that make up a panel.
  [[nodiscard]] std::vector<ElementPath> TreePaths(const Panel& panel) const;

  // How many panels Dice would return.
  [[nodiscard]] size_t DiceCount(double longest_edge) const;

  // Cuts every patch until no edge is longer than `longest_edge`, into at most
  // 16 strips; a patch that sees no other patch stays whole. The panels are in
  // the order of patches, strips and paths.
  [[nodiscard]] std::vector<Panel> Dice(double longest_edge) const;

  // Whether parts of both panels lie in front of each other, so that they may
  // exchange light.
  [[nodiscard]] static bool Face(const Panel& i, const Panel& j);

  // A_i F_ij, in m2, visibility included. Thread-safe.
  [[nodiscard]] float Exchange(const Panel& i, const Panel& j) const;

  // The share of up to 16 rays between two panels that are not blocked, the
  // same for (i, j) and (j, i). Rays join points that face each other: what
  // lies behind a horizon is not hidden, but left out by the form factor. 1 if
  // no such points are found. Thread-safe.
  [[nodiscard]] float VisibleShare(const Panel& i, const Panel& j) const;

  // The share of rays from the center of i to j that are not blocked. Only rays
  // to points of j above the horizon of i count. Thread-safe.
  [[nodiscard]] float ShareSeenFromCenter(const Panel& i, const Panel& j) const;

  // Bit i is set if segment i of the packet is blocked. Thread-safe.
  [[nodiscard]] uint32_t Blocked(const SegmentPacket& packet) const {
    return Occluded(blockers_, packet);
  }

  // The key from which the random numbers of a panel are drawn.
  [[nodiscard]] uint64_t KeyOf(const Panel& panel) const;

  // World coordinates of the origin of all panels.
  [[nodiscard]] Point3 Origin() const { return device_.Origin(); }

  // Whether at most one of 256 rays from the panel leaves the scene (one may
  // slip through where surfaces meet). If so, the form factors of the panel sum
  // to 1.
  [[nodiscard]] bool IsEnclosed(const Panel& panel) const;

 private:
  // How often a patch is halved across its length and its width.
  struct Cuts {
    size_t strips = 0;    // halvings of the length alone
    size_t quarters = 0;  // halvings of length and width
  };

  [[nodiscard]] Cuts CutsFor(size_t patch, double longest_edge) const;
  void AppendStrips(const PatchGeometry& patch);

  uint64_t seed_;
  SurfaceTable surfaces_;
  std::vector<PatchGeometry> patches_;  // of all cells
  std::vector<size_t> cell_begins_;
  std::vector<PatchGeometry> strips_;  // of all patches
  std::vector<size_t> strip_begins_;   // by patch
  std::vector<bool> sees_;             // per patch: faces another
  float reach_ = 0;                    // m, longer than the scene
  OcclusionDevice device_;
  std::vector<std::shared_ptr<const RayBlockers>> held_blockers_;
  std::vector<const RayBlockers*> blockers_;
  MemoryCharge charge_;
  MemoryCharge strip_charge_;
};

}  // namespace enfilade
