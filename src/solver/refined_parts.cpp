#include "solver/refined_parts.h"

#include "base/parallel.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace enfilade {
namespace {

// Parts looked at together.
constexpr size_t kMostParts = 512;
// No other part is begun while so many links wait for their turn. Those that
// are under way may make some more.
constexpr size_t kManyLinks = 12000;

// Of what is whole, nothing is.
bool IsTooLarge(const WorkPart& work, const RawLinks& links) {
  return links.links.size() > RefinedParts::kMostPartLinks &&
         work.depth < WorkPart::kMostDepth;
}

}  // namespace

RefinedParts::RefinedParts(const Refiner& refiner, WorkPart first)
    : refiner_(&refiner), after_(first) {}

bool RefinedParts::AtEnd() const {
  return Next().item == refiner_->ItemCount();
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

// Parts are begun in their order, so that the links of few have to wait.
void RefinedParts::RefineTogether(const std::vector<Part*>& missing) {
  std::atomic<size_t> links = 0;
  for (const Part& part : parts_) {
    links += part.links.links.size();
  }
  std::atomic<size_t> next = 0;
  OnAllThreads([&] {
    for (size_t i = next++; i < missing.size(); i = next++) {
      const bool is_first = i == 0;
      if (!is_first && links > kManyLinks) {
        return;
      }
      Part& part = *missing[i];
      refiner_->Refine(
          part.work,
          {kMostPartLinks, &links, is_first ? SIZE_MAX : kMostLinks},
          &part.links);
      part.is_whole = !part.links.overflowed;
      if (!part.is_whole && !IsTooLarge(part.work, part.links)) {
        part.links = {};  // there was no room for them
      }
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
