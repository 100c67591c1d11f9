#include "solver/transfer/link_rays.h"

#include "solver/transfer/transfer_sample.h"

#include <array>
#include <bit>

namespace enfilade {

uint32_t SeenIn(const Blockers& blockers,
                const SegmentPacket& packet,
                RayCount* count) {
  if (packet.count == 0) {
    return 0;
  }
  const uint32_t lanes = (1U << packet.count) - 1;
  const uint32_t seen = ~blockers.Occlude(packet) & lanes;
  count->traced += packet.count;
  count->seen += static_cast<uint32_t>(std::popcount(seen));
  return seen;
}

uint16_t AllPairs(const TransferEnd& receiver, const TransferEnd& source) {
  const uint32_t row = (1U << source.node_count) - 1;
  uint32_t bits = 0;
  for (size_t g = 0; g < receiver.node_count; ++g) {
    bits |= row << (g * kTransferNodes);
  }
  return static_cast<uint16_t>(bits);
}

bool LinkRays::Rays::MostSeen() const {
  return 2 * std::popcount(seen) >= std::popcount(traced);
}

void LinkRays::TraceFew() {
  if (!has_few_) {
    has_few_ = true;
    Trace({0, 1}, &rays_);
  }
}

void LinkRays::TraceAll() {
  TraceFew();
  Trace({1, source_->node_count}, &rays_);
}

bool LinkRays::SeesPeak() {
  if (sees_peak_) {
    return *sees_peak_;
  }
  const bool from_source = source_->diameter < receiver_->diameter;
  const TransferEnd& small = from_source ? *source_ : *receiver_;
  const TransferEnd& large = from_source ? *receiver_ : *source_;
  SegmentPacket packet;
  if (IsPeaked(small.diameter, small.center, large)) {
    for (size_t i = 0; i < kPeakRays; ++i) {
      if (const auto pair = PairAtPeak(*receiver_, *source_, &random_)) {
        AddSegment(*pair, &packet);
      }
    }
  }
  sees_peak_ = SeenIn(*blockers_, packet, count_) != 0;
  return *sees_peak_;
}

uint16_t LinkRays::AskFewAnew() {
  Rays anew;
  const size_t k =
      random_.NextBelow(static_cast<uint32_t>(source_->node_count));
  Trace({k, k + 1}, &anew);
  uint16_t bits = 0;
  for (size_t g = 0; g < receiver_->node_count; ++g) {
    const uint32_t row = ((1U << source_->node_count) - 1)
                         << (g * kTransferNodes);
    const bool sees =
        (anew.traced & row) != 0 ? (anew.seen & row) != 0 : anew.MostSeen();
    bits |= static_cast<uint16_t>(sees ? row : 0);
  }
  return bits;
}

uint16_t LinkRays::AskAllAnew() {
  Rays anew;
  Trace({0, source_->node_count}, &anew);
  const auto unknown = static_cast<uint16_t>(AllPairs(*receiver_, *source_) &
                                             ~uint32_t{anew.traced});
  return anew.MostSeen() ? anew.seen | unknown : anew.seen;
}

// Traces rays from each node g of the receiver to the source's nodes
// (g + k) mod n for k in [first, last).
void LinkRays::Trace(DiagonalRange range, Rays* rays) {
  SegmentPacket packet;
  std::array<uint8_t, 16> lane_bit{};
  for (size_t k = range.first; k < range.last; ++k) {
    for (size_t g = 0; g < receiver_->node_count; ++g) {
      const size_t q = (g + k) % source_->node_count;
      const auto bit = static_cast<uint8_t>(g * kTransferNodes + q);
      if (const auto pair = RandomPair(*receiver_, g, *source_, q, &random_)) {
        rays->traced |= static_cast<uint16_t>(1U << bit);
        lane_bit[packet.count] = bit;
        AddSegment(*pair, &packet);
      }
    }
  }
  const uint32_t seen = SeenIn(*blockers_, packet, count_);
  for (uint32_t lane = 0; lane < packet.count; ++lane) {
    const auto bit = static_cast<uint16_t>(1U << lane_bit[lane]);
    rays->seen |= (seen >> lane & 1) != 0 ? bit : uint16_t{0};
  }
}

}  // namespace enfilade
