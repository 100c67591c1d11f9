// Links of cell pairs: read from the store chunk by chunk, and kept in memory
// where there is room for them.

#pragma once

#include "base/block_storage.h"
#include "solver/links/link_block.h"
#include "solver/links/link_store.h"
#include "solver/paging/item_cache.h"

#include <functional>

namespace enfilade {

// For one thread at a time. Store and items must outlive the cache.
class LinkCache {
 public:
  LinkCache(const BlockStorage& store, ItemCache& items)
      : store_(&store), items_(&items) {}

  // Visits the chunks of a pair in order. Keeps chunks in memory in preference
  // to things that are needed later. `visit` must not use the items.
  void Visit(CellPair pair,
             const LinkEnds& ends,
             const std::function<void(const LinkBlock&)>& visit);

  // A chunk was written; keeps it in memory if it is needed soon.
  void Keep(LinkChunk&& written);

  // Drops all links from memory, because they will be made anew.
  void Forget() { items_->ForgetAllLinks(); }

 private:
  void KeepIfPossible(const ItemKey& key,
                      LinkBlock&& block,
                      const ItemCache::Bytes& bytes);

  const BlockStorage* store_;
  ItemCache* items_;
};

}  // namespace enfilade
