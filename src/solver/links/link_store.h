// The link blocks of cell pairs in the store: written chunk by chunk while a
// pair is refined, and read back while the pair is gathered.

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

// One chunk of a pair's links.
struct LinkChunk {
  CellPair pair;
  uint32_t chunk = 0;
  LinkBlock block;            // sorted, its coefficients as they will be read
  uint64_t stored_bytes = 0;  // what the chunk takes in the store, once written
};

// Writes chunks in the background, one at a time: one thread encodes and
// compresses the chunk while the others go on.
class ChunkWriter {
 public:
  // Finish passes every chunk to `on_written` once the chunk is in the store,
  // on the thread that calls Finish.
  ChunkWriter(BlockStorage& store, std::function<void(LinkChunk&&)> on_written)
      : store_(&store), on_written_(std::move(on_written)) {}

  // Begins to write a chunk; no other chunk may be under way. The returned
  // block may be read until Finish.
  const LinkBlock& Start(LinkChunk&& chunk);

  // Waits for the chunk that is under way, if any; throws what writing it
  // threw.
  void Finish();

 private:
  BlockStorage* store_;
  std::function<void(LinkChunk&&)> on_written_;
  std::optional<LinkChunk> chunk_;  // under way
  CallBeside writing_;
};

// Writes the chunks of a pair, numbered from 0 without gaps.
class LinkWriter {
 public:
  // Continues after the pair's first `first_chunk` chunks; if `first_chunk` is
  // 0, erases the pair's old chunks. `on_chunk` gets every chunk as soon as its
  // writing has begun.
  LinkWriter(BlockStorage& store,
             ChunkWriter& chunks,
             CellPair pair,
             uint32_t first_chunk,
             std::function<void(const LinkBlock&)> on_chunk);

  // The buffer for further links: append links, then call Flush if Full.
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

// Returns nullopt if the pair has no such chunk.
std::optional<LinkBlock> ReadLinks(const BlockStorage& store,
                                   CellPair pair,
                                   uint32_t chunk,
                                   const LinkEnds& ends);

}  // namespace enfilade
