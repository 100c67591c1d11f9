#include "solver/refine/group_refiner.h"

#include "base/random.h"
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

uint64_t GroupRefiner::KeyOf(const ReceiverElement& r, uint32_t group) const {
  const uint64_t ends = uint64_t{r.patch} << 32 | kGroupKey | group;
  return MixKey(MixKey(pair_->work.Key(), ends), r.path);
}

// Looks at a group with a probability that the bound by the group's box gives:
// in a hall with many lamps, most pairs are so weak that the box shows it.
void GroupRefiner::Draw(const ReceiverElement& r, uint32_t group, float drawn) {
  const float form_factor =
      FormFactorOfGroup(GroupAt(group), r.end.center, r.end.radius);
  const WeakDraw draw(*pair_,
                      {BrightnessOf(r, group), form_factor, drawn},
                      MixKey(KeyOf(r, group), kGroupKey));
  if (draw.IsKept()) {
    Visit(r, {group, 0, draw.Probability()}, WholeGroup(GroupAt(group)));
  }
}

void GroupRefiner::Visit(const ReceiverElement& r,
                         GroupVisit visit,
                         const GroupPart& candidates) {
  const SourceGroup& group = GroupAt(visit.group);
  if (sink_->Overflowed() || !ReachesInto(r.end, pair_->Receiver().part) ||
      !pair_->Source().part.Overlaps(group.box)) {
    return;
  }
  GroupTransfer transfer(r.end,
                         pair_->Source().patches,
                         *pair_->Source().groups,
                         group,
                         candidates);
  if (transfer.Facing().count == 0) {
    return;
  }
  const float bound = BrightnessOf(r, visit.group) * transfer.FormFactorBound();
  if (visit.drawn < 1 || bound < pair_->tau_weak) {
    DrawWeak(r, visit, transfer);
    return;
  }
  if (pair_->blockers->Separate(EndsOf(*r.end.patch, r.end.frame, group.box))) {
    return;
  }
  transfer.Evaluate();
  VisitSeen(r, visit, transfer);
}

