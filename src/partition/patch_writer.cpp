#include "partition/patch_writer.h"

#include "base/hash.h"
#include "partition/patch_cutter.h"
#include "scene/box_tree.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <utility>

namespace enfilade {
namespace {

constexpr size_t kHeldPatches = 32768;

// Patches by cell, parked in scratch blocks when there are many.
class CellPatchSink {
 public:
  CellPatchSink(size_t cells, MemoryBudget& budget, BlockStorage& store)
      : store_(&store),
        held_(cells),
        chunks_(cells),
        counts_(cells),
        charge_(budget,
                2 * kHeldPatches * sizeof(Patch) +
                    cells * (sizeof(std::vector<Patch>) + 8),
                "patches on their way to their cells") {}

  void Add(CellId cell, const Patch& patch) {
    held_[cell.Index()].push_back(patch);
    ++counts_[cell.Index()];
    if (++held_count_ >= kHeldPatches) {
      Park();
    }
  }

  [[nodiscard]] size_t Count(CellId cell) const {
    return counts_[cell.Index()];
  }

  // All patches of a cell, in the order of their ids.
  std::vector<Patch> Take(CellId cell) {
    std::vector<Patch> patches;
    for (uint32_t i = 0; i < chunks_[cell.Index()]; ++i) {
      const Bytes chunk =
          store_->GetOrThrow({BlockKind::kScratch, cell.value, i});
      CellPatches part = DecodeCellPatches(chunk);
      patches.insert(patches.end(), part.patches.begin(), part.patches.end());
    }
    const std::vector<Patch> rest = std::exchange(held_[cell.Index()], {});
    patches.insert(patches.end(), rest.begin(), rest.end());
    return patches;
  }

 private:
  void Park() {
    for (uint32_t cell = 0; cell < held_.size(); ++cell) {
      if (!held_[cell].empty()) {
        CellPatches part{{}, std::exchange(held_[cell], {})};
        store_->Put({BlockKind::kScratch, cell, chunks_[cell]++},
                    EncodeCellPatches(part));
      }
    }
    held_count_ = 0;
  }

  BlockStorage* store_;
  // Indexed by CellId, like chunks_ and counts_.
  std::vector<std::vector<Patch>> held_;
  std::vector<uint32_t> chunks_;
  std::vector<uint32_t> counts_;
  size_t held_count_ = 0;
  MemoryCharge charge_;
};

// The boxes where light begins: those of the emitting faces, moved a little in
// front of them. A lamp in the inner side of a wall thus lights the space that
// the wall closes off, and a lamp on the outer side does not.
class Lamps {
 public:
  Lamps(const SceneInfo& info, const BlockStorage& store, MemoryBudget& budget)
      : charge_(budget, "the boxes of the faces that emit"),
        tree_(BoxesOf(info, store, charge_)) {}

  // Whether light begins in the box.
  [[nodiscard]] bool AnyIn(const Box3& box) const {
    const Vec3 extent = box.Extent();
    const double margin =
        std::min(kMarginM, 0.25 * std::min({extent.x, extent.y, extent.z}));
    bool found = false;
    tree_.ForOverlaps(Grown(box, -margin), [&](uint32_t) { found = true; });
    return found;
  }

 private:
  static constexpr double kBeforeM = 1e-3;
  static constexpr double kMarginM = 1e-4;

  static std::vector<Box3> BoxesOf(const SceneInfo& info,
                                   const BlockStorage& store,
                                   GrowingCharge& charge) {
    std::vector<Box3> boxes;
    ForEachFace(store, [&](FaceId, const Face& face) {
      if (Emits(info.materials[face.material.Index()])) {
        const Vec3 before = Normalize(AreaVector(face.vertices)) * kBeforeM;
        const Box3 box = BoundsOf(face.vertices);
        constexpr uint64_t kGrowth = 2;  // old boxes while the vector grows
        charge.GrowTo(BoxTree::BytesFor(boxes.size() + 1) +
                      kGrowth * sizeof(Box3) * boxes.size());
        boxes.push_back({box.low + before, box.high + before});
      }
    });
    return boxes;
  }

  GrowingCharge charge_;
  BoxTree tree_;
};

// Two solids with one box are taken for one. That does no harm, because only
// insides, which are dark, go by it (overlap.h).
uint32_t NumberOf(const ClosedSolid& solid) {
  const std::array<double, 6> box = {solid.bounds.low.x,
                                     solid.bounds.low.y,
                                     solid.bounds.low.z,
                                     solid.bounds.high.x,
                                     solid.bounds.high.y,
                                     solid.bounds.high.z};
  const uint64_t hash = HashBytes(std::as_bytes(std::span(box)));
  return std::max<uint32_t>(1, static_cast<uint32_t>(hash));
}

FaceFacts FactsOf(const Face& face) {
  return {static_cast<float>(SurfaceArea(face)),
          face.solid ? NumberOf(*face.solid) : 0};
}

// Cuts one face after another.
class FaceCutter {
 public:
  FaceCutter(const SceneInfo& info,
             const BspTree& tree,
             const std::vector<CellId>& cell_of_leaf,
             const Lamps& lamps,
             CellPatchSink& sink)
      : info_(&info),
        tree_(&tree),
        cell_of_leaf_(&cell_of_leaf),
        lamps_(&lamps),
        sink_(&sink) {}

  void Add(FaceId id, const Face& face) {
    const bool is_dark = face.solid && !lamps_->AnyIn(face.solid->bounds);
    front_is_enclosed_ = is_dark && face.solid->front_is_inside;
    back_is_enclosed_ = is_dark && !face.solid->front_is_inside;
    for (const Polygon& part : PlanarParts(face.vertices)) {
      AddPlanar(id, face, part);
    }
  }

