#include "partition/scratch_list.h"

#include "base/check.h"

#include <algorithm>
#include <utility>

namespace enfilade {
namespace {

// Large for a block of the store, but small for the memory of a few dozen
// lists.
constexpr uint64_t kChunkBytes = 64ULL << 10;
constexpr uint64_t kLeastRoomBytes = 256;
// The lists get one in kParts of the free budget, because the tree grows beside
// them.
constexpr uint64_t kParts = 4;

}  // namespace

ScratchShelf::ScratchShelf(BlockStorage& store,
                           MemoryBudget& budget,
                           std::string_view what)
    : store_(&store),
      most_bytes_(budget.FreeBytes() / kParts),
      charge_(budget, what) {}

void ScratchShelf::Hold(uint64_t bytes) {
  charge_.GrowTo(held_bytes_ + bytes);
  held_bytes_ += bytes;
}

void ScratchShelf::LetGo(uint64_t bytes) {
  held_bytes_ -= bytes;
  charge_.ShrinkTo(held_bytes_);
}

void ScratchShelf::Clear() {
  ENFILADE_CHECK(held_bytes_ == 0, "{} bytes of lists", held_bytes_);
  store_->EraseAll(BlockKind::kScratch);
}

ScratchList::ScratchList(ScratchShelf& shelf)
    : shelf_(&shelf), number_(shelf.lists_++) {}

ScratchList::ScratchList(ScratchList&& other) noexcept
    : shelf_(other.shelf_),
      number_(other.number_),
      chunks_(std::exchange(other.chunks_, {})),
      end_(std::exchange(other.end_, {})),
      held_bytes_(std::exchange(other.held_bytes_, 0)),
      end_room_(std::exchange(other.end_room_, 0)) {}

ScratchList::~ScratchList() {
  shelf_->LetGo(held_bytes_);
}

ByteWriter& ScratchList::Append(uint64_t most_bytes) {
  if (end_.Size() + most_bytes > kChunkBytes && end_.Size() > 0) {
    EndChunk();
  }
  if (end_.Size() + most_bytes > end_room_) {
    const uint64_t room = std::max({end_.Size() + most_bytes,
                                    std::min(2 * end_room_, kChunkBytes),
                                    kLeastRoomBytes});
    shelf_->Hold(room - end_room_);
    held_bytes_ += room - end_room_;
    end_room_ = room;
    end_.Reserve(room);
  }
  return end_;
}

void ScratchList::EndChunk() {
  if (shelf_->held_bytes_ > shelf_->most_bytes_) {
    shelf_->store_->Put(KeyOf(chunks_.size()), end_.View());
    chunks_.emplace_back();
    end_.Clear();
    return;
  }
  chunks_.push_back(end_.Take());
  end_ = {};
  end_room_ = 0;
}

BlockKey ScratchList::KeyOf(size_t chunk) const {
  return {BlockKind::kScratch, number_, static_cast<uint32_t>(chunk)};
}

void ScratchList::VisitChunk(size_t chunk, const Visitor& visit) const {
  Bytes stored;
  const Bytes* bytes = &end_.View();
  if (chunk < chunks_.size()) {
    bytes = &chunks_[chunk];
    if (bytes->empty()) {
      stored = shelf_->store_->GetOrThrow(KeyOf(chunk));
      bytes = &stored;
    }
  }
  ByteReader in(*bytes);
  while (!in.AtEnd()) {
    visit(in);
  }
}

void ScratchList::Visit(const Visitor& visit) const {
  for (size_t chunk = 0; chunk <= chunks_.size(); ++chunk) {
    VisitChunk(chunk, visit);
  }
}

void ScratchList::Consume(const Visitor& visit) {
  for (size_t chunk = 0; chunk < chunks_.size(); ++chunk) {
    VisitChunk(chunk, visit);
    const uint64_t bytes = chunks_[chunk].capacity();
    if (bytes == 0) {
      shelf_->store_->Erase(KeyOf(chunk));
    }
    FreeVector(&chunks_[chunk]);
    shelf_->LetGo(bytes);
    held_bytes_ -= bytes;
  }
  VisitChunk(chunks_.size(), visit);
  ScratchList emptied(std::move(*this));
}

}  // namespace enfilade
