// Pages in, under the memory budget, what a subproblem needs of its cells:
// geometry, blockers, element trees, deltas (what cells have sent last), source
// weights (bounds of what cells send), received light and links. All kinds
// share one pool. The item that is not in use and needed last is evicted first;
// dirty items are written back on eviction.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "partition/partition.h"
#include "scene/scene_store.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/push_pull.h"
#include "solver/elements/received_light.h"
#include "solver/links/link_block.h"
#include "solver/links/link_store.h"
#include "solver/paging/access_trace.h"
#include "solver/paging/next_use.h"
#include "solver/refine/refine_side.h"
#include "solver/refine/source_weights.h"
#include "solver/transfer/cell_geometry.h"
#include "solver/transfer/shaft.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <span>
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
  ~CellPager();
  CellPager(const CellPager&) = delete;
  CellPager& operator=(const CellPager&) = delete;

  std::shared_ptr<const CellGeometry> Geometry(CellId cell);

  // What stands in a cell, for shafts and for rays. Cells between a receiver
  // and a source need nothing else.
  std::shared_ptr<const ShaftBlockers> Obstacles(CellId cell);
  std::shared_ptr<const CellBlockers> Occluder(CellId cell);

  struct CellObstructions {
    std::shared_ptr<const ShaftBlockers> obstacles;
    std::shared_ptr<const CellBlockers> occluder;
  };

  // Returns both; reads the cell at most once.
  CellObstructions Obstructions(CellId cell);

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

  // The cell will be balanced. Nobody may ask for its weights until
  // RenewWeights. The weights must not be in use.
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

  // Writes all dirty items to the store.
  void Flush();

  // Evicts all unpinned items; the trace begins anew as well.
  void EvictAll();

  // Evicts unpinned items until `bytes` can be charged, and charges them.
  // Throws DoesNotFitError, naming the least cap, if that is impossible.
  void MakeRoom(uint64_t bytes, std::string_view what);

  // Like MakeRoom, for working memory that the caller holds for a while.
  MemoryCharge Reserve(uint64_t bytes, std::string_view what);

  // Like Reserve, but charges nothing if there is no room: for memory that is
  // held for a moment and that FindLeastMemory does not count.
  MemoryCharge ReserveIfPossible(uint64_t bytes, std::string_view what);

  // The receiver's turn begins, as in NextUse. What eviction could not achieve
  // in the last turn is tried again.
  void StartTurn(CellId receiver, std::span<const VisibleCell> sources) {
    accepted_excess_ = 0;
    is_full_ = false;
    next_use_.StartTurn(receiver, sources);
  }

  // Evicts while the memory of the process itself comes near the cap, whatever
  // was charged. To be called between steps of work that allocates memory.
  void HoldResident(uint64_t coming_bytes = 0);

  // Visits the chunks of a pair in order. Keeps chunks in memory in preference
  // to things that are needed later. `visit` must not use the pager.
  void VisitLinks(CellPair pair,
                  const LinkEnds& ends,
                  const std::function<void(const LinkBlock&)>& visit);

  // A chunk was written; keeps it in memory if it is needed soon.
  void KeepLinks(LinkChunk&& written);

  // Drops all links from memory, because they will be made anew.
  void ForgetLinks();

  // The place of the work in its order: what comes next decides what is
  // evicted.
  NextUse& Order() { return next_use_; }

  // The record of what was asked for; other readers of the store may add to it.
  AccessTrace& Trace() { return trace_; }

 private:
  enum class ItemKind : uint8_t {
    kGeometry,
    kObstacles,
    kOccluder,
    kTree,
    kElements,
    kDelta,
    kReceived,
    kWeights,
    kLinks  // last
  };

  struct ItemKey {
    ItemKind kind{};
    uint32_t cell = 0;
    uint32_t source = 0;  // for links; kItself if equal to the cell
    uint32_t chunk = 0;

    // NOLINTNEXTLINE(modernize-use-nullptr): see base/ids.h
    friend auto operator<=>(const ItemKey&, const ItemKey&) = default;
  };

  struct Item {
    std::shared_ptr<void> value;
    std::weak_ptr<void> use;     // what callers hold, if any do
    uint64_t held_bytes = 0;     // size of the value
    uint64_t charged_bytes = 0;  // to the budget, by the pager
    uint64_t last_use = 0;
    bool dirty = false;
  };

  CellPatches ReadPatches(CellId cell, std::initializer_list<ItemKind> made);
  void MakeObstacles(CellId cell, const CellPatches& stored);
  void MakeOccluder(CellId cell, const CellPatches& stored);
  static CellId SourceOf(ItemKey key);
  static CachedThing ThingOf(ItemKey key);
  Item* Find(ItemKey key);
  void Insert(ItemKey key, std::shared_ptr<void> value, uint64_t bytes);
  void SetHeld(ItemKey key, Item* item, uint64_t bytes);

  std::shared_ptr<void> UseItem(ItemKey key, Item* item, bool is_along);

  template <typename T>
  std::shared_ptr<T> Use(ItemKey key, Item* item, bool is_along) {
    return std::static_pointer_cast<T>(UseItem(key, item, is_along));
  }

  template <typename T>
  std::shared_ptr<T> Use(ItemKey key, bool is_along = false) {
    return Use<T>(key, &items_.at(key), is_along);
  }

  template <typename T, typename Bytes, typename Read>
  std::shared_ptr<T> UseStored(ItemKey key,
                               std::string_view what,
                               const Bytes& bytes,
                               const Read& read);
  // `what` names the item to the budget.
  template <typename T>
  void MarkItemDirty(ItemKey key, std::string_view what);
  // Drops an item without writing it back. The item must not be in use.
  void Forget(ItemKey key);
  void NoteCapacity();
  using Items = std::map<ItemKey, Item>;

  // The item that is needed last and not in use, with the time of its next use.
  // Among items with the same next use, the least recently used one is the
  // victim.
  struct Victim {
    Items::iterator item;
    bool exists = false;
    std::pair<uint64_t, uint64_t> rank;
  };

  static bool GoesLater(const Victim& a, const Victim& b) {
    return std::pair(a.exists, a.rank) < std::pair(b.exists, b.rank);
  }

  static ItemKey LinksKey(CellPair pair, uint32_t chunk);
  [[nodiscard]] uint64_t NextUseOf(ItemKey key) const;
  [[nodiscard]] Victim AsVictim(Items::iterator item) const;
  std::vector<Victim> FindVictims();
  [[nodiscard]] bool CanFree(uint64_t bytes) const;
  Items::iterator LastLinks();
  bool TryMakeRoom(uint64_t bytes, uint64_t needed_at);
  void KeepBlock(ItemKey key, LinkBlock&& block);
  // Returns false if nothing is left to evict.
  bool EvictUntil(const std::function<bool()>& is_enough);
  // The same for items that are needed at `first_use` or later.
  bool EvictNeededFrom(uint64_t first_use,
                       const std::function<bool()>& is_enough);
  [[nodiscard]] uint64_t EvictionMargin() const;
  void Drop(Items::iterator item);
  // The element count of the cell's stored tree, read once and not at each read
  // of the tree.
  size_t StoredElements(CellId cell);
  // Writes an item to the store and returns the bytes that it takes there. May
  // be called from any thread.
  uint64_t Save(ItemKey key, const Item& item) const;
  void NoteSaved(ItemKey key, Item* item, uint64_t stored_bytes);
  void Recharge(ItemKey key, uint64_t bytes, std::string_view what);

  BlockStorage* store_;
  const Partition* partition_;
  std::vector<uint32_t> stored_elements_;  // per cell; 0: none or unknown
  SurfaceTable surfaces_;
  TreeShape shape_;
  const OcclusionDevice* device_;
  MemoryBudget* budget_;
  CellMaker maker_;
  MemoryCharge trace_charge_;
  AccessTrace trace_;
  NextUse next_use_;
  Items items_;
  uint64_t held_bytes_ = 0;  // by all items
  uint64_t clock_ = 0;
  // Bytes of excess for which nothing could be evicted this turn; not tried
  // again before the next.
  uint64_t accepted_excess_ = 0;
  // Whether links found no room this turn.
  bool is_full_ = false;
};

}  // namespace enfilade
