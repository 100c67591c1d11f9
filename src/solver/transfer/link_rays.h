// The visibility between two elements, by rays between random points of them.

#pragma once

#include "base/random.h"
#include "solver/transfer/blockers.h"
#include "solver/transfer/form_factor.h"

#include <cstdint>
#include <optional>

namespace enfilade {

// A bit for every pair of nodes of two ends: bit g * kTransferNodes + q is for
// node g of the receiver and node q of the source.
uint16_t AllPairs(const TransferEnd& receiver, const TransferEnd& source);

struct RayCount {
  uint64_t traced = 0;
  uint64_t seen = 0;
};

// Traces a packet and counts its rays. Bit i of the result: ray i got through.
uint32_t SeenIn(const Blockers& blockers,
                const SegmentPacket& packet,
                RayCount* count);

// The rays between two ends. TraceFew and TraceAll say how much of the transfer
// gets through, and thus whether the transfer may become a link. AskFewAnew and
// AskAllAnew trace other rays for the visibility of the link itself. If a link
// kept the rays by which it was accepted, links would be accepted most easily
// where their rays happen to agree, and their light would be biased:
// docs/decisions/0011-oracle.md.
class LinkRays {
 public:
  // All arguments are borrowed; `key` seeds the rays.
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

  // Traces one ray from each of the receiver's nodes, to the source's nodes in
  // turn, unless there are rays already.
  void TraceFew();

  // Traces the rays for all other pairs of nodes as well.
  void TraceAll();

  // Whether there are rays and none of them got through.
  [[nodiscard]] bool NoneSeen() const {
    return rays_.traced != 0 && rays_.seen == 0;
  }

  [[nodiscard]] bool Agree() const {
    return rays_.seen == 0 || rays_.seen == rays_.traced;
  }

  // Whether light gets through where the kernel peaks; false if the kernel has
  // no peak. A bowl sees only a spot of the wall on which it hangs, and the
  // rays between nodes see the bowl from outside.
  [[nodiscard]] bool SeesPeak();

  // Traced: the pairs of nodes that have a ray. Seen: the pairs whose ray got
  // through. A pair has no ray if no points about its two nodes face each
  // other; nothing is known then of what stands in between.
  [[nodiscard]] uint16_t Traced() const { return rays_.traced; }

  [[nodiscard]] uint16_t Seen() const { return rays_.seen; }

  // The visible pairs of nodes, by rays not traced before: AskFewAnew traces
  // one ray per receiver node, which stands for all pairs of that node;
  // AskAllAnew traces one ray per pair. A pair without a ray counts as visible
  // if at least half of the rays got through.
  [[nodiscard]] uint16_t AskFewAnew();
  [[nodiscard]] uint16_t AskAllAnew();

 private:
  struct Rays {
    uint16_t traced = 0;
    uint16_t seen = 0;

    // Whether at least half of the rays got through, or there are no rays.
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
