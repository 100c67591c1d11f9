#include "partition/overlap.h"

#include "base/stop.h"
#include "partition/overlap_pairs.h"
#include "partition/overlap_pieces.h"
#include "partition/overlap_rims.h"
#include "partition/overlap_sizes.h"
#include "partition/patch_cutter.h"
#include "scene/box_tree.h"

#include <span>
#include <unordered_set>
#include <utility>

namespace enfilade {
namespace {

// A patch's box, tree entry and ranks, and the pairs of a patch that
// is in front of all others.
constexpr uint64_t kOverlapBytesPerPatch = 336;

// Settles patch by patch, from back to front.
void SettleAll(std::span<const uint32_t> ranks, OverlapPieces* pieces) {
  std::vector<uint32_t> from_back(ranks.size());
  for (uint32_t i = 0; i < ranks.size(); ++i) {
    from_back[ranks[i]] = i;
  }
  for (const uint32_t front : from_back) {
    ThrowIfStopRequested();
    pieces->Settle(front);
  }
}

// The patches after all pieces are settled. `rims`: by patch.
std::vector<Patch> Replaced(std::span<const Patch> patches,
                            const OverlapPieces& pieces,
                            std::span<const RimCut> rims) {
  // The two sides of a touched face are no longer in one place, so each of them
  // blocks rays by itself.
  std::unordered_set<uint32_t> touched_faces;
  for (uint32_t i = 0; i < patches.size(); ++i) {
    if (pieces.Find(i) != nullptr) {
      touched_faces.insert(patches[i].face.value);
    }
  }
  for (const RimCut& rim : rims) {
    touched_faces.insert(patches[rim.patch].face.value);
  }
  std::vector<Patch> kept;
  auto rim = rims.begin();
  for (uint32_t i = 0; i < patches.size(); ++i) {
    Patch patch = patches[i];
    patch.is_twin = patch.is_twin && !touched_faces.contains(patch.face.value);
    for (; rim != rims.end() && rim->patch == i; ++rim) {
      patch = WithoutRim(patch, *rim);
    }
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

// The area of all the strips. `rims`: by patch.
double AreaOf(std::span<const RimCut> rims, std::span<const Patch> patches) {
  double area = 0;
  for (auto rim = rims.begin(); rim != rims.end();) {
    const uint32_t i = rim->patch;
    Patch left = patches[i];
    for (; rim != rims.end() && rim->patch == i; ++rim) {
      left = WithoutRim(left, *rim);
    }
    area += PatchArea(patches[i]) - PatchArea(left);
  }
  return area;
}

}  // namespace

OverlapCounts SeparateOverlaps(std::vector<Patch>& patches,
                               std::span<const FaceFacts> faces,
                               MemoryBudget& budget) {
  const BoxTree tree = TreeOf(patches);
  const std::vector<SurfaceRank> surfaces = RankSurfaces(patches, tree, faces);
  const std::vector<uint32_t> ranks = RanksFromBack(patches, surfaces);
  OverlapPieces pieces({patches, tree, faces, surfaces, ranks}, budget);
  SettleAll(ranks, &pieces);
  if (pieces.IsEmpty()) {
    return {};
  }
  pieces.RaiseAll();
  GrowingCharge rims_charge(budget, "the rims of surfaces that were moved");
  const std::vector<RimCut> rims =
      FindRims(patches, tree, pieces, &rims_charge);
  // A growing vector takes twice its size.
  const MemoryCharge charge(budget,
                            2 * pieces.MostPatches() * sizeof(Patch),
                            "surfaces that lie in one another");
  OverlapCounts counts = pieces.Counts();
  counts.area_m2 += AreaOf(rims, patches);
  patches = Replaced(patches, pieces, rims);
  return counts;
}

uint64_t SeparateOverlapsBytes(size_t patches) {
  return patches * kOverlapBytesPerPatch;
}

}  // namespace enfilade
