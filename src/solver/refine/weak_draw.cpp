#include "solver/refine/weak_draw.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

WeakDraw::WeakDraw(const PairContext& pair,
                   const WeakBounds& bounds,
                   uint64_t key)
    : pair_(&pair),
      brightness_(bounds.brightness),
      probability_(std::min(
          bounds.drawn,
          pair.work.WeakProbability(bounds.brightness * bounds.form_factor,
                                    bounds.form_factor))),
      random_(key),
      is_kept_(random_.Next() * static_cast<double>(bounds.drawn) <
               static_cast<double>(probability_)) {}

void WeakDraw::Add(const RawLink& ends,
                   const ReceiverElement& r,
                   const SampledTransfer& sample,
                   LinkSink* sink) const {
  if (!(sample.form_factor > 0)) {
    return;
  }
  const float coefficient = sample.form_factor / probability_;
  const float error = brightness_ * coefficient * std::sqrt(1 - probability_);
  sink->AddPending({ends, coefficient, pair_->TrueError(r, error)}, sample.ray);
}

}  // namespace enfilade
