// Computes what is left of patches that lie in others, and how far each piece
// is put in front of them.

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

// A part of a patch. The part is put `layer` times kApartM in front of the
// patch.
struct OverlapPiece {
  Polygon polygon;  // in the plane of the patch
  uint8_t layer = 0;
};

// The patches of one cell, and what is known of them; borrowed.
struct RankedPatches {
  std::span<const Patch> patches;
  const BoxTree& tree;                    // TreeOf
  std::span<const FaceFacts> faces;       // by FaceId
  std::span<const SurfaceRank> surfaces;  // RankSurfaces
  std::span<const uint32_t> ranks;        // RanksFromBack
};

// The pieces of the patches of one cell. They are charged to the budget, which
// is borrowed, because there are many pieces where many patches lie in one
// place.
class OverlapPieces {
 public:
  OverlapPieces(const RankedPatches& cell, MemoryBudget& budget)
      : patches_(cell.patches),
        tree_(&cell.tree),
        faces_(cell.faces),
        surfaces_(cell.surfaces),
        ranks_(cell.ranks),
        charge_(budget, "surfaces that lie in one another") {}

  // Cuts and raises one patch according to all patches of lower rank that it
  // lies in. Requires that all patches of lower rank are settled.
  void Settle(uint32_t front);

  // Raises every patch that lies just in front of a patch that was itself put
  // in front of others, so that the layers of a floor do not come through a
  // carpet a millimetre above the floor. Requires that all patches are settled.
  void RaiseAll();

  // The pieces that are left of a patch, possibly none; nullptr if the patch is
  // untouched.
  [[nodiscard]] const std::vector<OverlapPiece>* Find(uint32_t patch) const;

  [[nodiscard]] bool IsEmpty() const { return pieces_.empty(); }

  // The most patches that the pieces can make.
  [[nodiscard]] uint64_t MostPatches() const;

  [[nodiscard]] const OverlapCounts& Counts() const { return counts_; }

 private:
  // The pairs whose front is this patch and whose other patch has a lower rank,
  // in the order of the other patch's rank. Finds the pairs of one patch at a
  // time, because among many patches in one place every two are a pair.
  [[nodiscard]] std::vector<OverlapPair> PairsOfFront(uint32_t front) const;
  // Whether the two faces are one that is there twice.
  [[nodiscard]] bool IsSame(const OverlapPair& pair) const;
  // Whether the front is the inside of a sheet whose outside is the other.
  [[nodiscard]] bool IsInSheet(const OverlapPair& pair) const;
  [[nodiscard]] std::vector<OverlapPiece> PiecesOf(uint32_t patch) const;

  void SettleBy(std::span<const OverlapPair> pairs);

  // Charges the memory that settling a patch takes temporarily.
  void ChargeSettling(std::span<const OverlapPair> pairs);
  void Keep(uint32_t patch, std::vector<OverlapPiece> pieces);

  // Raises the patches that lie just above the patch `own` so that they stay in
  // front of its pieces. Adds the raised patches to `raised`.
  void RaiseAbove(uint32_t own, std::set<uint32_t>* raised);

  // Takes a patch that lies `height` in front of the patch of `others`, and
  // puts its pieces in front of those of `others` that were moved. Returns
  // false if all pieces are in front already.
  bool Raise(uint32_t patch,
             const std::vector<OverlapPiece>& others,
             double height,
             Vec3 normal);

  std::span<const Patch> patches_;
  const BoxTree* tree_;
  std::span<const FaceFacts> faces_;
  std::span<const SurfaceRank> surfaces_;
  std::span<const uint32_t> ranks_;
  // The pieces of the patches that were touched.
  std::unordered_map<uint32_t, std::vector<OverlapPiece>> pieces_;
  uint64_t piece_bytes_ = 0;
  GrowingCharge charge_;
  OverlapCounts counts_;
};

}  // namespace enfilade
