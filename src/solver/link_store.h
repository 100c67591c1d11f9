// The link blocks of cell pairs in the store: written chunk by chunk while a
// pair is refined, streamed while it is gathered.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "solver/access_trace.h"
#include "solver/link_block.h"

#include <cstdint>
#include <functional>

namespace enfilade {

struct CellPair {
  CellId receiver;
  CellId source;
};

// Chunks of a pair, from 0 without gaps.
class LinkWriter {
 public:
  // Goes on after `first_chunk` chunks, or from 0 forgets the pair's old ones.
  // `on_chunk` sees every chunk, sorted, as it is written.
  LinkWriter(BlockStorage& store,
             CellPair pair,
             uint32_t first_chunk,
             AccessTrace& trace,
             std::function<void(const LinkBlock&)> on_chunk);

  // Room for more links; write them, then call Flush when Full.
  LinkBlock& Pending() { return pending_; }

  [[nodiscard]] bool Full() const;
  void Flush();

  [[nodiscard]] uint32_t Chunks() const { return chunks_; }

 private:
  BlockStorage* store_;
  CellPair pair_;
  AccessTrace* trace_;
  std::function<void(const LinkBlock&)> on_chunk_;
  LinkBlock pending_;
  uint32_t chunks_ = 0;
};

// Visits the chunks of a pair in order.
void ForEachLinkBlock(const BlockStorage& store,
                      CellPair pair,
                      const LinkEnds& ends,
                      AccessTrace& trace,
                      const std::function<void(LinkBlock&&)>& visit);

// The chunks of a pair that is gathered again and again: kept decoded while
// the budget has room, streamed otherwise. The same chunks in the same order
// either way.
class LinkCache {
 public:
  LinkCache(const BlockStorage& store,
            MemoryBudget& budget,
            CellPair pair,
            AccessTrace& trace)
      : store_(&store), budget_(&budget), pair_(pair), trace_(&trace) {}

  void ForEach(const LinkEnds& ends,
               const std::function<void(const LinkBlock&)>& visit);

 private:
  const BlockStorage* store_;
  MemoryBudget* budget_;
  CellPair pair_;
  AccessTrace* trace_;
  bool complete_ = false;  // all chunks are kept
  std::vector<LinkBlock> kept_;
  std::vector<MemoryCharge> charges_;
};

}  // namespace enfilade
