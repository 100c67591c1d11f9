#include "tools/verify/path_queue.h"

#include "base/check.h"
#include "base/morton.h"

#include <algorithm>
#include <numeric>

namespace enfilade {

PathQueue::PathQueue(std::span<const Receiver> receivers,
                     std::span<const uint32_t> strata,
                     const BuildingView& view,
                     GatherMode mode)
    : strata_(strata),
      order_(receivers.size()),
      most_receivers_(receivers.size()) {
  ENFILADE_CHECK(strata.size() == receivers.size(),
                 "{} numbers of strata for {} receivers",
                 strata.size(),
                 receivers.size());
  std::iota(order_.begin(), order_.end(), 0U);
  const size_t parts = view.trace_parts ? view.trace_parts() : 1;
  if (parts == 1) {
    return;
  }
  SortInSpace(receivers, view.scene->bounds);
  // To look up the field, the tracer may have to close once in a batch, so that
  // few batches are better there.
  if (mode == GatherMode::kPaths) {
    most_receivers_ = (receivers.size() + parts - 1) / parts;
  }
}

uint64_t PathQueue::Paths() const {
  uint64_t paths = 0;
  for (const uint32_t n : strata_) {
    paths += uint64_t{n} * n;
  }
  return paths;
}

void PathQueue::TakeBatch(size_t most, std::vector<PathStart>* starts) {
  starts->clear();
  size_t finished = 0;  // receivers
  while (starts->size() < most && finished < most_receivers_ &&
         next_ < order_.size()) {
    const uint32_t receiver = order_[next_];
    const uint32_t strata = strata_[receiver];
    if (stratum_ < strata * strata) {
      starts->push_back({receiver, strata, stratum_++});
      continue;
    }
    stratum_ = 0;
    ++next_;
    ++finished;
  }
}

void PathQueue::SortInSpace(std::span<const Receiver> receivers,
                            const Box3& bounds) {
  std::vector<uint64_t> codes;
  codes.reserve(receivers.size());
  for (const Receiver& r : receivers) {
    codes.push_back(MortonCode(r.position, bounds));
  }
  std::stable_sort(
      order_.begin(), order_.end(), [&](uint32_t left, uint32_t right) {
        return codes[left] < codes[right];
      });
}

}  // namespace enfilade
