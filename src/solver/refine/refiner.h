// Refinement: from two patches down to the pairs of elements whose transfer is
// accurate enough to be a link.
//
//   paper          here
//   oracle         JudgeErrors (oracle.h) and what rays leave unknown: error of
//                  the transferred radiosity on the receiver, W/m2 (RMS over
//                  the element); weighed in VisitSeen
//   epsilon        tau: a link is accepted when its error, weighted by the
//                  root of the receiver's area, is at most tau, W/m
//   link           Link, in element paths until ids are given (RawLink)
//
// The error of a link has three parts: what the basis cannot follow on the
// receiver, what the nodes cannot see of the source's radiosity, and occlusion
// that the rays leave unknown. The end that contributes most is split. A
// transfer whose bound is below tau_weak as a whole becomes a weak link: it is
// kept with the probability bound / tau_weak, but at least with its form factor
// bound, and is then divided by that probability. The sum of weak links is
// therefore unbiased, and their number grows with the light and not with the
// square of the number of patches. Nor does the time grow with that square: if
// the bounds of two clusters say that few of their pairs will be kept, those
// few are drawn at once.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/raw_links.h"
#include "solver/refine/refine_side.h"
#include "solver/refine/source_weights.h"
#include "solver/state/work_part.h"
#include "solver/transfer/form_factor.h"
#include "solver/transfer/group_transfer.h"
#include "solver/transfer/link_rays.h"
#include "solver/transfer/oracle.h"
#include "solver/transfer/shaft.h"

#include <array>
#include <cstdint>

namespace enfilade {

// Refines the transfers from one source cell to one receiver cell.
class Refiner {
 public:
  // Trees and blockers are borrowed.
  Refiner(PairWork work, const CellTree& source_tree, const Blockers& blockers);

  [[nodiscard]] size_t ItemCount() const { return work_.Items().size(); }

  // Appends the links of a part of an item. Stops and sets `overflowed` if
  // there are too many links. Thread-safe: writes only to `out` and the limit's
  // counter. The links are the same however much the trees have grown since the
  // cells were balanced.
  void Refine(const WorkPart& part,
              const LinkLimit& limit,
              RawLinks* out) const;

 private:
  struct Source : RadiantEnd {
    uint32_t patch = 0;
    ElementPath path = kRootPath;
    ElementId element;  // this one, or an ancestor without detail
  };

  struct Receiver {
    TransferEnd end;
    uint32_t patch = 0;
    ElementPath path = kRootPath;
    uint32_t level = 0;  // below the element where refinement begins
    float care = 1;      // of its patch
    float weight = 0;    // reflectance times root of area, times care
  };

  // What rays say of a transfer.
  struct Visibility {
    uint16_t bits = 0;   // per pair of nodes
    float fraction = 1;  // weighted by the kernel and the radiosity
    bool proven = false;
    bool few = false;  // four rays sufficed
  };

  // What is known of a transfer before its visibility is looked at.
  struct Sight {
    const Judgement* judgement = nullptr;
    const Shaft* shaft = nullptr;
    int blocked = 0;
  };

  // A weak link that waits for its ray.
  struct PendingLink {
    RawLink link;
    float coefficient = 0;
    float error = 0;  // W/m, if the ray gets through
  };

  struct Task;

  [[nodiscard]] Source RootSource(const ClusterItem& item) const;
  [[nodiscard]] Source ChildSource(const Source& parent, size_t child) const;
  [[nodiscard]] Receiver RootReceiver(const ClusterItem& item) const;
  [[nodiscard]] Receiver ChildReceiver(const Receiver& parent,
                                       size_t child) const;
  [[nodiscard]] std::array<float, kTransferNodes> Pushed(
      const std::array<float, kTransferNodes>& parent,
      PatchShape shape,
      size_t child) const;
  void SetRadiosity(Source* source) const;

  static float PeakOf(const Source& s) {
    return enfilade::PeakOf(s.radiosity, s.detail);
  }

  // Whether both elements reach into the parts of their cells that see the
  // other cell.
  [[nodiscard]] bool MaySee(const Receiver& r, const Source& s) const {
    return !is_partial_ || (ReachesInto(r.end, receiver_.part) &&
                            ReachesInto(s.end, source_.part));
  }

  [[nodiscard]] bool CanSplit(const TransferEnd& end, ElementPath path) const;

  void VisitSources(uint32_t receiver, uint32_t source, Task* task) const;
  void VisitClusters(uint32_t receiver, uint32_t source, Task* task) const;
  void VisitItems(const Cluster& r, const Cluster& s, Task* task) const;
  void DrawItem(const WorkItem& item, Task* task) const;
  void SamplePairs(ClusterPair pair,
                   const PairBounds& bounds,
                   Task* task) const;
  const Receiver& ReceiverAt(uint32_t item, Task* task) const;
  const Source& SourceAt(uint32_t item, Task* task) const;

  // `blocked`: how many of the transfers split on the way here had all of their
  // rays blocked.
  void Visit(const Receiver& r, const Source& s, int blocked, Task* task) const;
  void SplitReceiver(const Receiver& r,
                     const Source& s,
                     int blocked,
                     Task* task) const;
  void SplitSource(const Receiver& r,
                   const Source& s,
                   int blocked,
                   Task* task) const;
  void VisitSeen(const Receiver& r,
                 const Source& s,
                 const Shaft& shaft,
                 int blocked,
                 LinkRays* rays,
                 Task* task) const;

