#include "solver/refine/link_sink.h"

#include "solver/transfer/transfer_sample.h"

#include <algorithm>

namespace enfilade {

void LinkSink::Add(const RawLink& link) {
  out_->links.push_back(link);
  out_->overflowed |=
      out_->links.size() > limit_.most ||
      (limit_.together != nullptr && ++*limit_.together > limit_.most_together);
}

uint32_t LinkSink::AddShape(const KernelShape& shape) {
  const auto index = static_cast<uint32_t>(out_->shapes.size());
  out_->shapes.push_back(shape);
  return index;
}

void LinkSink::AddPending(const PendingLink& link, PointPair ray) {
  pending_.Put(packet_.count, link);
  AddSegment(ray, &packet_);
  if (packet_.count == kPacketRays) {
    TracePending();
  }
}

void LinkSink::AddError(float error, bool is_seen) {
  (is_seen ? out_->squared_error : blocked_squared_) +=
      static_cast<double>(error) * static_cast<double>(error);
}

// Weak links may go on waiting for their rays, unless the rays decide on
// blocked errors.
void LinkSink::TakeBlocked() {
  if (blocked_squared_ > 0) {
    TracePending();
  }
  const auto seen = static_cast<double>(rays_.seen - rays_before_.seen);
  const auto traced = static_cast<double>(rays_.traced - rays_before_.traced);
  out_->squared_error +=
      blocked_squared_ * std::min(1.0, 2 * (seen + 1) / (traced + 4));
  blocked_squared_ = 0;
  rays_before_ = rays_;
}

void LinkSink::Finish() {
  TracePending();
  out_->rays += rays_.traced;
}

void LinkSink::TracePending() {
  const uint32_t seen = SeenIn(*blockers_, packet_, &rays_);
  for (uint32_t i = 0; i < packet_.count; ++i) {
    if ((seen >> i & 1) != 0) {
      const PendingLink& pending = pending_[i];
      RawLink link = pending.link;
      link.gain.fill(pending.coefficient);
      link.value = EncodeCoefficient(pending.coefficient);
      AddError(pending.error, true);
      Add(link);
    }
  }
  packet_.count = 0;
}

}  // namespace enfilade
