#include "solver/refine/refiner.h"

#include "base/random.h"
#include "solver/refine/refiner_task.h"
#include "solver/refine/unknown_share.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

// Sixteen rays miss a shadow that covers more than this share of the receiver
// only one time in ten.
constexpr float kMostMissed = 0.125F;
// On the larger elements of higher-order bases, shadows cost more than rays
// tell. Measured: docs/decisions/0017-higher-orders.md.
constexpr std::array<float, 5> kShadowsOfOrder = {1, 1, 1, 1.25F, 1.4F};

}  // namespace

Refiner::Refiner(PairWork work,
                 const CellTree& source_tree,
                 const Blockers& blockers)
    : work_(std::move(work)),
      options_(work_.Options()),
      receiver_(work_.Receiver()),
      source_(work_.Source()),
      blockers_(&blockers),
      basis_(receiver_.tree->Shape().basis),
      shadows_(basis_->kind.flat ? 1 : kShadowsOfOrder[basis_->kind.order]),
      constant_basis_(receiver_.tree->Shape().NodeStride() == 1),
      is_partial_(!receiver_.part.IsEverything() ||
                  !source_.part.IsEverything()) {
  source_.tree = &source_tree;
}

uint64_t Refiner::KeyOf(const Receiver& r, const Source& s) const {
  const uint64_t patches = uint64_t{r.patch} << 32 | s.patch;
  return MixKey(MixKey(MixKey(work_.Key(), patches), r.path), s.path);
}

void Refiner::Visit(const Receiver& r,
                    const Source& s,
                    int blocked,
                    Task* task) const {
  if (task->out->overflowed || !MaySee(r, s) || IsBehind(s.end, *r.end.patch) ||
      IsBehind(r.end, *s.end.patch)) {
    return;
  }
  const float form_factor = FormFactorBound(r.end, s.end);
  const float bound = r.weight * PeakOf(s) * form_factor;
  if (bound < static_cast<float>(options_.tau_weak)) {
    AddWeak(r, s, form_factor, bound, 1, task);
    return;
  }
  const Shaft shaft =
      ShaftBetween(*r.end.patch, r.end.frame, *s.end.patch, s.end.frame);
  if (blockers_->Separate(shaft)) {
    return;
  }
  LinkRays rays(*blockers_, r.end, s.end, KeyOf(r, s), &task->rays);
  if (FewDecide(bound, blocked, static_cast<float>(options_.tau))) {
    rays.TraceFew();
    if (rays.NoneSeen() && !rays.SeesPeak()) {
      AcceptBlocked(r, s, bound * UnknownBlocked(true, blocked), &rays, task);
      return;
    }
  }
  VisitSeen(r, s, shaft, blocked, &rays, task);
}

// The part of a visit that needs the kernel.
void Refiner::VisitSeen(const Receiver& r,
                        const Source& s,
                        const Shaft& shaft,
                        int blocked,
                        LinkRays* rays,
                        Task* task) const {
  Judgement judgement = JudgeTransfer(r.end, s);
  const Visibility look = Look(r, s, {&judgement, &shaft, blocked}, rays);
  const float unknown =
      look.proven ? 0
                  : judgement.transfer * shadows_ *
                        UnknownShare(look.fraction, look.few, blocked);
  const bool is_seen = look.fraction > 0 || rays->SeesPeak();
  float error_at_receiver = 0;
  float error_at_source = 0;
  if (is_seen) {
    JudgeErrors(r.end, s, *basis_, &judgement);
    error_at_receiver = judgement.receiver_error;
    error_at_source =
        std::max(judgement.source_error, NearDetail(r, s, judgement));
  }
  blocked += is_seen ? 0 : 1;
  const float share = ReceiverShare(look.bits, r.end, s.end);
  const float missed = judgement.transfer * shadows_ *
                       MissedShadow(r, s, judgement.transfer, look);
  const float by_receiver = error_at_receiver + share * unknown + missed;
  const float by_source = error_at_source + (1 - share) * unknown;
  // An end that cannot be split does not count: splitting the other end instead
  // would only make more links with the same error together.
  const float at_receiver = CanSplit(r.end, r.path) ? by_receiver : 0;
  const float at_source = CanSplit(s.end, s.path) ? by_source : 0;
  if (r.weight * (at_receiver + at_source) > static_cast<float>(options_.tau)) {
    if (at_receiver >= at_source) {
      SplitReceiver(r, s, blocked, task);
    } else {
      SplitSource(r, s, blocked, task);
    }
    return;
  }
  if (!task->part.Owns(r.level)) {
    return;
  }
  const float error = r.weight * (by_receiver + by_source);
  if (is_seen) {
    AddError(TrueError(r, error), task);
  } else {
    AddBlockedError(TrueError(r, error), task);
  }
  const uint16_t bits = look.proven ? look.bits
                        : look.few  ? rays->AskFewAnew()
                                    : rays->AskAllAnew();
  Accept(r, s, judgement, bits, task);
}

