// Goes from an item of work down to the pairs of elements at which refinement
// begins, or draws the few pairs that are kept among many.

#pragma once

#include "solver/refine/element_refiner.h"
#include "solver/refine/group_refiner.h"
#include "solver/refine/link_sink.h"
#include "solver/refine/pair_context.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/receiver_element.h"
#include "solver/refine/slots.h"
#include "solver/refine/source_elements.h"
#include "solver/state/work_part.h"
#include "solver/transfer/cluster_tree.h"

#include <cstdint>

namespace enfilade {

// For one part of the work; makes the links of this part alone.
class ClusterRefiner {
 public:
  // All but the part are borrowed.
  ClusterRefiner(const PairContext& pair, const WorkPart& part, LinkSink* sink);

  // Makes the links of the part, whose item must be this one. Visit is for an
  // item that is not drawn, Draw for one that is; the part is then all of it.
  void Visit(const WorkItem& item);
  void Draw(const WorkItem& item);

 private:
  void VisitSources(ClusterPair pair);
  void VisitClusters(ClusterPair pair);
  void VisitItems(const Cluster& r, const Cluster& s);
  void VisitGroup(const Cluster& r, uint32_t group);
  void DrawPairs(ClusterPair pair, const PairBounds& bounds);
  void DrawGroup(ClusterPair pair, const PairBounds& bounds);

  void BeginSources(const Cluster& s);
  [[nodiscard]] bool InPart(uint32_t first, uint32_t count) const;
  [[nodiscard]] bool InGroup(uint32_t source_item) const;

  // Elements of items, by the index of the item. ReceiverAt takes one of the
  // item of work's receivers, SourceAt one of the current sources.
  [[nodiscard]] ReceiverElement MakeReceiver(uint32_t item) const;
  [[nodiscard]] SourceElement MakeSource(uint32_t item) const;
  const ReceiverElement& ReceiverAt(uint32_t item);
  const SourceElement& SourceAt(uint32_t item);

  [[nodiscard]] const Cluster& ReceiverCluster(uint32_t index) const {
    return pair_->Receiver().clusters->Clusters()[index];
  }

  [[nodiscard]] const Cluster& SourceCluster(uint32_t index) const {
    return pair_->Source().clusters->Clusters()[index];
  }

  const PairContext* pair_;
  WorkPart part_;
  LinkSink* sink_;
  ElementRefiner elements_;
  GroupRefiner groups_;
  // The item's receivers and its current sources, made when first asked for.
  uint32_t first_receiver_;
  uint32_t first_source_ = 0;
  Slots<ReceiverElement, kItemReceivers> receivers_;
  Slots<SourceElement, kItemSources> sources_;
};

}  // namespace enfilade
