// Where the links of a part of the work go while the part is refined, with
// their errors and rays. Weak links wait here until there are enough of them to
// trace their rays together.

#pragma once

#include "solver/links/link_codes.h"
#include "solver/refine/raw_links.h"
#include "solver/refine/slots.h"
#include "solver/transfer/blockers.h"
#include "solver/transfer/link_rays.h"
#include "solver/transfer/point_pair.h"
#include "visibility/occlusion.h"

#include <cstddef>
#include <cstdint>
#include <tuple>

namespace enfilade {

// A weak link that waits for its ray.
struct PendingLink {
  RawLink link;
  float coefficient = 0;
  float error = 0;  // W/m, if the ray gets through
};

class LinkSink {
 public:
  // Blockers and `out` are borrowed.
  LinkSink(const Blockers& blockers, const LinkLimit& limit, RawLinks* out)
      : blockers_(&blockers), limit_(limit), out_(out) {}

  // Whether there are too many links, so that no more are needed.
  [[nodiscard]] bool Overflowed() const { return out_->overflowed; }

  // Counts the rays that are traced for the links.
  RayCount* Rays() { return &rays_; }

  void Add(const RawLink& link);

  // Returns the value of `more` for the shaped link to be added.
  uint32_t AddShape(const KernelShape& shape);

  // Adds the link if its ray gets through.
  void AddPending(const PendingLink& link, PointPair ray);

  // The error of a transfer (PairContext::TrueError), W/m. If none of its light
  // is seen to arrive, it is the error if half of all rays got through: how
  // much light may still arrive depends on how many rays get through elsewhere.
  // Behind a wall, none do.
  void AddError(float error, bool is_seen);

  // Takes the blocked errors since the last call by the share of the rays since
  // then that got through.
  void TakeBlocked();

  // Traces the rays that wait, and hands over the number of all rays.
  void Finish();

 private:
  // Rays that are traced together.
  static constexpr size_t kPacketRays =
      std::tuple_size_v<decltype(SegmentPacket::from_x)>;

  void TracePending();

  const Blockers* blockers_;
  LinkLimit limit_;
  RawLinks* out_;
  RayCount rays_;
  double blocked_squared_ = 0;
  RayCount rays_before_;  // at the last TakeBlocked
  SegmentPacket packet_{};
  Slots<PendingLink, kPacketRays> pending_;
};

}  // namespace enfilade
