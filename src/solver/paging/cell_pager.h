// Pages in, under the memory budget, what a subproblem needs of its cells:
// geometry, blockers, element trees, deltas (what cells have sent last), source
// weights (bounds of what cells send), received light and links. All kinds
// share one cache (item_cache.h).

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "partition/partition.h"
#include "scene/scene_store.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/push_pull.h"
#include "solver/elements/received_light.h"
#include "solver/paging/item_cache.h"
#include "solver/paging/link_cache.h"
#include "solver/paging/next_use.h"
#include "solver/paging/pair_table.h"
#include "solver/refine/refine_source.h"
#include "solver/refine/source_weights.h"
#include "solver/transfer/cell_geometry.h"
#include "solver/transfer/shaft.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace enfilade {

// For one thread at a time. What CellPager returns is in use, valid and in
// memory as long as the pointer is held, which must not outlive the pager.
class CellPager {
 public:
  CellPager(BlockStorage& store,
            const SceneInfo& scene,
            const Partition& partition,
            TreeShape shape,
            const OcclusionDevice& device,
            MemoryBudget& budget);
  ~CellPager() = default;
  CellPager(const CellPager&) = delete;
  CellPager& operator=(const CellPager&) = delete;

  std::shared_ptr<const CellGeometry> Geometry(CellId cell);

  // What stands in a cell, for shafts and for rays. Cells between a receiver
  // and a source need nothing else.
  std::shared_ptr<const ShaftBlockers> ShaftBlockersOf(CellId cell);
  std::shared_ptr<const RayBlockers> RayBlockersOf(CellId cell);

  struct CellBlockers {
    std::shared_ptr<const ShaftBlockers> shafts;
    std::shared_ptr<const RayBlockers> rays;
  };

  // Returns both; reads the cell at most once.
  CellBlockers BlockersOf(CellId cell);

  // Whether the blockers of all these cells fit in memory at once, beside
  // everything that is pinned.
  [[nodiscard]] bool CanHoldBlockers(const std::vector<CellId>& cells) const;

  // As CellMaker::BoundsOf.
  [[nodiscard]] Box BoundsOf(CellId cell) const {
    return maker_.BoundsOf(cell);
  }

  // As CellMaker::BoxOf.
  [[nodiscard]] Box BoxOf(CellId cell, const CellPart& part) const {
    return maker_.BoxOf(cell, part);
  }

  // The stored tree, or a new tree whose sent radiosity is the emitted one.
  std::shared_ptr<CellTree> Tree(CellId cell);

  // The tree if it is in memory, otherwise its elements alone, which suffice to
  // gather from them. The cell must have a tree, in memory or in the store.
  std::shared_ptr<const CellTree> Elements(CellId cell);

  // Bounds of what the cell sends, as it was last balanced. Refinement of the
  // cell's pairs uses these weights before it needs the tree.
  std::shared_ptr<const SourceWeights> Weights(CellId cell);

  // The cell will be balanced: its weights, which must not be in use, say no
  // longer what it sends. Until RenewWeights they are made of the tree as it
  // is.
  void ForgetWeights(CellId cell);

  // Makes the weights anew after the cell was balanced. Its tree is in use.
  void RenewWeights(CellId cell);

  // The tree was changed and may have grown: the pager will write it back.
  void MarkDirty(CellId cell);

  // What the cell has sent last, with no elements if it has sent nothing. If
  // the tree has grown, the delta must be asked for again, as with Received.
  std::shared_ptr<CoefficientArray> Delta(CellId cell);

  // The delta was changed: the pager will write it back.
  void MarkDeltaDirty(CellId cell);

  // Erases the delta: the cell has sent nothing. The delta must not be in use.
  void ForgetDelta(CellId cell);

  // What the elements of the tree have received, for the cell's turn. If the
  // tree has grown as another cell's source, the received light must be asked
  // for again.
  std::shared_ptr<ReceivedLight> Received(CellId cell);

  // The received light was changed: the pager will write it back.
  void MarkReceivedDirty(CellId cell);

  // The receiver's turn begins, as in NextUse.
  void StartTurn(CellId receiver, std::span<const VisibleCell> sources) {
    items_.StartTurn();
    order_.StartTurn(receiver, sources);
  }

  // Which cells see each other and have links.
  PairTable& Pairs() { return pairs_; }

  // The place of the work in its order: what comes next decides what is
  // evicted.
  NextUse& Order() { return order_; }

  // All that is in memory, and room for what else is needed there.
  ItemCache& Items() { return items_; }

  LinkCache& Links() { return links_; }

 private:
  // The patches of a cell, with the bytes that were read.
  struct ReadCell {
    CellPatches patches;
    uint64_t bytes = 0;
  };

  ReadCell ReadPatches(CellId cell);
  void MakeShaftBlockers(CellId cell, const ReadCell& read);
  void MakeRayBlockers(CellId cell, const ReadCell& read);

  template <typename T, typename Bytes, typename Read>
  std::shared_ptr<T> UseStored(const ItemKey& key,
                               std::string_view what,
                               const Bytes& bytes,
                               const Read& read);
  template <typename T>
  void MarkItemDirty(const ItemKey& key, std::string_view what);
  // The element count of the cell's stored tree, read once and not at each read
  // of the tree.
  size_t StoredElements(CellId cell);
  // As ItemCache::Save.
  uint64_t Save(const ItemKey& key, const void* value);

  BlockStorage* store_;
  const Partition* partition_;
  std::vector<uint32_t> stored_elements_;  // per cell; 0: none or unknown
  SurfaceTable surfaces_;
  TreeShape shape_;
  const OcclusionDevice* device_;
  MemoryBudget* budget_;
  CellMaker maker_;
  PairTable pairs_;
  NextUse order_;
  ItemCache items_;
  LinkCache links_;
};

}  // namespace enfilade
