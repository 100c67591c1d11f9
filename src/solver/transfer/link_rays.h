// The visibility between two elements by rays between random points of them.

#pragma once

#include "base/random.h"
#include "solver/transfer/blockers.h"
#include "solver/transfer/form_factor.h"

#include <cstdint>
#include <optional>

namespace enfilade {

// All pairs of nodes of two ends: bit g * kTransferNodes + q is node g of the
// receiver and node q of the source.
uint16_t AllPairs(const TransferEnd& receiver, const TransferEnd& source);

struct RayCount {
  uint64_t traced = 0;
  uint64_t seen = 0;
};

// Traces a packet and counts its rays; the lanes whose rays get through.
uint32_t SeenIn(const Blockers& blockers,
                const SegmentPacket& packet,
                RayCount* count);

// The rays of a pair of ends. First those that say how much of the transfer
// gets through, and by that whether it may become a link; then others that say
// the same to the link itself. A link that kept the rays by which it was
// accepted would be accepted most easily where they happen to agree, and its
// light would be biased: docs/decisions/0011-oracle.md.
class LinkRays {
 public:
  // All are borrowed; `key` decides where the rays go.
  LinkRays(const Blockers& blockers,
           const TransferEnd& receiver,
           const TransferEnd& source,
           uint64_t key,
           RayCount* count)
      : blockers_(&blockers),
        receiver_(&receiver),
        source_(&source),
        random_(key),
        count_(count) {}

  // One ray from each of the receiver's nodes, each to another of the
  // source's, unless there are rays already.
  void TraceFew();

  // From all nodes to all.
  void TraceAll();

  // There are rays, and none got through.
  [[nodiscard]] bool NoneSeen() const {
    return rays_.traced != 0 && rays_.seen == 0;
  }

  [[nodiscard]] bool Agree() const {
    return rays_.seen == 0 || rays_.seen == rays_.traced;
  }

  // Whether light gets through where the kernel peaks, if it does: a bowl sees
  // little of the wall that it hangs on but a spot, and the rays between nodes
  // see the bowl from outside.
  [[nodiscard]] bool SeesPeak();

  // Pairs of nodes that have a ray, and those that see each other. Where no
  // points about two nodes face each other there is no ray, and nothing is
  // known of what stands in between.
  [[nodiscard]] uint16_t Traced() const { return rays_.traced; }

  [[nodiscard]] uint16_t Seen() const { return rays_.seen; }

  // Which pairs see each other by rays not traced before: one ray for each of
  // the receiver's nodes, or one for each pair. A pair without a ray counts as
  // seen if at least half of the rays got through.
  [[nodiscard]] uint16_t AskFewAnew();
  [[nodiscard]] uint16_t AskAllAnew();

 private:
  struct Rays {
    uint16_t traced = 0;
    uint16_t seen = 0;

    // Half of the rays got through, or there are none.
    [[nodiscard]] bool MostSeen() const;
  };

  // Diagonals of the table of node pairs: diagonal k joins node g of the
  // receiver with node g + k, modulo their number, of the source.
  struct DiagonalRange {
    size_t first = 0;
    size_t last = 0;
  };

  void Trace(DiagonalRange range, Rays* rays);

  const Blockers* blockers_;
  const TransferEnd* receiver_;
  const TransferEnd* source_;
  Random random_;
  RayCount* count_;
  Rays rays_;
  bool has_few_ = false;
  std::optional<bool> sees_peak_;
};

}  // namespace enfilade
