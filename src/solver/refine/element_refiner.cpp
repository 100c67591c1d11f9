#include "solver/refine/element_refiner.h"

#include "base/random.h"
#include "solver/refine/near_code.h"
#include "solver/refine/unknown_share.h"
#include "solver/transfer/cast_shadow.h"
#include "solver/transfer/transfer_sample.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

// Sixteen rays miss a shadow that covers more than this share of the receiver
// only one time in ten.
constexpr float kMostMissed = 0.125F;
// Concentrated detail is looked for only if this multiple of the source's
// detail could reach tau.
constexpr float kMostConcentration = 16;
// The error that quadrature scaled to the true sum may add to a near link, as a
// share of tau.
constexpr float kRebuiltShare = 0.03125F;

RawLink LinkBetween(const ReceiverElement& r, const SourceElement& s) {
  return {r.patch, s.patch, r.path, s.path, LinkKind::kWeak, 0, 0, {}};
}

bool FaceEachOther(const ReceiverElement& r, const SourceElement& s) {
  return !IsBehind(s.end, *r.end.patch) && !IsBehind(r.end, *s.end.patch);
}

// The share of the light that gets through, by the rays between nodes.
float SeenFraction(const Judgement& judgement,
                   const SourceElement& s,
                   const LinkRays& rays) {
  float all = 0;
  float visible = 0;
  for (size_t bit = 0; bit < judgement.kernel.size(); ++bit) {
    const float share =
        judgement.kernel[bit] * s.radiosity[bit % kTransferNodes] + 1e-20F;
    all += (rays.Traced() >> bit & 1) != 0 ? share : 0;
    visible += (rays.Seen() >> bit & 1) != 0 ? share : 0;
  }
  return rays.Traced() == 0 ? 1.0F : visible / all;
}

}  // namespace

uint64_t ElementRefiner::KeyOf(const ReceiverElement& r,
                               const SourceElement& s) const {
  const uint64_t patches = uint64_t{r.patch} << 32 | s.patch;
  return MixKey(MixKey(MixKey(pair_->work.Key(), patches), r.path), s.path);
}

// ------------------------------------------------------------- the recursion

void ElementRefiner::Visit(const ReceiverElement& r,
                           const SourceElement& s,
                           int blocked) {
  if (sink_->Overflowed() || !pair_->MaySee(r.end, s.end) ||
      !FaceEachOther(r, s)) {
    return;
  }
  const float form_factor = FormFactorBound(r.end, s.end);
  const float brightness = r.weight * PeakOf(s);
  const float bound = brightness * form_factor;
  if (bound < pair_->tau_weak) {
    DrawWeak(r, s, {brightness, form_factor});
    return;
  }
  const ShaftEnds ends =
      EndsOf(*r.end.patch, r.end.frame, *s.end.patch, s.end.frame);
  if (pair_->blockers->Separate(ends)) {
    return;
  }
  LinkRays rays(*pair_->blockers, r.end, s.end, KeyOf(r, s), sink_->Rays());
  if (FewDecide(bound, blocked, pair_->tau)) {
    rays.TraceFew();
    if (rays.NoneSeen() && !rays.SeesPeak()) {
      AcceptBlocked(r, s, bound * UnknownBlocked(true, blocked), &rays);
      return;
    }
  }
  VisitSeen(r, s, ends, blocked, &rays);
}

// The part of a visit that needs the kernel.
void ElementRefiner::VisitSeen(const ReceiverElement& r,
                               const SourceElement& s,
                               const ShaftEnds& ends,
                               int blocked,
                               LinkRays* rays) {
  Judgement judgement = JudgeTransfer(r.end, s);
  const Visibility look = Look(r, s, {&judgement, &ends, blocked}, rays);
  const ErrorBounds bounds = BoundErrors(r, s, look, blocked, &judgement);
  // An end that cannot be split does not count: splitting the other end instead
  // would only make more links with the same error together.
  const float at_receiver =
      pair_->CanSplit(r.end, r.path) ? bounds.by_receiver : 0;
  const float at_source = pair_->CanSplit(s.end, s.path) ? bounds.by_source : 0;
  if (r.weight * (at_receiver + at_source) > pair_->tau) {
    blocked += look.is_seen ? 0 : 1;
    if (at_receiver >= at_source) {
      SplitReceiver(r, s, blocked);
    } else {
      SplitSource(r, s, blocked);
    }
    return;
  }
  if (!part_.Owns(r.level)) {
    return;
  }
  const float error =
      pair_->TrueError(r, r.weight * (bounds.by_receiver + bounds.by_source));
  sink_->AddError(error, look.is_seen);
  const uint16_t bits = look.proven ? look.bits
                        : look.few  ? rays->AskFewAnew()
                                    : rays->AskAllAnew();
  Accept(r, s, judgement, bits);
}

void ElementRefiner::SplitReceiver(const ReceiverElement& r,
                                   const SourceElement& s,
                                   int blocked) {
  for (size_t c = 0; c < kChildren; ++c) {
    if (part_.Enters(r.level, c)) {
      Visit(ChildReceiver(r, c), s, blocked);
    }
  }
}

void ElementRefiner::SplitSource(const ReceiverElement& r,
                                 const SourceElement& s,
                                 int blocked) {
  for (size_t c = 0; c < kChildren; ++c) {
    Visit(r, pair_->sources.OfChild(s, c), blocked);
  }
}

// --------------------------------------------------- visibility and errors

