#include "scene/spill_vector.h"

#include "base/bytes.h"
#include "base/check.h"

#include <algorithm>

namespace enfilade {
namespace {

constexpr uint64_t kPagePoints = 4096;
constexpr uint64_t kPageBytes = kPagePoints * sizeof(Point3);
constexpr uint64_t kLeastPages = 2;

}  // namespace

SpillVector::SpillVector(BlockStorage& store,
                         MemoryBudget& budget,
                         uint64_t resident_bytes,
                         uint32_t scratch_key)
    : store_(&store),
      budget_(&budget),
      most_pages_(std::max(kLeastPages, resident_bytes / kPageBytes)),
      scratch_key_(scratch_key) {}

SpillVector::~SpillVector() {
  budget_->Release(resident_.size() * kPageBytes);
}

void SpillVector::Append(Point3 p) {
  const size_t page = size_ / kPagePoints;
  if (page == pages_.size()) {
    MakeRoomFor(page);
    pages_.emplace_back();
    pages_.back().points.reserve(kPagePoints);
  } else if (pages_[page].points.empty()) {
    Load(page);
  }
  pages_[page].last_used = ++clock_;
  pages_[page].stored = false;
  pages_[page].points.push_back(p);
  ++size_;
}

Point3 SpillVector::At(uint64_t index) {
  ENFILADE_CHECK(index < size_, "point {} of {}", index, size_);
  const size_t page = index / kPagePoints;
  if (pages_[page].points.empty()) {
    Load(page);
  }
  pages_[page].last_used = ++clock_;
  return pages_[page].points[index % kPagePoints];
}

void SpillVector::Load(size_t page) {
  MakeRoomFor(page);
  const Bytes bytes = store_->GetOrThrow(
      {BlockKind::kScratch, scratch_key_, static_cast<uint32_t>(page), 0});
  ByteReader in(bytes);
  pages_[page].points = in.GetArray<Point3>();
  pages_[page].points.reserve(kPagePoints);
}

void SpillVector::MakeRoomFor(size_t page) {
  if (resident_.size() >= most_pages_) {
    const auto oldest = std::min_element(
        resident_.begin(), resident_.end(), [this](size_t a, size_t b) {
          return pages_[a].last_used < pages_[b].last_used;
        });
    const size_t victim = *oldest;
    *oldest = resident_.back();
    resident_.pop_back();
    Evict(victim);
  }
  budget_->Charge(kPageBytes, "reading vertices");
  resident_.push_back(page);
}

void SpillVector::Evict(size_t page) {
  Page& victim = pages_[page];
  if (!victim.stored) {
    ByteWriter out;
    out.PutArray<Point3>(victim.points);
    store_->Put(
        {BlockKind::kScratch, scratch_key_, static_cast<uint32_t>(page), 0},
        out.View());
    victim.stored = true;
  }
  FreeVector(&victim.points);
  budget_->Release(kPageBytes);
}

void SpillVector::Clear() {
  budget_->Release(resident_.size() * kPageBytes);
  resident_.clear();
  pages_.clear();
  size_ = 0;
  store_->EraseAll(BlockKind::kScratch, scratch_key_);
}

}  // namespace enfilade
