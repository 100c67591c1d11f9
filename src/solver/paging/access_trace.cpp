#include "solver/paging/access_trace.h"

#include "base/check.h"
#include "base/random.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace enfilade {
namespace {

constexpr uint64_t kMostOwnBytes = 8 << 20;
// The trace may take 1/32 of the budget, and at most kMostOwnBytes.
constexpr uint64_t kShare = 32;
// A third of the trace's memory is for steps, each with its next use; the rest
// is for things. One step in kStepsPerSize may have sizes.
constexpr size_t kStepsPerSize = 8;
constexpr uint64_t kStepBytes =
    sizeof(CacheStep) + sizeof(uint32_t) + sizeof(CachedBytes) / kStepsPerSize;
constexpr uint64_t kNodeBytes =
    sizeof(std::pair<CachedThing, uint32_t>) + 5 * sizeof(void*);
constexpr uint64_t kStepParts = 3;
// Steps that may be added where uses end, before there is room again.
constexpr size_t kStepsOfEnds = 1024;
constexpr uint64_t kEndsBytes =
    kStepsOfEnds * (sizeof(CacheStep) + sizeof(CachedBytes));
// Sizes are noted again when they have changed by one part in kStepsOfSize.
constexpr uint64_t kStepsOfSize = 32;

// What of the trace's memory is not for ends.
uint64_t BesideEnds(uint64_t own_bytes) {
  return own_bytes - std::min(own_bytes / 2, kEndsBytes);
}

bool DiffersMuch(uint64_t a, uint64_t b) {
  return std::max(a, b) - std::min(a, b) > std::max(a, b) / kStepsOfSize;
}

}  // namespace

size_t HashOfThing::operator()(const CachedThing& thing) const noexcept {
  const BlockKey& block = thing.block;
  const uint64_t kind = uint64_t{thing.form} << 32 | block.c;
  const uint64_t cells = uint64_t{block.a} << 32 | block.b;
  return MixKey(kind << 8 ^ static_cast<uint64_t>(block.kind), cells);
}

AccessTrace::AccessTrace(uint64_t own_bytes)
    : most_steps_(BesideEnds(own_bytes) / kStepParts / kStepBytes + 16),
      most_things_(
          BesideEnds(own_bytes) / kStepParts * (kStepParts - 1) /
              (kThingBytes + kNodeBytes + BeladyCache::kBytesPerThing) +
          16),
      cache_(most_things_) {
  static_assert(sizeof(Thing) <= kThingBytes);
  index_.reserve(most_things_);
  things_.reserve(most_things_);
  steps_.reserve(most_steps_ + kStepsOfEnds);
  sizes_.reserve(most_steps_ / kStepsPerSize + kStepsOfEnds);
}

uint64_t AccessTrace::OwnBytesUnder(uint64_t budget_bytes) {
  return std::min(budget_bytes / kShare, kMostOwnBytes);
}

void AccessTrace::SetCapacity(uint64_t bytes) {
  if (!DiffersMuch(bytes, capacity_bytes_)) {
    return;
  }
  MakeRoom();
  // Things that stay in memory under the larger capacity may not stay under the
  // smaller one.
  used_bytes_ += capacity_bytes_ > bytes ? capacity_bytes_ - bytes : 0;
  capacity_bytes_ = bytes;
  sizes_.push_back({bytes, 0});
  Append(CacheAction::kCapacity, 0);
}

// The index of a thing, which has these sizes from now on.
uint32_t AccessTrace::IndexOf(const CachedThing& thing, CachedBytes bytes) {
  if (const auto it = index_.find(thing); it != index_.end()) {
    Thing& known = things_[it->second];
    ENFILADE_CHECK(!known.in_use, "thing {} is in use", it->second);
    known.now = bytes;
    return it->second;
  }
  if (things_.size() >= most_things_) {
    Restart();
  }
  const auto index = static_cast<uint32_t>(things_.size());
  index_.emplace(thing, index);
  things_.emplace_back().now = bytes;
  return index;
}

void AccessTrace::Resize(const CachedThing& thing, uint64_t held_bytes) {
  MakeRoom();
  const auto it = index_.find(thing);
  if (it == index_.end() || !things_[it->second].in_use) {
    return;  // the trace has begun anew meanwhile
  }
  Thing& t = things_[it->second];
  in_use_bytes_ += held_bytes - t.now.held;
  used_bytes_ += held_bytes > t.now.held ? held_bytes - t.now.held : 0;
  t.now.held = held_bytes;
  if (DiffersMuch(t.now.held, t.noted.held)) {
    NoteSizes(it->second);
  }
}

void AccessTrace::NoteSizes(uint32_t index) {
  Thing& t = things_[index];
  if (t.now == t.noted) {
    return;
  }
  t.noted = t.now;
  sizes_.push_back(t.now);
  Append(CacheAction::kResize, index);
}

// Returns whether the use is a new step; otherwise the use continues the one
// before.
bool AccessTrace::BeginUse(uint32_t index) {
  Thing& t = things_[index];
  const bool stays = t.last_step != kNoStep && used_bytes_ <= t.kept_until;
  if (stays) {
    CacheStep& last = steps_[t.last_step];
    last.action = last.action == CacheAction::kEnd ? CacheAction::kNone
                                                   : CacheAction::kBegin;
  }
  t.last_step = kNoStep;
  t.in_use = true;
  in_use_bytes_ += t.now.held;
  used_bytes_ += t.now.held;
  return !stays;
}

