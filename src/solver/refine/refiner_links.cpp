// The part of refinement that makes links: from accepted transfers, and from
// weak transfers that are drawn.

#include "base/random.h"
#include "solver/refine/refiner_task.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

// The error that quadrature scaled to the true sum may add to a near link, as a
// share of tau.
constexpr float kRebuiltShare = 0.03125F;

// The QuadratureKernel of the visible pairs of nodes, scaled to a sum.
Kernel ScaledQuadrature(const TransferEnd& receiver,
                        const TransferEnd& source,
                        uint16_t visible,
                        uint16_t sum) {
  Kernel kernel = QuadratureKernel(receiver, source);
  MaskKernel(visible, &kernel);
  std::array<float, kTransferNodes> totals{};
  for (size_t i = 0; i < kernel.size(); ++i) {
    totals[i / kTransferNodes] += kernel[i];
  }
  const float scale = ScaleTo(sum, totals);
  for (float& k : kernel) {
    k *= scale;
  }
  return kernel;
}

bool IsZero(const Kernel& kernel) {
  return std::all_of(
      kernel.begin(), kernel.end(), [](float k) { return k == 0; });
}

// The difference between the irradiances that two kernels bring from a source
// with these nodes and this detail, W/m2, RMS over the receiver's nodes.
float Difference(const Kernel& kernel,
                 const Kernel& other,
                 const std::array<float, kTransferNodes>& radiosity,
                 float detail) {
  float square = 0;
  for (size_t g = 0; g < kTransferNodes; ++g) {
    float even = 0;
    float uneven = 0;
    for (size_t q = 0; q < kTransferNodes; ++q) {
      const size_t i = g * kTransferNodes + q;
      const float off = other[i] - kernel[i];
      even += off * radiosity[q];
      uneven += off * off;
    }
    square += even * even + uneven * detail * detail;
  }
  return std::sqrt(square / kTransferNodes);
}

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
  link->kind = LinkKind::kNear;
  link->value = EncodeSum(kernel);
  const Kernel rebuilt = ScaledQuadrature(
      r.end, s.end, static_cast<uint16_t>(link->more), link->value);
  const float error = Difference(kernel, rebuilt, s.radiosity, s.detail);
  // Quadrature that is zero everywhere cannot be scaled to a sum.
  if (IsZero(rebuilt) ||
      r.weight * error > kRebuiltShare * static_cast<float>(options_.tau)) {
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
  if (!task->Takes(r) || IsBehind(s.end, *r.end.patch) ||
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