// Accepts a transfer whose first four rays are all blocked. The link gets its
// visibility from new rays, which may get through.
void Refiner::AcceptBlocked(const Receiver& r,
                            const Source& s,
                            float error,
                            LinkRays* rays,
                            Task* task) const {
  if (!task->part.Owns(r.level)) {
    return;
  }
  AddBlockedError(TrueError(r, error), task);
  const uint16_t bits = rays->AskFewAnew();
  if (bits != 0) {
    Accept(r, s, JudgeTransfer(r.end, s), bits, task);
  }
}

// The share of the unoccluded transfer that shadows may hide if all rays got
// through, by the outlines of blockers, beyond what counts as unknown anyway.
// The outlines are looked at only if the result could force a split by itself.
float Refiner::MissedShadow(const Receiver& r,
                            const Source& s,
                            float transfer,
                            const Visibility& look) const {
  if (look.proven || look.few || look.fraction < 1 ||
      r.weight * transfer * shadows_ * MixedShare(kMostMissed) <=
          static_cast<float>(options_.tau)) {
    return 0;
  }
  const float hidden =
      blockers_->SumOfShadows(CastShadow(r.end, s.end.center), kMostMissed);
  return std::max(0.0F, MixedShare(hidden) - kUnprovenClear);
}

void Refiner::SplitReceiver(const Receiver& r,
                            const Source& s,
                            int blocked,
                            Task* task) const {
  for (size_t c = 0; c < kChildren; ++c) {
    if (task->part.Enters(r.level, c)) {
      Visit(ChildReceiver(r, c), s, blocked, task);
    }
  }
}

void Refiner::SplitSource(const Receiver& r,
                          const Source& s,
                          int blocked,
                          Task* task) const {
  for (size_t c = 0; c < kChildren; ++c) {
    Visit(r, ChildSource(s, c), blocked, task);
  }
}

// ------------------------------------------------------------- the visibility

Refiner::Visibility Refiner::Look(const Receiver& r,
                                  const Source& s,
                                  const Sight& sight,
                                  LinkRays* rays) const {
  Visibility look;
  look.proven = blockers_->LeaveEmpty(*sight.shaft);
  if (look.proven) {
    look.bits = AllPairs(r.end, s.end);
    return look;
  }
  rays->TraceFew();
  look.few = rays->Agree() && FewDecide(r.weight * sight.judgement->transfer,
                                        sight.blocked,
                                        static_cast<float>(options_.tau));
  if (look.few) {
    look.bits = rays->NoneSeen() ? uint16_t{0} : AllPairs(r.end, s.end);
    look.fraction = rays->NoneSeen() ? 0.0F : 1.0F;
    return look;
  }
  rays->TraceAll();
  look.bits = rays->Seen();
  float all = 0;
  float visible = 0;
  for (size_t bit = 0; bit < sight.judgement->kernel.size(); ++bit) {
    const float share =
        sight.judgement->kernel[bit] * s.radiosity[bit % kTransferNodes] +
        1e-20F;
    all += (rays->Traced() >> bit & 1) != 0 ? share : 0;
    visible += (rays->Seen() >> bit & 1) != 0 ? share : 0;
  }
  look.fraction = rays->Traced() == 0 ? 1.0F : visible / all;
  return look;
}

}  // namespace enfilade
