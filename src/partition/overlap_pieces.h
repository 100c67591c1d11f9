// What is left of patches that lie in others, and how far it is put before
// them.

#pragma once

#include "base/memory.h"
#include "partition/overlap.h"
#include "partition/overlap_pairs.h"
#include "partition/patch.h"
#include "partition/polygon.h"
#include "scene/box_tree.h"

#include <cstdint>
#include <set>
#include <span>
#include <unordered_map>
#include <vector>

namespace enfilade {

// A part of a patch, and how many times kApartM it is put before the patch.
struct OverlapPiece {
  Polygon polygon;  // in the plane of the patch
  uint8_t layer = 0;
};

// The pieces of the patches of one cell. Borrows patches, tree (TreeOf), ranks
// (RanksFromBack) and the budget, to which the pieces are charged: of patches
// that lie in one place there are many.
class OverlapPieces {
 public:
  OverlapPieces(std::span<const Patch> patches,
                const BoxTree& tree,
                std::span<const uint32_t> ranks,
                MemoryBudget& budget)
      : patches_(patches),
        tree_(&tree),
        ranks_(ranks),
        charge_(budget, "surfaces that lie in one another") {}

  // Decides on one patch by all that it lies in. Requires that those of lower
  // rank are decided.
  void Settle(uint32_t front);

  // A carpet a millimetre above a floor with layers in it: they must not come
  // through. What lies that little before a patch that was put before others is
  // put before it again. Requires that all patches are decided.
  void RaiseAll();

  // What is left of a patch, maybe nothing; nullptr if it is untouched.
  [[nodiscard]] const std::vector<OverlapPiece>* Find(uint32_t patch) const;

  [[nodiscard]] bool IsEmpty() const { return pieces_.empty(); }

  // How many patches the pieces make, at most.
  [[nodiscard]] uint64_t MostPatches() const;

  [[nodiscard]] const OverlapCounts& Counts() const { return counts_; }

 private:
  // The pairs that a patch is the front of, being of higher rank than the
  // other, in the order of the ranks of those. Not those of all patches at
  // once: of many in one place, every two are a pair.
  [[nodiscard]] std::vector<OverlapPair> PairsOfFront(uint32_t front) const;
  [[nodiscard]] bool IsSame(const OverlapPair& pair) const;
  [[nodiscard]] std::vector<OverlapPiece> PiecesOf(uint32_t patch) const;

  void SettleBy(std::span<const OverlapPair> pairs);

  // Charges what settling a patch takes for a while.
  void ChargeSettling(std::span<const OverlapPair> pairs);
  void Keep(uint32_t patch, std::vector<OverlapPiece> pieces);

  // Puts before it what lies just above it. Adds to `raised` what was.
  void RaiseAbove(uint32_t own, std::set<uint32_t>* raised);

  // Puts the pieces of a patch that lies `height` before others before those of
  // them that were moved. False if all are.
  bool Raise(uint32_t patch,
             const std::vector<OverlapPiece>& others,
             double height,
             Vec3 normal);

  std::span<const Patch> patches_;
  const BoxTree* tree_;
  std::span<const uint32_t> ranks_;
  // Of the patches that were touched.
  std::unordered_map<uint32_t, std::vector<OverlapPiece>> pieces_;
  uint64_t piece_bytes_ = 0;
  GrowingCharge charge_;
  OverlapCounts counts_;
};

}  // namespace enfilade
