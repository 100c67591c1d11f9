#include "store/belady.h"

#include "base/check.h"

#include <algorithm>

namespace enfilade {
namespace {

// A thing without a next use in sight ranks behind all things that have one.
// Among themselves such things rank by their last use: in cyclic work, what was
// used last is used again last.
constexpr uint32_t kOutOfSight = 1U << 31;

bool IsUse(CacheAction action) {
  return action == CacheAction::kBegin || action == CacheAction::kBeginAlong ||
         action == CacheAction::kTouch;
}

bool HasSizes(CacheAction action) {
  return action == CacheAction::kResize || action == CacheAction::kCapacity;
}

}  // namespace

BeladyCache::BeladyCache(size_t things) {
  static_assert(sizeof(Thing) + 2 * sizeof(may_go_[0]) + sizeof(uint32_t) <=
                kBytesPerThing);
  things_.reserve(things);
  may_go_.reserve(2 * things + 2);
}

void BeladyCache::Prepare(std::span<const CacheStep> steps) {
  size_t things = things_.size();
  for (const CacheStep& step : steps) {
    things = std::max<size_t>(things, step.thing + 1);
  }
  things_.resize(things);
  may_go_.clear();
}

void BeladyCache::Play(std::span<const CacheStep> steps,
                       size_t count,
                       std::span<const CachedBytes> sizes) {
  ENFILADE_CHECK(steps.size() < kOutOfSight, "{} steps", steps.size());
  Prepare(steps);
  // For each step, where its thing is used next.
  std::vector<uint32_t> next(steps.size());
  std::vector<uint32_t> upcoming(things_.size(), kOutOfSight);
  for (size_t i = steps.size(); i-- > 0;) {
    uint32_t* const use = &upcoming[steps[i].thing];
    next[i] =
        *use == kOutOfSight ? kOutOfSight + static_cast<uint32_t>(i) : *use;
    if (IsUse(steps[i].action)) {
      *use = static_cast<uint32_t>(i);
    }
  }
  for (uint32_t i = 0; i < things_.size(); ++i) {
    if (things_[i].is_here && !things_[i].in_use) {
      Keep(i, upcoming[i]);
    }
  }
  size_t size = 0;
  for (size_t i = 0; i < count; ++i) {
    if (HasSizes(steps[i].action)) {
      const CachedBytes& bytes = sizes[size++];
      if (steps[i].action == CacheAction::kCapacity) {
        capacity_bytes_ = bytes.held;
      } else {
        Thing& thing = things_[steps[i].thing];
        here_bytes_ += thing.is_here ? bytes.held - thing.bytes.held : 0;
        thing.bytes = bytes;
      }
    }
    Apply(steps[i], next[i]);
  }
}

void BeladyCache::Apply(const CacheStep& step, uint32_t next) {
  Thing& thing = things_[step.thing];
  const bool had_just_read = has_just_read_;
  has_just_read_ &= step.action == CacheAction::kNone || HasSizes(step.action);
  switch (step.action) {
    case CacheAction::kNone:
      return;
    case CacheAction::kBegin:
      has_just_read_ = Bring(step.thing, false);
      thing.in_use = true;
      break;
    case CacheAction::kBeginAlong:
      Bring(step.thing, had_just_read);
      thing.in_use = true;
      break;
    case CacheAction::kEnd:
      thing.in_use = false;
      Keep(step.thing, next);
      break;
    case CacheAction::kTouch:
      Bring(step.thing, false);
      Keep(step.thing, next);
      break;
    case CacheAction::kMade:
      Lose(step.thing);
      thing.was_here = true;
      Bring(step.thing, true);
      Keep(step.thing, next);
      break;
    case CacheAction::kResize:
    case CacheAction::kCapacity:
      break;
  }
  Shrink();
}

// Reads the thing unless it is in memory; returns whether a read was needed.
bool BeladyCache::Bring(uint32_t index, bool is_free) {
  Thing& thing = things_[index];
  if (!std::exchange(thing.was_here, true) && !is_free) {
    reads_.compulsory_bytes += thing.bytes.stored;
  }
  if (thing.is_here) {
    return false;
  }
  reads_.optimal_bytes += is_free ? 0 : thing.bytes.stored;
  thing.is_here = true;
  here_bytes_ += thing.bytes.held;
  return true;
}

void BeladyCache::Keep(uint32_t index, uint32_t next) {
  // No room is made for a thing that is larger than the whole cache.
  if (things_[index].bytes.held > capacity_bytes_) {
    Lose(index);
    return;
  }
  // Stale entries are dropped once the heap has more than two per thing.
  if (may_go_.size() > 2 * things_.size()) {
    std::erase_if(may_go_, [&](const auto& entry) {
      const Thing& t = things_[entry.second];
      return !t.is_here || t.in_use || t.next != entry.first;
    });
    std::make_heap(may_go_.begin(), may_go_.end());
  }
  things_[index].next = next;
  may_go_.emplace_back(next, index);
  std::push_heap(may_go_.begin(), may_go_.end());
}

void BeladyCache::Lose(uint32_t index) {
  Thing& thing = things_[index];
  if (thing.is_here && !thing.in_use) {
    thing.is_here = false;
    here_bytes_ -= thing.bytes.held;
  }
}

void BeladyCache::Shrink() {
  while (here_bytes_ > capacity_bytes_ && !may_go_.empty()) {
    const auto [next, index] = may_go_.front();
    std::pop_heap(may_go_.begin(), may_go_.end());
    may_go_.pop_back();
    if (!things_[index].in_use && things_[index].next == next) {
      Lose(index);
    }
  }
}

}  // namespace enfilade
