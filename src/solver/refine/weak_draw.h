// Transfers that are too weak to be refined. Chance decides which of them are
// kept, as weak links; what these carry is divided by the probability, so that
// all together are right on the average (refiner.h).

#pragma once

#include "base/random.h"
#include "solver/refine/link_sink.h"
#include "solver/refine/pair_context.h"
#include "solver/refine/raw_links.h"
#include "solver/refine/receiver_element.h"
#include "solver/transfer/transfer_sample.h"

#include <cstdint>

namespace enfilade {

// What bounds say of a weak transfer.
struct WeakBounds {
  float brightness = 0;  // of the source, weighted by the receiver, W/m
  float form_factor = 0;
  // The probability with which the pair was chosen to be looked at.
  float drawn = 1;
};

class WeakDraw {
 public:
  // The pair is borrowed. `key`: of the random numbers.
  WeakDraw(const PairContext& pair, const WeakBounds& bounds, uint64_t key);

  [[nodiscard]] bool IsKept() const { return is_kept_; }

  // The probability with which the transfer was to be looked at and kept.
  [[nodiscard]] float Probability() const { return probability_; }

  // For the points of the sample.
  Random* Numbers() { return &random_; }

  // Makes the link of a transfer that is kept, if light can take the sample's
  // path. `ends`: the link without what it carries.
  void Add(const RawLink& ends,
           const ReceiverElement& r,
           const SampledTransfer& sample,
           LinkSink* sink) const;

 private:
  const PairContext* pair_;
  float brightness_;
  float probability_;
  Random random_;
  bool is_kept_;
};

}  // namespace enfilade
