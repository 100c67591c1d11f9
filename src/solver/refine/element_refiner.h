// Refines transfers from element to element, down to links.
//
//   paper          here
//   oracle         JudgeErrors (oracle.h) and what rays leave unknown
//                  (unknown_share.h): BoundErrors
//   epsilon        tau: a link is accepted when its error, weighted by the
//                  root of the receiver's area, is at most tau, W/m
//
// The error of a link has three parts: what the basis cannot follow on the
// receiver, what the nodes cannot see of the source's radiosity, and occlusion
// that the rays leave unknown. The end that contributes most is split.

#pragma once

#include "solver/refine/link_sink.h"
#include "solver/refine/pair_context.h"
#include "solver/refine/receiver_element.h"
#include "solver/refine/source_elements.h"
#include "solver/refine/weak_draw.h"
#include "solver/state/work_part.h"
#include "solver/transfer/link_rays.h"
#include "solver/transfer/oracle.h"
#include "solver/transfer/shaft.h"

#include <cstdint>

namespace enfilade {

// For one part of the work; makes the links of this part alone.
class ElementRefiner {
 public:
  // All but the part are borrowed.
  ElementRefiner(const PairContext& pair, const WorkPart& part, LinkSink* sink)
      : pair_(&pair), part_(part), sink_(sink) {}

  // Makes the links between the two elements or elements below them. `blocked`:
  // how many of the transfers split on the way here had all of their rays
  // blocked.
  void Visit(const ReceiverElement& r, const SourceElement& s, int blocked);

  // Makes one weak link or none.
  void DrawWeak(const ReceiverElement& r,
                const SourceElement& s,
                const WeakBounds& bounds);

 private:
  // What rays say of a transfer.
  struct Visibility {
    uint16_t bits = 0;   // per pair of nodes
    float fraction = 1;  // weighted by the kernel and the radiosity
    bool proven = false;
    bool few = false;  // four rays sufficed
    bool is_seen = true;
  };

  // What is known of a transfer before its visibility is looked at.
  struct Sight {
    const Judgement* judgement = nullptr;
    const ShaftEnds* ends = nullptr;
    int blocked = 0;
  };

  // Bounds of the error that a smaller receiver and a smaller source lower,
  // W/m2 of irradiance.
  struct ErrorBounds {
    float by_receiver = 0;
    float by_source = 0;
  };

  void VisitSeen(const ReceiverElement& r,
                 const SourceElement& s,
                 const ShaftEnds& ends,
                 int blocked,
                 LinkRays* rays);
  void SplitReceiver(const ReceiverElement& r,
                     const SourceElement& s,
                     int blocked);
  void SplitSource(const ReceiverElement& r,
                   const SourceElement& s,
                   int blocked);

  [[nodiscard]] Visibility Look(const ReceiverElement& r,
                                const SourceElement& s,
                                const Sight& sight,
                                LinkRays* rays) const;
  [[nodiscard]] ErrorBounds BoundErrors(const ReceiverElement& r,
                                        const SourceElement& s,
                                        const Visibility& look,
                                        int blocked,
                                        Judgement* judgement) const;
  [[nodiscard]] float NearDetail(const ReceiverElement& r,
                                 const SourceElement& s,
                                 const Judgement& judgement) const;
  [[nodiscard]] float MissedShadow(const ReceiverElement& r,
                                   const SourceElement& s,
                                   float transfer,
                                   const Visibility& look) const;

  void AcceptBlocked(const ReceiverElement& r,
                     const SourceElement& s,
                     float error,
                     LinkRays* rays);
  void Accept(const ReceiverElement& r,
              const SourceElement& s,
              const Judgement& judgement,
              uint16_t visible);
  void MakeNear(const ReceiverElement& r,
                const SourceElement& s,
                const Kernel& kernel,
                RawLink* link);

  [[nodiscard]] uint64_t KeyOf(const ReceiverElement& r,
                               const SourceElement& s) const;

  const PairContext* pair_;
  WorkPart part_;
  LinkSink* sink_;
};

}  // namespace enfilade
