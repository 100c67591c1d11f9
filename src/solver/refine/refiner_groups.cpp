// The part of refinement whose sources are groups of patches.

#include "base/random.h"
#include "solver/refine/refiner_task.h"
#include "solver/refine/source_weights.h"
#include "solver/refine/unknown_share.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace enfilade {
namespace {

// The rays of a look: points about each of the receiver's nodes, and rays from
// each point. Many rays leave unknown how V varies over the receiver, and their
// own noise, which stratification makes about half as large.
constexpr size_t kManyPoints = 4;
constexpr size_t kManyRays = 4;
constexpr float kUnknownByReceiver = 0.5F;
constexpr float kStratified = 0.5F;
// Keeps the keys of groups distinct from those of patches.
constexpr uint64_t kGroupKey = uint64_t{1} << 31;

// `share`: what rays leave unknown, as a share of the transfer. `of_receiver`:
// the part of that due to the receiver, whose points see different shares of
// the group. The rest is due to the group, whose points are seen or not.
struct Unknown {
  float share = 0;
  float of_receiver = 0;
};

// If all rays agree, most of the unknown share is due to the larger end.
Unknown UnknownByAgreed(float share,
                        float receiver_diameter,
                        const Box& group) {
  return {
      share,
      receiver_diameter / (receiver_diameter + Length(group.Extent()) + 1e-9F)};
}

Unknown UnknownByMixed(const GroupSight& sight) {
  constexpr auto kRays = static_cast<float>(kManyPoints * kManyRays);
  return {kUnknownByReceiver * std::sqrt(sight.by_receiver) +
              kStratified * std::sqrt(sight.by_source / kRays) + kUnprovenClear,
          sight.by_receiver / (sight.by_receiver + sight.by_source + 1e-9F)};
}

}  // namespace

uint64_t Refiner::KeyOf(const Receiver& r, uint32_t group) const {
  const uint64_t ends = uint64_t{r.patch} << 32 | kGroupKey | group;
  return MixKey(MixKey(work_.Key(), ends), r.path);
}

void Refiner::VisitGroups(const Cluster& r, uint32_t group, Task* task) const {
  for (uint32_t i = r.first; i < r.first + r.count; ++i) {
    if (task->Meets(i, 1)) {
      DrawGroup(ReceiverAt(i, task), group, 1, task);
    }
  }
}

// Draws the receivers of a cluster for a group, as SamplePairs draws pairs.
void Refiner::SampleGroup(ClusterPair pair,
                          const PairBounds& bounds,
                          Task* task) const {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  RareDraws draws = work_.DrawsOf(pair, bounds, r.count);
  for (; !draws.AtEnd(); draws.Next()) {
    const auto i = r.first + static_cast<uint32_t>(draws.Trial());
    DrawGroup(RootReceiver(receiver_.clusters->Items()[i]),
              pair.source,
              bounds.probability,
              task);
  }
}

// Looks at a group with a probability that the bound by the group's box gives:
// in a hall with many lamps, most pairs are so weak that the box shows it.
// `drawn`: as for AddWeak.
void Refiner::DrawGroup(const Receiver& r,
                        uint32_t group,
                        float drawn,
                        Task* task) const {
  const float form_factor =
      FormFactorOfGroup(GroupAt(group), r.end.center, r.end.radius);
  const float bound = r.weight * SentBy(group).Most() * form_factor;
  const float probability =
      bound < static_cast<float>(options_.tau_weak)
          ? std::min(drawn, work_.WeakProbability(bound, form_factor))
          : drawn;
  Random random(MixKey(KeyOf(r, group), kGroupKey));
  if (random.Next() * static_cast<double>(drawn) <
      static_cast<double>(probability)) {
    VisitGroup(r, {group, 0, probability}, WholeGroup(GroupAt(group)), task);
  }
}

