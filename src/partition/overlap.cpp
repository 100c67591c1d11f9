#include "partition/overlap.h"

#include "partition/overlap_pairs.h"
#include "partition/overlap_pieces.h"
#include "partition/patch_cutter.h"
#include "scene/box_tree.h"

#include <span>
#include <unordered_set>
#include <utility>

namespace enfilade {
namespace {

// Box, tree, rank and face area of a patch, and its share of pairs and pieces.
constexpr uint64_t kOverlapBytesPerPatch = 320;

// Decides patch by patch, all pairs of one front at a time.
void SettleAll(std::span<const OverlapPair> pairs, OverlapPieces* pieces) {
  while (!pairs.empty()) {
    size_t count = 1;
    while (count < pairs.size() && pairs[count].front == pairs[0].front) {
      ++count;
    }
    pieces->Settle(pairs.first(count));
    pairs = pairs.subspan(count);
  }
}

// The patches as they are left.
std::vector<Patch> Replaced(std::span<const Patch> patches,
                            const OverlapPieces& pieces) {
  // Its two sides are no longer in one place: each blocks rays for itself.
  std::unordered_set<uint32_t> touched_faces;
  for (uint32_t i = 0; i < patches.size(); ++i) {
    if (pieces.Find(i) != nullptr) {
      touched_faces.insert(patches[i].face.value);
    }
  }
  std::vector<Patch> kept;
  for (uint32_t i = 0; i < patches.size(); ++i) {
    Patch patch = patches[i];
    patch.is_twin = patch.is_twin && !touched_faces.contains(patch.face.value);
    const std::vector<OverlapPiece>* left = pieces.Find(i);
    if (left == nullptr) {
      kept.push_back(patch);
      continue;
    }
    const Vec3 normal = PatchNormal(patch);
    for (const OverlapPiece& piece : *left) {
      patch.layer = piece.layer;
      AppendAsPatches(
          patch, piece.polygon, normal * (piece.layer * kApartM), &kept);
    }
  }
  return kept;
}

}  // namespace

OverlapCounts SeparateOverlaps(std::vector<Patch>& patches) {
  const BoxTree tree = TreeOf(patches);
  std::vector<OverlapPair> pairs = FindOverlapPairs(patches, tree);
  if (pairs.empty()) {
    return {};
  }
  const std::vector<uint32_t> ranks = RanksFromBack(patches);
  SortFrontAfterBehind(ranks, &pairs);
  OverlapPieces pieces(patches, tree, ranks);
  SettleAll(pairs, &pieces);
  pieces.RaiseAll();
  patches = Replaced(patches, pieces);
  return pieces.Counts();
}

uint64_t SeparateOverlapsBytes(size_t patches) {
  return patches * kOverlapBytesPerPatch;
}

}  // namespace enfilade
