#include "solver/link_store.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

// Links per chunk: at 4 to 36 bytes each, up to half a megabyte. A chunk on its
// way to the store is there five times over: links, sorted, encoded, compressed
// and in SQLite's hands (docs/decisions/least-memory.md).
constexpr size_t kChunkLinks = size_t{16} * 1024;

BlockKey ChunkKey(CellPair pair, uint32_t chunk) {
  return {BlockKind::kLinks, pair.receiver.value, pair.source.value, chunk};
}

// Reads a chunk; nothing if there is none. Notes that it was used.
std::optional<LinkBlock> ReadChunk(const BlockStorage& store,
                                   const BlockKey& key,
                                   const LinkEnds& ends,
                                   AccessTrace& trace) {
  const uint64_t read_before = store.Stats().bytes_read;
  const auto bytes = store.Get(key);
  if (!bytes) {
    return std::nullopt;
  }
  const uint64_t read = store.Stats().bytes_read - read_before;
  LinkBlock block = DecodeLinks(*bytes, ends);
  trace.AddRead(read);
  trace.SetStored({key}, read);
  trace.SetHeld({key}, block.SizeBytes());
  trace.Touch({key});
  return block;
}

}  // namespace

LinkWriter::LinkWriter(BlockStorage& store,
                       CellPair pair,
                       uint32_t first_chunk,
                       AccessTrace& trace,
                       std::function<void(const LinkBlock&)> on_chunk)
    : store_(&store),
      pair_(pair),
      trace_(&trace),
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
  // A group of receivers may have brought far more than one chunk.
  for (size_t first = 0; first < pending_.links.size(); first += kChunkLinks) {
    const size_t last = std::min(first + kChunkLinks, pending_.links.size());
    LinkBlock chunk;
    chunk.links.reserve(last - first);
    for (size_t i = first; i < last; ++i) {
      chunk.AppendFrom(pending_, i);
    }
    on_chunk_(chunk);
    const BlockKey key = ChunkKey(pair_, chunks_++);
    store_->Put(key, EncodeLinks(chunk));
    trace_->Forget({key});
  }
  pending_.links.clear();
  pending_.near.clear();
  pending_.group.clear();
}

void ForEachLinkBlock(const BlockStorage& store,
                      CellPair pair,
                      const LinkEnds& ends,
                      AccessTrace& trace,
                      const std::function<void(LinkBlock&&)>& visit) {
  for (uint32_t chunk = 0;; ++chunk) {
    auto block = ReadChunk(store, ChunkKey(pair, chunk), ends, trace);
    if (!block) {
      return;
    }
    visit(std::move(*block));
  }
}

void LinkCache::ForEach(const LinkEnds& ends,
                        const std::function<void(const LinkBlock&)>& visit) {
  for (size_t chunk = 0; chunk < kept_.size(); ++chunk) {
    trace_->Touch({ChunkKey(pair_, static_cast<uint32_t>(chunk))});
    visit(kept_[chunk]);
  }
  for (auto chunk = static_cast<uint32_t>(kept_.size()); !complete_; ++chunk) {
    auto block = ReadChunk(*store_, ChunkKey(pair_, chunk), ends, *trace_);
    if (!block) {
      complete_ = kept_.size() == chunk;
      return;
    }
    visit(*block);
    // A third of the free budget stays free for others, and some of it in any
    // case.
    const uint64_t size = block->SizeBytes();
    if (kept_.size() == chunk && size < budget_->FreeBytes() * 2 / 3 &&
        budget_->FreeBytes() > budget_->LimitBytes() / 3 &&
        budget_->ResidentExcess() == 0) {
      charges_.emplace_back(*budget_, size, "links kept in memory");
      kept_.push_back(std::move(*block));
    }
  }
}

}  // namespace enfilade
