#include "partition/wall_fragments.h"

#include "base/check.h"

#include <algorithm>
#include <utility>

namespace enfilade {
namespace {

// Large for the store, small beside what a few dozen lists may take.
constexpr uint64_t kChunkBytes = 64ULL << 10;
constexpr uint64_t kLeastRoomBytes = 256;
// Of what is free, for the lists: the tree grows beside them.
constexpr uint64_t kParts = 4;

uint64_t EncodedBytes(const WallFragment& fragment) {
  constexpr uint64_t kMostCountBytes = 10;
  return sizeof(uint32_t) + sizeof(Plane) + kMostCountBytes +
         fragment.polygon.size() * sizeof(Point3);
}

void Encode(const WallFragment& fragment, ByteWriter& out) {
  out.Put(fragment.plane_group);
  out.Put(fragment.plane);
  out.PutArray(std::span<const Point3>(fragment.polygon));
}

// Into one that there is, so that its polygon's memory is used again.
void Decode(ByteReader& in, WallFragment& fragment) {
  fragment.plane_group = in.Get<uint32_t>();
  fragment.plane = in.Get<Plane>();
  fragment.polygon.clear();
  for (uint64_t left = in.GetVarint(); left > 0; --left) {
    fragment.polygon.push_back(in.Get<Point3>());
  }
}

}  // namespace

FragmentShelf::FragmentShelf(BlockStorage& store, MemoryBudget& budget)
    : store_(&store),
      most_bytes_(budget.FreeBytes() / kParts),
      charge_(budget, "the walls while cells are found") {}

void FragmentShelf::Hold(uint64_t bytes) {
  charge_.GrowTo(held_bytes_ + bytes);
  held_bytes_ += bytes;
}

void FragmentShelf::LetGo(uint64_t bytes) {
  held_bytes_ -= bytes;
  charge_.ShrinkTo(held_bytes_);
}

void FragmentShelf::Clear() {
  ENFILADE_CHECK(held_bytes_ == 0, "{} bytes of lists", held_bytes_);
  store_->EraseAll(BlockKind::kScratch);
}

FragmentList::FragmentList(FragmentShelf& shelf)
    : shelf_(&shelf), number_(shelf.lists_++) {}

FragmentList::FragmentList(FragmentList&& other) noexcept
    : shelf_(other.shelf_),
      number_(other.number_),
      size_(std::exchange(other.size_, 0)),
      chunks_(std::exchange(other.chunks_, {})),
      end_(std::exchange(other.end_, {})),
      held_bytes_(std::exchange(other.held_bytes_, 0)),
      end_room_(std::exchange(other.end_room_, 0)) {}

FragmentList::~FragmentList() {
  shelf_->LetGo(held_bytes_);
}

void FragmentList::Add(const WallFragment& fragment) {
  MakeRoom(EncodedBytes(fragment));
  Encode(fragment, end_);
  ++size_;
}

void FragmentList::MakeRoom(uint64_t bytes) {
  if (end_.Size() + bytes > kChunkBytes && end_.Size() > 0) {
    EndChunk();
  }
  if (end_.Size() + bytes > end_room_) {
    const uint64_t room = std::max({end_.Size() + bytes,
                                    std::min(2 * end_room_, kChunkBytes),
                                    kLeastRoomBytes});
    shelf_->Hold(room - end_room_);
    held_bytes_ += room - end_room_;
    end_room_ = room;
    end_.Reserve(room);
  }
}

void FragmentList::EndChunk() {
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

BlockKey FragmentList::KeyOf(size_t chunk) const {
  return {BlockKind::kScratch, number_, static_cast<uint32_t>(chunk)};
}

void FragmentList::VisitChunk(size_t chunk, const Visitor& visit) const {
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
  WallFragment fragment;
  while (!in.AtEnd()) {
    Decode(in, fragment);
    visit(fragment);
  }
}

void FragmentList::Visit(const Visitor& visit) const {
  for (size_t chunk = 0; chunk <= chunks_.size(); ++chunk) {
    VisitChunk(chunk, visit);
  }
}

void FragmentList::Consume(const Visitor& visit) {
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
  FragmentList emptied(std::move(*this));
}

}  // namespace enfilade