void AccessTrace::EndUse(uint32_t index, CacheAction action) {
  NoteSizes(index);
  Thing& t = things_[index];
  t.in_use = false;
  const uint64_t needed = in_use_bytes_;
  in_use_bytes_ -= t.now.held;
  t.kept_until =
      capacity_bytes_ > needed ? used_bytes_ + (capacity_bytes_ - needed) : 0;
  t.last_step = static_cast<uint32_t>(steps_.size());
  Append(action, index);
}

void AccessTrace::Begin(const CachedThing& thing, CachedBytes bytes) {
  MakeRoom();
  const uint32_t index = IndexOf(thing, bytes);
  begin_is_new_ = BeginUse(index);
  if (begin_is_new_) {
    NoteSizes(index);
    Append(CacheAction::kBegin, index);
  }
}

void AccessTrace::BeginAlong(const CachedThing& thing, CachedBytes bytes) {
  MakeRoom();
  const uint32_t index = IndexOf(thing, bytes);
  if (BeginUse(index)) {
    NoteSizes(index);
    Append(begin_is_new_ ? CacheAction::kBeginAlong : CacheAction::kBegin,
           index);
  }
}

void AccessTrace::End(const CachedThing& thing) {
  const auto it = index_.find(thing);
  if (it != index_.end() && things_[it->second].in_use) {
    EndUse(it->second, CacheAction::kEnd);
  }
}

void AccessTrace::Touch(const CachedThing& thing, CachedBytes bytes) {
  MakeRoom();
  const uint32_t index = IndexOf(thing, bytes);
  NoteSizes(index);
  const bool is_new = BeginUse(index);
  EndUse(index, is_new ? CacheAction::kTouch : CacheAction::kEnd);
}

void AccessTrace::Make(const CachedThing& thing, CachedBytes bytes) {
  MakeRoom();
  const uint32_t index = IndexOf(thing, bytes);
  used_bytes_ += things_[index].now.held;
  NoteSizes(index);
  things_[index].last_step = kNoStep;
  Append(CacheAction::kMade, index);
}

void AccessTrace::AddReadOnce(uint64_t bytes) {
  reads_.read += bytes;
  reads_.belady += bytes;
  reads_.compulsory += bytes;
}

void AccessTrace::Append(CacheAction action, uint32_t thing) {
  steps_.emplace_back(action, thing);
}

// Plays the older half of the steps if there is no room for more. Not where a
// use ends, since that must not fail.
void AccessTrace::MakeRoom() {
  const size_t most_sizes = most_steps_ / kStepsPerSize;
  if (steps_.size() < most_steps_ && sizes_.size() < most_sizes) {
    return;
  }
  Compact();
  if (steps_.size() > most_steps_ / 2 || sizes_.size() > most_sizes / 2) {
    Play(steps_.size() / 2);
  }
}

// Removes the steps at which nothing happens.
void AccessTrace::Compact() {
  size_t kept = 0;
  for (const CacheStep step : steps_) {
    if (step.action == CacheAction::kNone) {
      continue;
    }
    if (step.action == CacheAction::kEnd ||
        step.action == CacheAction::kTouch) {
      // If the same thing has later steps, they overwrite last_step.
      Thing& t = things_[step.thing];
      t.last_step =
          t.last_step == kNoStep ? kNoStep : static_cast<uint32_t>(kept);
    }
    steps_[kept++] = step;
  }
  steps_.erase(steps_.begin() + static_cast<std::ptrdiff_t>(kept),
               steps_.end());
}

void AccessTrace::Play(size_t count) {
  cache_.Play(steps_, count, sizes_);
  const auto has_sizes = [](const CacheStep& step) {
    return step.action == CacheAction::kResize ||
           step.action == CacheAction::kCapacity;
  };
  const auto first = steps_.begin();
  const auto last = first + static_cast<std::ptrdiff_t>(count);
  sizes_.erase(sizes_.begin(),
               sizes_.begin() + std::count_if(first, last, has_sizes));
  steps_.erase(first, last);
  for (Thing& t : things_) {
    t.last_step = t.last_step == kNoStep || t.last_step < count
                      ? kNoStep
                      : t.last_step - static_cast<uint32_t>(count);
  }
}

TracedReads AccessTrace::TakeReads() {
  Play(steps_.size());
  const BeladyReads best = cache_.TakeReads();
  reads_.belady += best.optimal_bytes;
  reads_.compulsory += best.compulsory_bytes;
  return std::exchange(reads_, {});
}

void AccessTrace::Restart() {
  reads_ = TakeReads();
  cache_ = BeladyCache(most_things_);
  index_.clear();
  things_.clear();
  in_use_bytes_ = 0;
  const uint64_t capacity = std::exchange(capacity_bytes_, 0);
  SetCapacity(capacity);
}

uint64_t AccessTrace::SizeBytes() const {
  return most_steps_ * kStepBytes + kEndsBytes + index_.size() * kNodeBytes +
         most_things_ * (sizeof(Thing) + BeladyCache::kBytesPerThing);
}

}  // namespace enfilade
