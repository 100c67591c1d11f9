// The link blocks of cell pairs in the store: written chunk by chunk while a
// pair is refined, read again while it is gathered.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "solver/links/link_block.h"

#include <cstdint>
#include <functional>
#include <optional>

namespace enfilade {

struct CellPair {
  CellId receiver;
  CellId source;
};

// A chunk of a pair that was written, and what it takes in the store.
struct WrittenLinks {
  uint32_t chunk = 0;
  LinkBlock block;  // sorted, its coefficients as they will be read
  uint64_t stored_bytes = 0;
};

// Chunks of a pair, from 0 without gaps.
class LinkWriter {
 public:
  // Goes on after `first_chunk` chunks, or from 0 forgets the pair's old ones.
  // `on_chunk` gets every chunk, sorted, as soon as it is written.
  LinkWriter(BlockStorage& store,
             CellPair pair,
             uint32_t first_chunk,
             std::function<void(WrittenLinks&&)> on_chunk);

  // Room for more links; write them, then call Flush when Full.
  LinkBlock& Pending() { return pending_; }

  [[nodiscard]] bool Full() const;
  void Flush();

  [[nodiscard]] uint32_t Chunks() const { return chunks_; }

 private:
  BlockStorage* store_;
  CellPair pair_;
  std::function<void(WrittenLinks&&)> on_chunk_;
  LinkBlock pending_;
  uint32_t chunks_ = 0;
};

// Nothing if the pair has no such chunk.
std::optional<LinkBlock> ReadLinks(const BlockStorage& store,
                                   CellPair pair,
                                   uint32_t chunk,
                                   const LinkEnds& ends);

}  // namespace enfilade