// Traces one ray per node, then more from one point per node, then rays from
// several points, until they say enough. `light`: the unoccluded transfer from
// the group, weighted.
GroupRefiner::GroupLook GroupRefiner::Look(const ReceiverElement& r,
                                           float light,
                                           int blocked,
                                           GroupRays* rays) const {
  GroupLook look;
  look.sight = rays->Look(1, 1);
  look.few = look.sight.Agrees() && FewDecide(light, blocked, pair_->tau);
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
GroupRefiner::GroupJudgement GroupRefiner::Judge(const ReceiverElement& r,
                                                 const GroupVisit& visit,
                                                 const GroupTransfer& transfer,
                                                 GroupRays* rays) const {
  const GroupWeight& sent = SentBy(visit.group);
  const float tau = pair_->tau;
  const float brightness = r.weight * sent.radiosity;
  const float light = brightness * transfer.FormFactor();
  GroupJudgement judged;
  judged.look = Look(r, light, visit.blocked, rays);
  const auto& [sight, few, agreed] = judged.look;
  const float visible = sight.fraction;
  judged.is_seen = visible > 0 || rays->SeesPeak();
  const float rough =
      judged.is_seen ? brightness * transfer.Residual(*pair_->basis) : 0.0F;
  const Unknown unknown =
      agreed ? UnknownByAgreed(UnknownShare(visible, few, visit.blocked),
                               r.end.diameter,
                               GroupAt(visit.group).box)
             : UnknownByMixed(sight);
  const float hidden = light * pair_->shadows * unknown.share;
  judged.by_receiver = rough + unknown.of_receiver * hidden;
  judged.by_source = (1 - unknown.of_receiver) * hidden;
  // A proof costs as much as a kernel, so it is tried only where it decides.
  judged.proven = visible >= 1 && rough <= tau && rough + hidden > tau &&
                  transfer.IsProvenClear(*pair_->blockers);
  if (judged.proven) {
    judged.by_receiver = rough;
    judged.by_source = 0;
  }
  judged.by_source +=
      judged.is_seen ? r.weight * sent.spread * transfer.FormFactor() : 0.0F;
  return judged;
}

// The part of a visit that needs form factors and rays.
void GroupRefiner::VisitSeen(const ReceiverElement& r,
                             GroupVisit visit,
                             const GroupTransfer& transfer) {
  GroupRays rays(
      *pair_->blockers, r.end, transfer, KeyOf(r, visit.group), sink_->Rays());
  const GroupJudgement judged = Judge(r, visit, transfer, &rays);
  visit.blocked += judged.is_seen ? 0 : 1;
  // As in ElementRefiner::VisitSeen, but a group can always be split.
  const float at_receiver =
      pair_->CanSplit(r.end, r.path) ? judged.by_receiver : 0.0F;
  if (at_receiver + judged.by_source > pair_->tau) {
    if (at_receiver >= judged.by_source) {
      SplitReceiver(r, visit, transfer.Facing());
    } else {
      SplitGroup(r, visit, transfer.Facing());
    }
    return;
  }
  if (part_.Owns(r.level)) {
    Keep(r, visit.group, judged, transfer, &rays);
  }
}

// Makes the link, with as much light at each node as rays let through.
void GroupRefiner::Keep(const ReceiverElement& r,
                        uint32_t group,
                        const GroupJudgement& judged,
                        const GroupTransfer& transfer,
                        GroupRays* rays) {
  const float error =
      pair_->TrueError(r, judged.by_receiver + judged.by_source);
  sink_->AddError(error, judged.is_seen);
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
  Accept(r, group, gain);
}

void GroupRefiner::SplitReceiver(const ReceiverElement& r,
                                 GroupVisit visit,
                                 const GroupPart& facing) {
  for (size_t c = 0; c < kChildren; ++c) {
    if (part_.Enters(r.level, c)) {
      Visit(ChildReceiver(r, c), visit, facing);
    }
  }
}

void GroupRefiner::SplitGroup(const ReceiverElement& r,
                              GroupVisit visit,
                              const GroupPart& facing) {
  const SourceGroup& group = GroupAt(visit.group);
  if (group.child != 0) {
    for (const uint32_t half : {group.child, group.child + 1}) {
      Visit(r, {half, visit.blocked, 1}, WholeGroup(GroupAt(half)));
    }
    return;
  }
  const auto patches = pair_->Source().groups->PatchesOf(group);
  for (size_t i = 0; i < facing.count; ++i) {
    elements_.Visit(
        r, pair_->sources.OfPatch(patches[facing.members[i]]), visit.blocked);
  }
}

void GroupRefiner::Accept(const ReceiverElement& r,
                          uint32_t group,
                          const std::array<float, kTransferNodes>& gain) {
  RawLink link{r.patch, group, r.path, kRootPath, LinkKind::kGroup, 0, 0, gain};
  const float mean = std::inner_product(
      gain.begin(), gain.end(), r.end.nodes.weight.begin(), 0.0F);
  if (!(mean > 0)) {
    return;
  }
  if (pair_->constant_basis) {
    link.gain.fill(mean);
  }
  sink_->Add(link);
}

void GroupRefiner::DrawWeak(const ReceiverElement& r,
                            GroupVisit visit,
                            const GroupTransfer& transfer) {
  if (!part_.Owns(r.level)) {
    return;
  }
  WeakDraw draw(
      *pair_,
      {BrightnessOf(r, visit.group), transfer.FormFactorBound(), visit.drawn},
      KeyOf(r, visit.group));
  if (draw.IsKept()) {
    draw.Add(
        {r.patch, visit.group, r.path, kRootPath, LinkKind::kGroup, 0, 0, {}},
        r,
        transfer.Sample(draw.Numbers()),
        sink_);
  }
}

}  // namespace enfilade