  void AcceptBlocked(const Receiver& r,
                     const Source& s,
                     float error,
                     LinkRays* rays,
                     Task* task) const;

  [[nodiscard]] Visibility Look(const Receiver& r,
                                const Source& s,
                                const Sight& sight,
                                LinkRays* rays) const;
  [[nodiscard]] float NearDetail(const Receiver& r,
                                 const Source& s,
                                 const Judgement& judgement) const;
  [[nodiscard]] float MissedShadow(const Receiver& r,
                                   const Source& s,
                                   float transfer,
                                   const Visibility& look) const;
  // Encodes the coefficients of a link: as scaled quadrature if that is
  // accurate enough, otherwise each coefficient.
  void Encode(const Receiver& r,
              const Source& s,
              const Kernel& kernel,
              RawLink* link,
              Task* task) const;

  // What a weighted error adds to the error of the solution: the error without
  // the receiver's care, and by what the receiver reflects, which is less than
  // its weight says if it is dark. If options_.counts_black is set, all count
  // as their weights say.
  [[nodiscard]] float TrueError(const Receiver& r, float weighted) const {
    const float reflectance = r.end.patch->max_reflectance;
    const float share =
        options_.counts_black
            ? 1.0F
            : std::min(1.0F, reflectance / receiver_.least_reflectance);
    return weighted / r.care * share;
  }

  static void AddLink(const RawLink& link, Task* task);
  static void AddError(float error, Task* task);
  static void AddBlockedError(float error, Task* task);
  void TakeBlocked(Task* task) const;

  // `drawn`: the probability with which the pair was chosen to be looked at.
  void AddWeak(const Receiver& r,
               const Source& s,
               float form_factor_bound,
               float bound,
               float drawn,
               Task* task) const;
  void AddPending(const PendingLink& link, PointPair ray, Task* task) const;
  void FlushWeak(Task* task) const;
  void Accept(const Receiver& r,
              const Source& s,
              const Judgement& judgement,
              uint16_t visible,
              Task* task) const;

  // The members below handle groups: refiner_groups.cpp. GroupLook is what rays
  // say of a transfer from a group.
  struct GroupLook {
    GroupSight sight;
    bool few = false;     // one ray per node sufficed
    bool agreed = false;  // the rays of one point per node agreed
  };

  // What a link from a group would be worth.
  struct GroupJudgement {
    GroupLook look;
    // The bounds of its error that a smaller receiver and a smaller group
    // lower, weighted.
    float by_receiver = 0;
    float by_source = 0;
    bool is_seen = false;  // some of its light arrives
    bool proven = false;   // all of it does
  };

  // What is known of a group when it is visited.
  struct GroupVisit {
    uint32_t group = 0;
    int blocked = 0;  // as in Visit
    // The probability with which the group was chosen to be looked at; below 1
    // only if the transfer is weak.
    float drawn = 1;
  };

  [[nodiscard]] const SourceGroup& GroupAt(uint32_t group) const {
    return source_.groups->All()[group];
  }

  [[nodiscard]] const GroupWeight& SentBy(uint32_t group) const {
    return source_.sent->groups[group];
  }

  [[nodiscard]] uint64_t KeyOf(const Receiver& r, uint32_t group) const;
  void VisitGroups(const Cluster& r, uint32_t group, Task* task) const;
  void SampleGroup(ClusterPair pair,
                   const PairBounds& bounds,
                   Task* task) const;
  void VisitGroup(const Receiver& r,
                  GroupVisit visit,
                  const GroupPart& candidates,
                  Task* task) const;
  [[nodiscard]] GroupLook TraceGroup(const Receiver& r,
                                     float light,
                                     int blocked,
                                     GroupRays* rays) const;
  [[nodiscard]] GroupJudgement JudgeGroup(const Receiver& r,
                                          const GroupVisit& visit,
                                          const GroupTransfer& transfer,
                                          GroupRays* rays) const;
  void KeepGroup(const Receiver& r,
                 uint32_t group,
                 const GroupJudgement& judged,
                 const GroupTransfer& transfer,
                 GroupRays* rays,
                 Task* task) const;
  void VisitSeenGroup(const Receiver& r,
                      GroupVisit visit,
                      GroupTransfer* transfer,
                      Task* task) const;
  void SplitGroupReceiver(const Receiver& r,
                          GroupVisit visit,
                          const GroupPart& facing,
                          Task* task) const;
  void SplitGroup(const Receiver& r,
                  GroupVisit visit,
                  const GroupPart& facing,
                  Task* task) const;
  void DrawGroup(const Receiver& r,
                 uint32_t group,
                 float drawn,
                 Task* task) const;
  void AddWeakGroup(const Receiver& r,
                    GroupVisit visit,
                    const GroupTransfer& transfer,
                    Task* task) const;
  void AcceptGroup(const Receiver& r,
                   uint32_t group,
                   const std::array<float, kTransferNodes>& gain,
                   Task* task) const;

  static RawLink LinkBetween(const Receiver& r, const Source& s);
  [[nodiscard]] uint64_t KeyOf(const Receiver& r, const Source& s) const;

  PairWork work_;
  RefineOptions options_;  // copied from the work, as are the sides
  RefineSide receiver_;
  RefineSide source_;  // with its tree, which the work does not need
  const Blockers* blockers_;
  const Basis* basis_;
  float shadows_;  // weight of unknown occlusion, by order
  bool constant_basis_;
  bool is_partial_;  // the cells see only parts of each other
};

}  // namespace enfilade
