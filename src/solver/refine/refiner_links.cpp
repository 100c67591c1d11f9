// The part of refinement that makes links: from accepted transfers, and from
// weak transfers that are drawn.

#include "base/random.h"
#include "solver/refine/near_code.h"
#include "solver/refine/refiner_task.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

// The error that quadrature scaled to the true sum may add to a near link, as a
// share of tau.
constexpr float kRebuiltShare = 0.03125F;

}  // namespace

void Refiner::AddLink(const RawLink& link, Task* task) {
  const LinkLimit& limit = task->limit;
  RawLinks& out = *task->out;
  out.links.push_back(link);
  out.overflowed |=
      out.links.size() > limit.most ||
      (limit.together != nullptr && ++*limit.together > limit.most_together);
}

void Refiner::AddError(float error, Task* task) {
  task->out->squared_error +=
      static_cast<double>(error) * static_cast<double>(error);
}

// If all rays of a link are blocked, the light that may still get through
// depends on how many rays get through elsewhere: behind a wall, none do.
void Refiner::AddBlockedError(float error, Task* task) {
  task->blocked_squared +=
      static_cast<double>(error) * static_cast<double>(error);
}

// Finishes the task's current sources. Weak links may wait for their rays
// beyond that, unless the rays decide on blocked errors.
void Refiner::TakeBlocked(Task* task) const {
  if (task->blocked_squared > 0) {
    FlushWeak(task);
  }
  const auto seen =
      static_cast<double>(task->rays.seen - task->rays_before.seen);
  const auto traced =
      static_cast<double>(task->rays.traced - task->rays_before.traced);
  task->out->squared_error +=
      task->blocked_squared * std::min(1.0, 2 * (seen + 1) / (traced + 4));
  task->blocked_squared = 0;
  task->rays_before = task->rays;
}

RawLink Refiner::LinkBetween(const Receiver& r, const Source& s) {
  return {r.patch, s.patch, r.path, s.path, LinkKind::kWeak, 0, 0, {}};
}

void Refiner::Accept(const Receiver& r,
                     const Source& s,
                     const Judgement& judgement,
                     uint16_t visible,
                     Task* task) const {
  if (visible == 0) {
    return;
  }
  RawLink link = LinkBetween(r, s);
  link.kind = LinkKind::kFar;
  link.more = visible;
  Kernel seen = judgement.kernel;
  MaskKernel(visible, &seen);
  for (size_t i = 0; i < seen.size(); ++i) {
    link.gain[i / kTransferNodes] += seen[i];
  }
  if (constant_basis_) {
    const float mean = std::inner_product(
        link.gain.begin(), link.gain.end(), r.end.weight.begin(), 0.0F);
    link.gain.fill(mean);
    link.kind = LinkKind::kWeak;
    link.value = EncodeCoefficient(mean);
    link.more = 0;
  } else if (judgement.near && !basis_->HasOwnNodes()) {
    Encode(r, s, seen, &link, task);
  }
  AddLink(link, task);
}

void Refiner::Encode(const Receiver& r,
                     const Source& s,
                     const Kernel& kernel,
                     RawLink* link,
                     Task* task) const {
  const NearCode code =
      EncodeNear(r.end, s, kernel, static_cast<uint16_t>(link->more));
  link->kind = LinkKind::kNear;
  link->value = code.sum;
  if (!code.error || r.weight * *code.error >
                         kRebuiltShare * static_cast<float>(options_.tau)) {
    auto& shapes = task->out->shapes;
    link->kind = LinkKind::kShaped;
    link->more = static_cast<uint32_t>(shapes.size());
    shapes.push_back(EncodeKernel(kernel).shape);
  }
}

void Refiner::AddWeak(const Receiver& r,
                      const Source& s,
                      float form_factor_bound,
                      float bound,
                      float drawn,
                      Task* task) const {
  if (!task->part.Owns(r.level) || IsBehind(s.end, *r.end.patch) ||
      IsBehind(r.end, *s.end.patch)) {
    return;
  }
  const float probability =
      std::min(drawn, work_.WeakProbability(bound, form_factor_bound));
  Random random(KeyOf(r, s));
  if (random.Next() * static_cast<double>(drawn) >=
      static_cast<double>(probability)) {
    return;
  }
  const SampledTransfer sample =
      SampleTransfer(r.end, s.end, IsNear(r.end, s.end), &random);
  if (!(sample.form_factor > 0)) {
    return;
  }
  const float coefficient = sample.form_factor / probability;
  AddPending(
      {LinkBetween(r, s),
       coefficient,
       TrueError(
           r, r.weight * PeakOf(s) * coefficient * std::sqrt(1 - probability))},
      sample.ray,
      task);
}

void Refiner::AddPending(const PendingLink& link,
                         PointPair ray,
                         Task* task) const {
  task->pending.Put(task->packet.count, link);
  AddSegment(ray, &task->packet);
  if (task->packet.count == kPacketRays) {
    FlushWeak(task);
  }
}

void Refiner::FlushWeak(Task* task) const {
  if (task->packet.count == 0) {
    return;
  }
  const uint32_t blocked = blockers_->Occlude(task->packet);
  task->rays.traced += task->packet.count;
  for (uint32_t i = 0; i < task->packet.count; ++i) {
    if ((blocked >> i & 1) == 0) {
      ++task->rays.seen;
      const PendingLink& pending = task->pending[i];
      RawLink link = pending.link;
      link.gain.fill(pending.coefficient);
      AddError(pending.error, task);
      link.value = EncodeCoefficient(pending.coefficient);
      AddLink(link, task);
    }
  }
  task->packet.count = 0;
}

}  // namespace enfilade
