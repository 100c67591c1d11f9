#include "solver/paging/link_cache.h"

#include <cstdint>
#include <memory>
#include <utility>

namespace enfilade {
namespace {

ItemKey KeyOf(CellPair pair, uint32_t chunk) {
  const bool is_itself = pair.receiver == pair.source;
  return {ItemKind::kLinks,
          pair.receiver.value,
          is_itself ? NextUse::kItself : pair.source.value,
          chunk};
}

ItemCache::Bytes BytesOf(const LinkBlock& block, uint64_t stored) {
  constexpr uint64_t kItemBytes = 256;  // what an item takes beside its value
  const uint64_t bytes = block.SizeBytes() + kItemBytes;
  return {bytes, bytes, stored};
}

}  // namespace

void LinkCache::Visit(CellPair pair,
                      const LinkEnds& ends,
                      const std::function<void(const LinkBlock&)>& visit) {
  for (uint32_t chunk = 0;; ++chunk) {
    const ItemKey key = KeyOf(pair, chunk);
    if (const auto* block = items_->UseBriefly<LinkBlock>(key)) {
      visit(*block);
      continue;
    }
    items_->HoldResident();
    const uint64_t read_before = store_->Stats().bytes_read;
    auto block = ReadLinks(*store_, pair, chunk, ends);
    if (!block) {
      return;
    }
    const uint64_t read = store_->Stats().bytes_read - read_before;
    items_->Trace().AddRead(read);
    const ItemCache::Bytes bytes = BytesOf(*block, read);
    items_->NoteUse(key, bytes);
    visit(*block);
    KeepIfPossible(key, std::move(*block), bytes);
  }
}

void LinkCache::Keep(LinkChunk&& written) {
  const ItemKey key = KeyOf(written.pair, written.chunk);
  const ItemCache::Bytes bytes = BytesOf(written.block, written.stored_bytes);
  items_->NoteMade(key, bytes);
  KeepIfPossible(key, std::move(written.block), bytes);
}

void LinkCache::KeepIfPossible(const ItemKey& key,
                               LinkBlock&& block,
                               const ItemCache::Bytes& bytes) {
  items_->InsertIfPossible(
      key, std::make_shared<LinkBlock>(std::move(block)), bytes);
}

}  // namespace enfilade