ElementRefiner::Visibility ElementRefiner::Look(const ReceiverElement& r,
                                                const SourceElement& s,
                                                const Sight& sight,
                                                LinkRays* rays) const {
  Visibility look;
  look.proven = pair_->blockers->LeaveEmpty(*sight.ends);
  if (look.proven) {
    look.bits = AllPairs(r.end, s.end);
    return look;
  }
  rays->TraceFew();
  look.few = rays->Agree() && FewDecide(r.weight * sight.judgement->transfer,
                                        sight.blocked,
                                        pair_->tau);
  if (look.few) {
    look.bits = rays->NoneSeen() ? uint16_t{0} : AllPairs(r.end, s.end);
    look.fraction = rays->NoneSeen() ? 0.0F : 1.0F;
  } else {
    rays->TraceAll();
    look.bits = rays->Seen();
    look.fraction = SeenFraction(*sight.judgement, s, *rays);
  }
  look.is_seen = look.fraction > 0 || rays->SeesPeak();
  return look;
}

// Bounds the error of one link from the source to the receiver. Adds the
// oracle's errors to the judgement if light arrives at all.
ElementRefiner::ErrorBounds ElementRefiner::BoundErrors(
    const ReceiverElement& r,
    const SourceElement& s,
    const Visibility& look,
    int blocked,
    Judgement* judgement) const {
  ErrorBounds bounds;
  if (look.is_seen) {
    JudgeErrors(r.end, s, *pair_->basis, judgement);
    bounds.by_receiver = judgement->receiver_error;
    bounds.by_source =
        std::max(judgement->source_error, NearDetail(r, s, *judgement));
  }
  const float hidden = judgement->transfer * pair_->shadows;
  const float unknown =
      look.proven ? 0 : hidden * UnknownShare(look.fraction, look.few, blocked);
  const float share = ReceiverShare(look.bits, r.end, s.end);
  bounds.by_receiver += share * unknown;
  bounds.by_receiver += hidden * MissedShadow(r, s, judgement->transfer, look);
  bounds.by_source += (1 - share) * unknown;
  return bounds;
}

// Concentrated detail costs many form factors, so it is looked for only where
// it could decide.
float ElementRefiner::NearDetail(const ReceiverElement& r,
                                 const SourceElement& s,
                                 const Judgement& judgement) const {
  if (!judgement.near ||
      r.weight * judgement.form_factor * s.detail * kMostConcentration <
          pair_->tau) {
    return 0;
  }
  return pair_->sources.NearestError(s, r.end, judgement.form_factor);
}

// The share of the unoccluded transfer that shadows may hide if all rays got
// through, by the outlines of blockers, beyond what counts as unknown anyway.
// The outlines are looked at only if the result could force a split by itself.
float ElementRefiner::MissedShadow(const ReceiverElement& r,
                                   const SourceElement& s,
                                   float transfer,
                                   const Visibility& look) const {
  if (look.proven || look.few || look.fraction < 1 ||
      r.weight * transfer * pair_->shadows * MixedShare(kMostMissed) <=
          pair_->tau) {
    return 0;
  }
  const float hidden = pair_->blockers->SumOfShadows(
      CastShadow(r.end, s.end.center), kMostMissed);
  return std::max(0.0F, MixedShare(hidden) - kUnprovenClear);
}

// ----------------------------------------------------------------- the links

// Accepts a transfer whose first four rays are all blocked. The link gets its
// visibility from new rays, which may get through.
void ElementRefiner::AcceptBlocked(const ReceiverElement& r,
                                   const SourceElement& s,
                                   float error,
                                   LinkRays* rays) {
  if (!part_.Owns(r.level)) {
    return;
  }
  sink_->AddError(pair_->TrueError(r, error), false);
  const uint16_t bits = rays->AskFewAnew();
  if (bits != 0) {
    Accept(r, s, JudgeTransfer(r.end, s), bits);
  }
}

void ElementRefiner::Accept(const ReceiverElement& r,
                            const SourceElement& s,
                            const Judgement& judgement,
                            uint16_t visible) {
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
  if (pair_->constant_basis) {
    const float mean = std::inner_product(
        link.gain.begin(), link.gain.end(), r.end.nodes.weight.begin(), 0.0F);
    link.gain.fill(mean);
    link.kind = LinkKind::kWeak;
    link.value = EncodeCoefficient(mean);
    link.more = 0;
  } else if (judgement.near && !pair_->basis->HasOwnNodes()) {
    MakeNear(r, s, seen, &link);
  }
  sink_->Add(link);
}

// Encodes the kernel of a far link between elements that are near each other:
// as scaled quadrature if that is accurate enough, otherwise each coefficient.
void ElementRefiner::MakeNear(const ReceiverElement& r,
                              const SourceElement& s,
                              const Kernel& kernel,
                              RawLink* link) {
  const NearCode code =
      EncodeNear(r.end, s, kernel, static_cast<uint16_t>(link->more));
  link->kind = LinkKind::kNear;
  link->value = code.sum;
  if (!code.error || r.weight * *code.error > kRebuiltShare * pair_->tau) {
    link->kind = LinkKind::kShaped;
    link->more = sink_->AddShape(EncodeKernel(kernel).shape);
  }
}

void ElementRefiner::DrawWeak(const ReceiverElement& r,
                              const SourceElement& s,
                              const WeakBounds& bounds) {
  if (!part_.Owns(r.level) || !FaceEachOther(r, s)) {
    return;
  }
  WeakDraw draw(*pair_, bounds, KeyOf(r, s));
  if (draw.IsKept()) {
    draw.Add(LinkBetween(r, s),
             r,
             SampleTransfer(r.end, s.end, IsNear(r.end, s.end), draw.Numbers()),
             sink_);
  }
}

}  // namespace enfilade
