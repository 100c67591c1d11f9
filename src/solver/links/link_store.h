// The link blocks of cell pairs in the store: written chunk by chunk while a
// pair is refined, read again while it is gathered.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/parallel.h"
#include "solver/links/link_block.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

namespace enfilade {

struct CellPair {
  CellId receiver;
  CellId source;
};

// A chunk of a pair.
struct LinkChunk {
  CellPair pair;
  uint32_t chunk = 0;
  LinkBlock block;            // sorted, its coefficients as they will be read
  uint64_t stored_bytes = 0;  // once it is written: what it takes in the store
};

// Writes chunks behind the work, one at a time: to encode and to compress them
// is for one thread, and the others need not wait for it.
class ChunkWriter {
 public:
  // `on_written` gets every chunk when it is in the store, on the thread that
  // calls this.
  ChunkWriter(BlockStorage& store, std::function<void(LinkChunk&&)> on_written)
      : store_(&store), on_written_(std::move(on_written)) {}

  // Begins to write a chunk; none may be under way. The block may be read until
  // Finish.
  const LinkBlock& Start(LinkChunk&& chunk);

  // Waits for the chunk that is under way, if there is one; throws what its
  // writing threw.
  void Finish();

 private:
  BlockStorage* store_;
  std::function<void(LinkChunk&&)> on_written_;
  std::optional<LinkChunk> chunk_;  // under way
  CallBeside writing_;
};

// Chunks of a pair, from 0 without gaps.
class LinkWriter {
 public:
  // Goes on after `first_chunk` chunks, or from 0 forgets the pair's old ones.
  // `on_chunk` gets every chunk as soon as it is on its way to the store.
  LinkWriter(BlockStorage& store,
             ChunkWriter& chunks,
             CellPair pair,
             uint32_t first_chunk,
             std::function<void(const LinkBlock&)> on_chunk);

  // Room for more links; write them, then call Flush when Full.
  LinkBlock& Pending() { return pending_; }

  [[nodiscard]] bool Full() const;
  void Flush();

  [[nodiscard]] uint32_t Chunks() const { return chunks_; }

 private:
  ChunkWriter* writer_;
  CellPair pair_;
  std::function<void(const LinkBlock&)> on_chunk_;
  LinkBlock pending_;
  uint32_t chunks_ = 0;
};

// Nothing if the pair has no such chunk.
std::optional<LinkBlock> ReadLinks(const BlockStorage& store,
                                   CellPair pair,
                                   uint32_t chunk,
                                   const LinkEnds& ends);

}  // namespace enfilade
