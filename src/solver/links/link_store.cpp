#include "solver/links/link_store.h"

#include "base/check.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace enfilade {
namespace {

// Links of a full chunk: at 4 to 14 bytes each, up to a quarter of a megabyte.
// A chunk that is being written is in memory five times: as links, sorted,
// encoded, compressed and in SQLite's hands (docs/decisions/least-memory.md).
constexpr size_t kChunkLinks = size_t{16} * 1024;
// Links of the largest chunk: the part of refinement that fills a chunk may
// bring more than fit.
constexpr size_t kMostChunkLinks = kChunkLinks * 3 / 2;

BlockKey ChunkKey(CellPair pair, uint32_t chunk) {
  return {BlockKind::kLinks, pair.receiver.value, pair.source.value, chunk};
}

}  // namespace

const LinkBlock& ChunkWriter::Start(LinkChunk&& chunk) {
  ENFILADE_CHECK(!chunk_, "two chunks of links are written at once");
  chunk_ = std::move(chunk);
  writing_.Start([this] {
    chunk_->stored_bytes = store_->Put(ChunkKey(chunk_->pair, chunk_->chunk),
                                       EncodeLinks(chunk_->block));
  });
  return chunk_->block;
}

void ChunkWriter::Finish() {
  if (!chunk_) {
    return;
  }
  try {
    writing_.Wait();
  } catch (...) {
    chunk_.reset();  // it was not written
    throw;
  }
  on_written_(std::move(*chunk_));
  chunk_.reset();
}

LinkWriter::LinkWriter(BlockStorage& store,
                       ChunkWriter& chunks,
                       CellPair pair,
                       uint32_t first_chunk,
                       std::function<void(const LinkBlock&)> on_chunk)
    : writer_(&chunks),
      pair_(pair),
      on_chunk_(std::move(on_chunk)),
      chunks_(first_chunk) {
  if (first_chunk == 0) {
    store.EraseAll(BlockKind::kLinks, pair.receiver.value, pair.source.value);
  }
}

bool LinkWriter::Full() const {
  return pending_.links.size() >= kChunkLinks;
}

void LinkWriter::Flush() {
  if (pending_.links.empty()) {
    return;
  }
  SortLinks(&pending_);
  const size_t links = pending_.links.size();
  const size_t chunks = (links + kMostChunkLinks - 1) / kMostChunkLinks;
  for (size_t i = 0; i < chunks; ++i) {
    writer_->Finish();  // only one chunk may be under way
    const size_t first = links * i / chunks;
    const size_t last = links * (i + 1) / chunks;
    LinkBlock chunk;
    chunk.links.reserve(last - first);
    for (size_t k = first; k < last; ++k) {
      chunk.AppendFrom(pending_, k);
    }
    chunk.shapes.shrink_to_fit();
    chunk.group.shrink_to_fit();
    on_chunk_(writer_->Start({pair_, chunks_++, std::move(chunk)}));
  }
  pending_.links.clear();
  pending_.shapes.clear();
  pending_.group.clear();
}

std::optional<LinkBlock> ReadLinks(const BlockStorage& store,
                                   CellPair pair,
                                   uint32_t chunk,
                                   const LinkEnds& ends) {
  return ReadBlockIfAny(store, ChunkKey(pair, chunk), [&](ByteReader& in) {
    return DecodeLinks(in.TakeRest(), ends);
  });
}

}  // namespace enfilade