void Refiner::VisitGroup(const Receiver& r,
                         GroupVisit visit,
                         const GroupPart& candidates,
                         Task* task) const {
  const SourceGroup& group = GroupAt(visit.group);
  if (task->out->overflowed || !ReachesInto(r.end, receiver_.part) ||
      !source_.part.Overlaps(group.box)) {
    return;
  }
  GroupTransfer transfer(
      r.end, source_.patches, *source_.groups, group, candidates);
  if (transfer.Facing().count == 0) {
    return;
  }
  const float bound =
      r.weight * SentBy(visit.group).Most() * transfer.FormFactorBound();
  if (visit.drawn < 1 || bound < static_cast<float>(options_.tau_weak)) {
    AddWeakGroup(r, visit, transfer, task);
    return;
  }
  if (blockers_->Separate(ShaftBetween(*r.end.patch, r.end.frame, group.box))) {
    return;
  }
  transfer.Evaluate();
  VisitSeenGroup(r, visit, &transfer, task);
}

// Traces one ray per node, then more from one point per node, then rays from
// several points, until they say enough. `light`: the unoccluded transfer from
// the group, weighted.
Refiner::GroupLook Refiner::TraceGroup(const Receiver& r,
                                       float light,
                                       int blocked,
                                       GroupRays* rays) const {
  GroupLook look;
  look.sight = rays->Look(1, 1);
  look.few = look.sight.Agrees() &&
             FewDecide(light, blocked, static_cast<float>(options_.tau));
  if (!look.few) {
    look.sight = rays->Look(1, kManyRays);
  }
  // If an element mostly faces away, one point per node says little; that is
  // accepted only if little is at stake.
  look.agreed = look.sight.Agrees() &&
                (look.few || 2 * look.sight.points >= r.end.node_count);
  if (!look.agreed) {
    look.sight = rays->Look(kManyPoints, kManyRays);
  }
  return look;
}

// Bounds the error of one link from the group to the receiver.
Refiner::GroupJudgement Refiner::JudgeGroup(const Receiver& r,
                                            const GroupVisit& visit,
                                            const GroupTransfer& transfer,
                                            GroupRays* rays) const {
  const GroupWeight& sent = SentBy(visit.group);
  const auto tau = static_cast<float>(options_.tau);
  const float brightness = r.weight * sent.radiosity;
  const float light = brightness * transfer.FormFactor();
  GroupJudgement judged;
  judged.look = TraceGroup(r, light, visit.blocked, rays);
  const auto& [sight, few, agreed] = judged.look;
  const float visible = sight.fraction;
  judged.is_seen = visible > 0 || rays->SeesPeak();
  const float rough =
      judged.is_seen ? brightness * transfer.Residual(*basis_) : 0.0F;
  const Unknown unknown =
      agreed ? UnknownByAgreed(UnknownShare(visible, few, visit.blocked),
                               r.end.diameter,
                               GroupAt(visit.group).box)
             : UnknownByMixed(sight);
  const float hidden = light * shadows_ * unknown.share;
  judged.by_receiver = rough + unknown.of_receiver * hidden;
  judged.by_source = (1 - unknown.of_receiver) * hidden;
  // A proof costs as much as a kernel, so it is tried only where it decides.
  judged.proven = visible >= 1 && rough <= tau && rough + hidden > tau &&
                  transfer.IsProvenClear(*blockers_);
  if (judged.proven) {
    judged.by_receiver = rough;
    judged.by_source = 0;
  }
  judged.by_source +=
      judged.is_seen ? r.weight * sent.spread * transfer.FormFactor() : 0.0F;
  return judged;
}

// The part of a visit that needs form factors and rays.
void Refiner::VisitSeenGroup(const Receiver& r,
                             GroupVisit visit,
                             GroupTransfer* transfer,
                             Task* task) const {
  GroupRays rays(
      *blockers_, r.end, *transfer, KeyOf(r, visit.group), &task->rays);
  const GroupJudgement judged = JudgeGroup(r, visit, *transfer, &rays);
  visit.blocked += judged.is_seen ? 0 : 1;
  // As in VisitSeen, but a group can always be split.
  const float at_receiver = CanSplit(r.end, r.path) ? judged.by_receiver : 0.0F;
  if (at_receiver + judged.by_source > static_cast<float>(options_.tau)) {
    if (at_receiver >= judged.by_source) {
      SplitGroupReceiver(r, visit, transfer->Facing(), task);
    } else {
      SplitGroup(r, visit, transfer->Facing(), task);
    }
    return;
  }
  if (task->part.Owns(r.level)) {
    KeepGroup(r, visit.group, judged, *transfer, &rays, task);
  }
}

