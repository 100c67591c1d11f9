#include "solver/refine/refined_parts.h"

#include "base/parallel.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace enfilade {
namespace {

// The most parts that are looked at together.
constexpr size_t kMostParts = 512;
// No further part is begun while more than this many links wait for their turn.
// Parts under way may still add links.
constexpr size_t kManyLinks = 12000;

// One thread refines the first parts until they have taken this much work,
// counted in rays: to wake other threads takes longer.
constexpr uint64_t kWorkAlone = 150;
// The work of a part apart from its rays.
constexpr uint64_t kWorkOfPart = 10;

// Whether a part has too many links and can be cut. A whole part never has.
bool IsTooLarge(const WorkPart& work, const RawLinks& links) {
  return links.links.size() > RefinedParts::kMostPartLinks &&
         work.depth < WorkPart::kMostDepth;
}

}  // namespace

RefinedParts::RefinedParts(const Refiner& refiner, WorkPart first)
    : refiner_(&refiner), after_(first) {}

bool RefinedParts::AtEnd() const {
  return Next().item >= refiner_->ItemCount();
}

const RawLinks* RefinedParts::Front() const {
  return !parts_.empty() && parts_.front().is_whole ? &parts_.front().links
                                                    : nullptr;
}

WorkPart RefinedParts::Next() const {
  return parts_.empty() ? after_ : parts_.front().work;
}

void RefinedParts::Refine() {
  for (; parts_.size() < kMostParts && after_.item < refiner_->ItemCount();
       after_ = after_.Next()) {
    parts_.push_back({after_, {}, false});
  }
  while (Front() == nullptr) {
    RefineTogether(Missing());
    CutLargeOnes();
  }
}

std::vector<RefinedParts::Part*> RefinedParts::Missing() {
  std::vector<Part*> missing;
  for (Part& part : parts_) {
    if (!part.is_whole) {
      missing.push_back(&part);
    }
  }
  return missing;
}

// Parts are begun in their order, so that few links have to wait.
void RefinedParts::RefineTogether(const std::vector<Part*>& missing) {
  std::atomic<size_t> links = 0;
  for (const Part& part : parts_) {
    links += part.links.links.size();
  }
  const auto refine = [&](size_t i) {
    const bool is_first = i == 0;
    Part& part = *missing[i];
    refiner_->Refine(part.work,
                     {kMostPartLinks, &links, is_first ? SIZE_MAX : kMostLinks},
                     &part.links);
    const uint64_t work = kWorkOfPart + part.links.rays;
    part.is_whole = !part.links.overflowed;
    if (!part.is_whole && !IsTooLarge(part.work, part.links)) {
      part.links = {};  // too many links were waiting
    }
    return work;
  };
  std::atomic<size_t> next = 0;
  for (uint64_t work = 0; work < kWorkAlone;) {
    if (next == missing.size() || (next > 0 && links > kManyLinks)) {
      return;
    }
    work += refine(next++);
  }
  OnAllThreads([&] {
    for (size_t i = next++; i < missing.size() && links <= kManyLinks;
         i = next++) {
      refine(i);
    }
  });
}

void RefinedParts::CutLargeOnes() {
  const auto is_large = [](const Part& part) {
    return IsTooLarge(part.work, part.links);
  };
  if (std::none_of(parts_.begin(), parts_.end(), is_large)) {
    return;
  }
  std::deque<Part> parts;
  for (Part& part : parts_) {
    if (!is_large(part)) {
      parts.push_back(std::move(part));
      continue;
    }
    const WorkPart end = part.work.Next();
    for (WorkPart w = part.work.Narrowed(); w != end; w = w.Next()) {
      parts.push_back({w, {}, false});
    }
  }
  parts_ = std::move(parts);
}

}  // namespace enfilade
