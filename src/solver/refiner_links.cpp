// The part of refinement that makes links: of transfers that are accepted, of
// weak ones that are drawn, and in the blocks of cells.

#include "base/random.h"
#include "solver/refiner_task.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

// A sampled transfer is kept at least with this multiple of its form factor,
// so that no coefficient exceeds its inverse: what is dark now may be lit
// later.
constexpr float kWeakGain = 1;

// Adds gains at transfer nodes to those at the nodes of a basis.
void AddGain(const TreeShape& shape,
             PatchShape patch_shape,
             const std::array<float, kTransferNodes>& from,
             float* to) {
  if (!shape.basis->HasOwnNodes()) {
    for (size_t g = 0; g < shape.NodeStride(); ++g) {
      to[g] += from[g];
    }
    return;
  }
  const auto& rows = shape.basis->SamplesOn(patch_shape).from_samples;
  for (size_t g = 0; g < shape.basis->On(patch_shape).NodeCount(); ++g) {
    to[g] +=
        std::inner_product(from.begin(), from.end(), rows[g].begin(), 0.0F);
  }
}

GroupCoefficients EncodedGain(const std::array<float, kTransferNodes>& gain) {
  GroupCoefficients coefficients{};
  std::transform(
      gain.begin(), gain.end(), coefficients.begin(), EncodeCoefficient);
  return coefficients;
}

}  // namespace

void RawLinks::Clear() {
  constexpr size_t kKept = 64;
  if (links.capacity() > kKept || near.capacity() > kKept) {
    *this = {};
  }
  links.clear();
  near.clear();
  squared_error = 0;
  rays = 0;
  overflowed = false;
}

void ApplyLinks(const RawLinks& raw,
                std::span<const PatchGeometry> receiver_patches,
                CellTree& receiver,
                std::span<const PatchGeometry> source_patches,
                CellTree& source,
                LinkBlock* block) {
  for (const RawLink& link : raw.links) {
    Link out;
    out.receiver = receiver
                       .FindOrCreate(PatchId(link.receiver_patch),
                                     link.receiver_path,
                                     receiver_patches)
                       .value;
    if (link.kind == LinkKind::kGroup) {
      out.source = link.source_patch;
    } else {
      out.source =
          source
              .FindOrCreate(
                  PatchId(link.source_patch), link.source_path, source_patches)
              .value;
    }
    out.kind = link.kind;
    out.value = link.value;
    AddGain(receiver.Shape(),
            receiver_patches[link.receiver_patch].shape,
            link.gain,
            receiver.Gain().At(out.receiver));
    if (link.kind == LinkKind::kNear) {
      out.index = static_cast<uint32_t>(block->near.size());
      block->near.push_back(raw.near[link.near_index]);
    } else if (link.kind == LinkKind::kGroup) {
      out.index = static_cast<uint32_t>(block->group.size());
      block->group.push_back(EncodedGain(link.gain));
    }
    block->links.push_back(out);
  }
}

float Refiner::WeakProbability(float transfer, float form_factor) const {
  return std::min(1.0F,
                  std::max(transfer / static_cast<float>(options_.tau_weak),
                           kWeakGain * form_factor));
}

void Refiner::AddError(float error, Task* task) {
  task->out->squared_error +=
      static_cast<double>(error) * static_cast<double>(error);
}

// Where all rays of a link are blocked, what may have got through depends on
// how many do elsewhere: behind a wall none.
void Refiner::AddBlockedError(float error, Task* task) {
  task->blocked_squared +=
      static_cast<double>(error) * static_cast<double>(error);
}

RawLink Refiner::LinkBetween(const Receiver& r, const Source& s) {
  return {r.patch, r.path, s.patch, s.path, LinkKind::kWeak, 0, 0, {}};
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
  link.value = visible;
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
  } else if (judgement.near && !basis_->HasOwnNodes()) {
    const EncodedKernel encoded = EncodeKernel(seen);
    link.kind = LinkKind::kNear;
    link.value = encoded.sum;
    link.near_index = static_cast<uint32_t>(task->out->near.size());
    task->out->near.push_back(encoded.shape);
  }
  task->out->links.push_back(link);
  task->out->overflowed = task->out->links.size() > task->most;
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
      std::min(drawn, WeakProbability(bound, form_factor_bound));
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
  task->pending[task->packet.count] = link;
  AddSegment(ray, &task->packet);
  if (task->packet.count == task->pending.size()) {
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
      RawLink link = task->pending[i].link;
      link.gain.fill(task->pending[i].coefficient);
      AddError(task->pending[i].error, task);
      link.value = EncodeCoefficient(task->pending[i].coefficient);
      task->out->links.push_back(link);
    }
  }
  task->out->overflowed = task->out->links.size() > task->most;
  task->packet.count = 0;
}

}  // namespace enfilade