 private:
  void AddPlanar(FaceId id, const Face& face, const Polygon& part) {
    const Vec3 normal = PlaneOf(part).normal;
    const auto fronts = ClipSide(*tree_, *cell_of_leaf_, part, normal);
    const auto backs = ClipSide(*tree_, *cell_of_leaf_, part, -normal);
    for (const FacePiece& piece : fronts) {
      AddFront(id, face, piece, SameIn(backs, piece));
    }
    for (const FacePiece& piece : backs) {
      if (!SameIn(fronts, piece)) {
        AddBack(id, face, piece);
      }
    }
  }

  static std::vector<PatchPiece> PatchesOf(const Polygon& polygon) {
    return CutLongOnes(CutIntoPatches(polygon));
  }

  // Whether the other side of the piece is a piece of the same cell.
  static bool SameIn(const std::vector<FacePiece>& others,
                     const FacePiece& piece) {
    return std::any_of(
        others.begin(), others.end(), [&piece](const FacePiece& other) {
          return other.cell == piece.cell && other.polygon == piece.polygon;
        });
  }

  [[nodiscard]] const Material& MaterialOf(const Face& face) const {
    return info_->materials[face.material.Index()];
  }

  void AddFront(FaceId id,
                const Face& face,
                const FacePiece& piece,
                bool both_sides) {
    const Material& material = MaterialOf(face);
    for (const PatchPiece& cut : PatchesOf(piece.polygon)) {
      Patch patch{cut.origin,
                  cut.u,
                  cut.v,
                  cut.shape,
                  face.material,
                  id,
                  Emits(material)};
      patch.is_enclosed = front_is_enclosed_;
      sink_->Add(piece.cell, patch);
      if (both_sides && material.sides == 2) {
        std::swap(patch.u, patch.v);
        patch.emits = false;
        patch.is_twin = true;
        patch.is_back = true;
        patch.is_enclosed = back_is_enclosed_;
        sink_->Add(piece.cell, patch);
      }
    }
  }

  void AddBack(FaceId id, const Face& face, const FacePiece& piece) {
    for (const PatchPiece& cut : PatchesOf(piece.polygon)) {
      Patch patch{cut.origin, cut.v, cut.u, cut.shape, face.material, id};
      patch.reflects = MaterialOf(face).sides == 2;
      patch.is_back = true;
      patch.is_enclosed = back_is_enclosed_;
      sink_->Add(piece.cell, patch);
    }
  }

  const SceneInfo* info_;
  const BspTree* tree_;
  const std::vector<CellId>* cell_of_leaf_;
  const Lamps* lamps_;
  CellPatchSink* sink_;
  // Whether the sides of the current face lie inside a solid without a lamp.
  bool front_is_enclosed_ = false;
  bool back_is_enclosed_ = false;
};

}  // namespace

TouchCounts WritePatches(const SceneInfo& info,
                         const BspTree& tree,
                         const std::vector<CellId>& cell_of_leaf,
                         MemoryBudget& budget,
                         BlockStorage& store,
                         std::vector<CellInfo>& cells) {
  CellPatchSink sink(cells.size(), budget, store);
  const Lamps lamps(info, store, budget);
  FaceCutter cutter(info, tree, cell_of_leaf, lamps, sink);
  std::vector<FaceFacts> faces;  // by FaceId
  GrowingCharge faces_charge(budget, "what is known of the faces");
  ForEachFace(store, [&](FaceId id, const Face& face) {
    cutter.Add(id, face);
    constexpr uint64_t kGrowth = 3;  // the old numbers while the vector grows
    faces_charge.GrowTo(kGrowth * sizeof(FaceFacts) * (id.Index() + 1));
    faces.resize(id.Index() + 1);  // they come in the order of their ids
    faces.back() = FactsOf(face);
  });
  TouchCounts counts;
  for (uint32_t i = 0; i < cells.size(); ++i) {
    constexpr std::string_view kWhat = "surfaces of a cell that touch";
    constexpr uint64_t kCopies = 3;  // patches, encoded in a growing vector
    const size_t patches = sink.Count(CellId(i));
    MemoryCharge charge(budget, SeparateOverlapsBytes(patches), kWhat);
    CellPatches content{cells[i].bounds, sink.Take(CellId(i))};
    const OverlapCounts overlaps =
        SeparateOverlaps(content.patches, faces, budget);
    counts.overlaps.dropped += overlaps.dropped;
    counts.overlaps.area_m2 += overlaps.area_m2;
    counts.overlaps.moved += overlaps.moved;
    charge.Reset();
    charge = MemoryCharge(
        budget, CutAlongContactsBytes(content.patches.size()), kWhat);
    GrowingCharge more(budget, kWhat);
    const ContactCounts contacts = CutAlongContacts(
        content.patches, [&more](uint64_t bytes) { more.GrowTo(bytes); });
    charge.Reset();
    more.GrowTo(kCopies * content.patches.size() * sizeof(Patch));
    counts.contacts.cut += contacts.cut;
    counts.contacts.covered_m2 += contacts.covered_m2;
    cells[i].patches = static_cast<uint32_t>(content.patches.size());
    for (const Patch& patch : content.patches) {
      cells[i].area_m2 += PatchArea(patch);
    }
    store.Put({BlockKind::kCellPatches, i}, EncodeCellPatches(content));
  }
  store.EraseAll(BlockKind::kScratch);
  return counts;
}

}  // namespace enfilade