// Makes the link, with as much light at each node as rays let through.
void Refiner::KeepGroup(const Receiver& r,
                        uint32_t group,
                        const GroupJudgement& judged,
                        const GroupTransfer& transfer,
                        GroupRays* rays,
                        Task* task) const {
  const float error = TrueError(r, judged.by_receiver + judged.by_source);
  if (judged.is_seen) {
    AddError(error, task);
  } else {
    AddBlockedError(error, task);
  }
  std::array<float, kTransferNodes> gain = transfer.AtNodes();
  if (!judged.proven) {
    const auto shares = rays->Look(judged.look.few ? 1 : kManyPoints,
                                   judged.look.agreed ? 1 : kManyRays);
    std::transform(gain.begin(),
                   gain.end(),
                   shares.at_nodes.begin(),
                   gain.begin(),
                   std::multiplies<>());
  }
  AcceptGroup(r, group, gain, task);
}

void Refiner::SplitGroupReceiver(const Receiver& r,
                                 GroupVisit visit,
                                 const GroupPart& facing,
                                 Task* task) const {
  for (size_t c = 0; c < kChildren; ++c) {
    if (task->part.Enters(r.level, c)) {
      VisitGroup(ChildReceiver(r, c), visit, facing, task);
    }
  }
}

void Refiner::SplitGroup(const Receiver& r,
                         GroupVisit visit,
                         const GroupPart& facing,
                         Task* task) const {
  const SourceGroup& group = GroupAt(visit.group);
  if (group.child != 0) {
    for (const uint32_t half : {group.child, group.child + 1}) {
      VisitGroup(r, {half, visit.blocked, 1}, WholeGroup(GroupAt(half)), task);
    }
    return;
  }
  const auto patches = source_.groups->PatchesOf(group);
  for (size_t i = 0; i < facing.count; ++i) {
    Visit(r,
          RootSource({patches[facing.members[i]], kRootPath}),
          visit.blocked,
          task);
  }
}

void Refiner::AcceptGroup(const Receiver& r,
                          uint32_t group,
                          const std::array<float, kTransferNodes>& gain,
                          Task* task) const {
  RawLink link{r.patch, group, r.path, kRootPath, LinkKind::kGroup, 0, 0, gain};
  const float mean =
      std::inner_product(gain.begin(), gain.end(), r.end.weight.begin(), 0.0F);
  if (!(mean > 0)) {
    return;
  }
  if (constant_basis_) {
    link.gain.fill(mean);
  }
  AddLink(link, task);
}

// Draws a weak link from a group, as AddWeak does from an element.
void Refiner::AddWeakGroup(const Receiver& r,
                           GroupVisit visit,
                           const GroupTransfer& transfer,
                           Task* task) const {
  if (!task->part.Owns(r.level)) {
    return;
  }
  const float brightness = r.weight * SentBy(visit.group).Most();
  const float probability =
      std::min(visit.drawn,
               work_.WeakProbability(brightness * transfer.FormFactorBound(),
                                     transfer.FormFactorBound()));
  Random random(KeyOf(r, visit.group));
  if (random.Next() * static_cast<double>(visit.drawn) >=
      static_cast<double>(probability)) {
    return;
  }
  const SampledTransfer sample = transfer.Sample(&random);
  if (!(sample.form_factor > 0)) {
    return;
  }
  const float coefficient = sample.form_factor / probability;
  AddPending(
      {{r.patch, visit.group, r.path, kRootPath, LinkKind::kGroup, 0, 0, {}},
       coefficient,
       TrueError(r, brightness * coefficient * std::sqrt(1 - probability))},
      sample.ray,
      task);
}

}  // namespace enfilade
