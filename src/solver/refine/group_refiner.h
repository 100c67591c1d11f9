// Refines transfers from groups of patches to elements, down to links.

#pragma once

#include "solver/refine/element_refiner.h"
#include "solver/refine/link_sink.h"
#include "solver/refine/pair_context.h"
#include "solver/refine/receiver_element.h"
#include "solver/refine/source_weights.h"
#include "solver/refine/weak_draw.h"
#include "solver/state/work_part.h"
#include "solver/transfer/form_factor.h"
#include "solver/transfer/group_transfer.h"
#include "solver/transfer/source_group.h"

#include <array>
#include <cstdint>

namespace enfilade {

// For one part of the work; makes the links of this part alone.
class GroupRefiner {
 public:
  // All but the part are borrowed.
  GroupRefiner(const PairContext& pair, const WorkPart& part, LinkSink* sink)
      : pair_(&pair), part_(part), sink_(sink), elements_(pair, part, sink) {}

  // Makes the links from the group to the receiver or to elements below it.
  // `drawn`: as WeakBounds::drawn.
  void Draw(const ReceiverElement& r, uint32_t group, float drawn);

 private:
  // What is known of a group when it is visited.
  struct GroupVisit {
    uint32_t group = 0;
    int blocked = 0;  // as in ElementRefiner::Visit
    float drawn = 1;  // below 1 only if the transfer is weak
  };

  // What rays say of a transfer.
  struct GroupLook {
    GroupSight sight;
    bool few = false;     // one ray per node sufficed
    bool agreed = false;  // the rays of one point per node agreed
  };

  // What a link would be worth.
  struct GroupJudgement {
    GroupLook look;
    // The bounds of its error that a smaller receiver and a smaller group
    // lower, weighted.
    float by_receiver = 0;
    float by_source = 0;
    bool is_seen = false;  // some of its light arrives
    bool proven = false;   // all of it does
  };

  void Visit(const ReceiverElement& r,
             GroupVisit visit,
             const GroupPart& candidates);
  void VisitSeen(const ReceiverElement& r,
                 GroupVisit visit,
                 const GroupTransfer& transfer);
  void SplitReceiver(const ReceiverElement& r,
                     GroupVisit visit,
                     const GroupPart& facing);
  void SplitGroup(const ReceiverElement& r,
                  GroupVisit visit,
                  const GroupPart& facing);

  [[nodiscard]] GroupLook Look(const ReceiverElement& r,
                               float light,
                               int blocked,
                               GroupRays* rays) const;
  [[nodiscard]] GroupJudgement Judge(const ReceiverElement& r,
                                     const GroupVisit& visit,
                                     const GroupTransfer& transfer,
                                     GroupRays* rays) const;

  void Keep(const ReceiverElement& r,
            uint32_t group,
            const GroupJudgement& judged,
            const GroupTransfer& transfer,
            GroupRays* rays);
  void Accept(const ReceiverElement& r,
              uint32_t group,
              const std::array<float, kTransferNodes>& gain);
  void DrawWeak(const ReceiverElement& r,
                GroupVisit visit,
                const GroupTransfer& transfer);

  [[nodiscard]] uint64_t KeyOf(const ReceiverElement& r, uint32_t group) const;

  [[nodiscard]] const SourceGroup& GroupAt(uint32_t group) const {
    return pair_->Source().groups->All()[group];
  }

  [[nodiscard]] const GroupWeight& SentBy(uint32_t group) const {
    return pair_->Source().sent->groups[group];
  }

  // The most that the group sends, weighted by the receiver, W/m.
  [[nodiscard]] float BrightnessOf(const ReceiverElement& r,
                                   uint32_t group) const {
    return r.weight * SentBy(group).Most();
  }

  const PairContext* pair_;
  WorkPart part_;
  LinkSink* sink_;
  // For the patches of groups that are too close or too uneven to count as one.
  ElementRefiner elements_;
};

}  // namespace enfilade
