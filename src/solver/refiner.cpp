#include "solver/refiner.h"

#include "base/random.h"
#include "solver/refiner_task.h"
#include "solver/transfer_sample.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

// Constants of the oracle: docs/decisions/0011-oracle.md.
// What sixteen rays leave unknown, as a share of the unoccluded transfer: per
// root of p (1 - p) where some are blocked, and where all are; where none is:
// kUnprovenClear.
constexpr float kMixedVisibility = 0.5F;
constexpr float kUnprovenBlocked = 0.04F;
// Shadows cost bases of higher order more, on their larger elements, than rays
// tell: measured, docs/decisions/0017-higher-orders.md.
constexpr std::array<float, 5> kShadowsOfOrder = {1, 1, 1, 1.25F, 1.4F};
// Of a part of what was blocked already, a quarter: so many halvings.
constexpr int kBlockedHalvings = 2;
// The first four rays decide alone where they agree and what they leave unknown
// is at most this share of tau.
constexpr float kUnprovenByFour = 0.15F;
constexpr float kDecidedByFour = 0.25F;
// A sampled transfer is kept at least with this multiple of its form factor,
// so that no coefficient exceeds its inverse: what is dark now may be lit
// later.
constexpr float kWeakGain = 1;
// Black surfaces receive too, for probes, but need less care.
constexpr float kLeastWeightReflectance = 0.1F;

// By how much detail may be concentrated for it to be looked for.
constexpr float kMostConcentration = 16;

// Pairs of clusters are sampled where each pair of their items is kept with at
// most this probability, and these many are to be expected.
constexpr float kMostProbable = 0.5F;
constexpr float kFewLinks = 2;

float LongestExtent(const Cluster& c) {
  const Vec3f e = c.box.Extent();
  return std::max({e.x, e.y, e.z});
}

// Which child of an element lies nearest to a point.
size_t NearestChild(const TransferEnd& end, Vec3f p) {
  size_t nearest = 0;
  float least = INFINITY;
  for (size_t c = 0; c < kChildren; ++c) {
    const TransferEnd child =
        MakeTransferEnd(*end.patch, ChildOf(end.frame, end.patch->shape, c));
    const UnitPoint at = NearestOn(child, p);
    const float distance = Length(PointOn(*end.patch,
                                          child.frame,
                                          static_cast<float>(at.a),
                                          static_cast<float>(at.b)) -
                                  p);
    if (distance < least) {
      least = distance;
      nearest = c;
    }
  }
  return nearest;
}

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

Refiner::Refiner(const RefineOptions& options,
                 const RefineSide& receiver,
                 const RefineSide& source,
                 const Blockers& blockers)
    : options_(options),
      receiver_(receiver),
      source_(source),
      blockers_(&blockers),
      basis_(receiver.tree->Shape().basis),
      shadows_(basis_->kind.flat ? 1 : kShadowsOfOrder[basis_->kind.order]),
      constant_basis_(receiver.tree->Shape().NodeStride() == 1),
      receiver_front_(receiver.clusters->Front(kItemReceivers)),
      source_front_(source.clusters->Front(kItemSources)) {
  std::vector<float> weights;
  for (const ClusterItem& item : receiver.clusters->Items()) {
    weights.push_back(RootReceiver(item).weight);
  }
  weights_ = receiver.clusters->LargestOf(weights);
  std::vector<float> peaks;
  std::vector<float> fluxes;
  for (const ClusterItem& item : source.clusters->Items()) {
    if (InGroup(item.patch)) {
      peaks.push_back(0);
      fluxes.push_back(0);
      continue;
    }
    const Source s = RootSource(item);
    peaks.push_back(PeakOf(s));
    fluxes.push_back(PeakOf(s) * s.end.area);
  }
  SetGroups();
  peaks_ = source.clusters->LargestOf(peaks);
  fluxes_ = source.clusters->LargestOf(fluxes);
}

uint64_t Refiner::KeyOf(const Receiver& r, const Source& s) const {
  const uint64_t patches = uint64_t{r.patch} << 32 | s.patch;
  return MixKey(MixKey(MixKey(PairKey(), patches), r.path), s.path);
}

uint64_t Refiner::PairKey() const {
  return MixKey(options_.seed,
                uint64_t{receiver_.id.value} << 32 | source_.id.value);
}

// ---------------------------------------------------------------- the ends

void Refiner::SetRadiosity(Source* source) const {
  const TreeShape& shape = source_.tree->Shape();
  const auto sent = source_.tree->Sent()[source->element];
  source->radiosity.fill(0);
  source->detail = source_.tree->Detail(source->element);
  if (basis_->HasOwnNodes()) {
    SampleRadiosity(sent, source);
    return;
  }
  for (size_t c = 0; c < shape.channels; ++c) {
    for (size_t q = 0; q < source->end.node_count; ++q) {
      const size_t node = constant_basis_ ? 0 : q;
      source->radiosity[q] = std::max(
          source->radiosity[q], std::abs(sent[c * shape.NodeStride() + node]));
    }
  }
}

// At the transfer nodes, of a basis that has its own.
void Refiner::SampleRadiosity(std::span<const float> sent,
                              Source* source) const {
  const TreeShape& shape = source_.tree->Shape();
  const PatchShape patch_shape = source->end.patch->shape;
  const auto& rows = basis_->SamplesOn(patch_shape).to_samples;
  for (size_t c = 0; c < shape.channels; ++c) {
    for (size_t q = 0; q < source->end.node_count; ++q) {
      float value = 0;
      for (size_t g = 0; g < basis_->On(patch_shape).NodeCount(); ++g) {
        value += rows[g][q] * sent[c * shape.NodeStride() + g];
      }
      source->radiosity[q] = std::max(source->radiosity[q], std::abs(value));
    }
  }
}

float Refiner::PeakOf(const Source& s) {
  return *std::max_element(s.radiosity.begin(), s.radiosity.end()) + s.detail;
}

Refiner::Source Refiner::RootSource(const ClusterItem& item) const {
  Source s;
  s.end = MakeTransferEnd(source_.patches[item.patch], {});
  s.patch = item.patch;
  s.element = ElementId(item.patch);
  SetRadiosity(&s);
  return s;
}

Refiner::Source Refiner::ChildSource(const Source& parent, size_t child) const {
  Source s;
  const PatchGeometry& patch = *parent.end.patch;
  s.end = MakeTransferEnd(patch, ChildOf(parent.end.frame, patch.shape, child));
  s.patch = parent.patch;
  s.path = ChildPath(parent.path, child);
  const Element& element = source_.tree->At(parent.element);
  if (parent.exists && element.first_child != 0) {
    s.element = ElementId(element.first_child + child);
    SetRadiosity(&s);
    return s;
  }
  s.element = parent.element;
  s.exists = false;
  s.radiosity = Pushed(parent.radiosity, patch.shape, child);
  for (float& b : s.radiosity) {
    b = std::abs(b);
  }
  return s;
}

// Radiosity at the transfer nodes, of a child by that of its parent.
std::array<float, kTransferNodes> Refiner::Pushed(
    const std::array<float, kTransferNodes>& parent,
    PatchShape shape,
    size_t child) const {
  if (constant_basis_) {
    return parent;
  }
  const ShapeBasis& basis = SecondOrderBasis().On(shape);
  std::array<float, kTransferNodes> pushed{};
  for (size_t q = 0; q < basis.NodeCount(); ++q) {
    double sum = 0;
    for (size_t g = 0; g < basis.NodeCount(); ++g) {
      sum += basis.Push(child, q, g) * static_cast<double>(parent[g]);
    }
    pushed[q] = static_cast<float>(sum);
  }
  return pushed;
}

Refiner::Receiver Refiner::RootReceiver(const ClusterItem& item) const {
  const PatchGeometry& patch = receiver_.patches[item.patch];
  Receiver r;
  r.end = MakeTransferEnd(patch, FrameOfPath(patch.shape, item.path));
  r.patch = item.patch;
  r.path = item.path;
  r.weight = std::max(patch.max_reflectance, kLeastWeightReflectance) *
             std::sqrt(r.end.area);
  return r;
}

Refiner::Receiver Refiner::ChildReceiver(const Receiver& parent,
                                         size_t child) const {
  Receiver r;
  const PatchGeometry& patch = *parent.end.patch;
  r.end = MakeTransferEnd(patch, ChildOf(parent.end.frame, patch.shape, child));
  r.patch = parent.patch;
  r.path = ChildPath(parent.path, child);
  r.level = parent.level + 1;
  r.weight = 0.5F * parent.weight;
  return r;
}

bool Refiner::CanSplit(const TransferEnd& end, ElementPath path) const {
  return end.diameter > options_.least_diameter && !IsDeepest(path);
}

// ------------------------------------------------------------- the clusters

void Refiner::Refine(const WorkPart& part, size_t most, RawLinks* out) const {
  Task task;
  task.out = out;
  task.part = part;
  task.most = part.depth < WorkPart::kMostDepth ? most : SIZE_MAX;
  const size_t columns = source_front_.size() + GroupCount();
  const uint32_t r = receiver_front_[part.item / columns];
  const size_t column = part.item % columns;
  task.first_receiver = receiver_.clusters->Clusters()[r].first;
  if (column < source_front_.size()) {
    const uint32_t s = source_front_[column];
    task.first_source = source_.clusters->Clusters()[s].first;
    VisitClusters(r, s, &task);
  } else {
    VisitGroups(receiver_.clusters->Clusters()[r],
                source_.groups->Roots()[column - source_front_.size()],
                &task);
  }
  FlushWeak(&task);
  out->rays += task.rays.traced;
  const double seen = (static_cast<double>(task.rays.seen) + 1) /
                      (static_cast<double>(task.rays.traced) + 4);
  out->squared_error += task.blocked_squared * std::min(1.0, 2 * seen);
}

void Refiner::VisitClusters(uint32_t receiver,
                            uint32_t source,
                            Task* task) const {
  const Cluster& r = receiver_.clusters->Clusters()[receiver];
  const Cluster& s = source_.clusters->Clusters()[source];
  const ClusterBound bound = BoundOf(r, s);
  if (bound.behind || task->out->overflowed || !task->Meets(r.first, r.count)) {
    return;
  }
  const float transfer =
      weights_[receiver] * std::min(peaks_[source] * bound.form_factor,
                                    fluxes_[source] * bound.per_area);
  const float probability = WeakProbability(transfer, bound.form_factor);
  const bool are_leaves = r.child == 0 && s.child == 0;
  const float expected =
      static_cast<float>(r.count) * static_cast<float>(s.count) * probability;
  if (probability < kMostProbable && (expected < kFewLinks || are_leaves)) {
    SamplePairs({receiver, source}, bound.form_factor, probability, task);
  } else if (are_leaves) {
    VisitItems(r, s, task);
  } else if (s.child == 0 ||
             (r.child != 0 && LongestExtent(r) >= LongestExtent(s))) {
    VisitClusters(r.child, source, task);
    VisitClusters(r.child + 1, source, task);
  } else {
    VisitClusters(receiver, s.child, task);
    VisitClusters(receiver, s.child + 1, task);
  }
}

void Refiner::VisitItems(const Cluster& r, const Cluster& s, Task* task) const {
  for (uint32_t i = r.first; i < r.first + r.count; ++i) {
    for (uint32_t k = s.first; k < s.first + s.count; ++k) {
      if (task->Meets(i, 1) && !InGroup(source_.clusters->Items()[k].patch)) {
        Visit(ReceiverAt(i, task), SourceAt(k, task), 0, task);
      }
    }
  }
}

// Draws the pairs of items whose weak links are kept, without looking at the
// others: first by `probability`, which none of them exceeds, jumping from one
// success to the next; then, of those, by what is their own.
void Refiner::SamplePairs(ClusterPair pair,
                          float form_factor,
                          float probability,
                          Task* task) const {
  const Cluster& r = receiver_.clusters->Clusters()[pair.receiver];
  const Cluster& s = source_.clusters->Clusters()[pair.source];
  const uint64_t pairs = uint64_t{r.count} * s.count;
  Random random(
      MixKey(PairKey(), ~(uint64_t{pair.receiver} << 32 | pair.source)));
  const double log_miss = std::log1p(-static_cast<double>(probability));
  uint64_t at = 0;
  while (true) {
    const double misses = std::log1p(-random.Next()) / log_miss;
    if (!(misses < static_cast<double>(pairs - at))) {
      return;
    }
    at += static_cast<uint64_t>(misses);
    const uint32_t i = r.first + static_cast<uint32_t>(at / s.count);
    const uint32_t k = s.first + static_cast<uint32_t>(at % s.count);
    if (task->Meets(i, 1) && !InGroup(source_.clusters->Items()[k].patch)) {
      const Receiver& receiver = ReceiverAt(i, task);
      const Source& source = SourceAt(k, task);
      const float f =
          std::min(form_factor, FormFactorBound(receiver.end, source.end));
      AddWeak(receiver,
              source,
              f,
              receiver.weight * PeakOf(source) * f,
              probability,
              task);
    }
    if (++at == pairs) {
      return;
    }
  }
}

const Refiner::Receiver& Refiner::ReceiverAt(uint32_t item, Task* task) const {
  auto& slot = task->receivers[item - task->first_receiver];
  if (!slot) {
    slot = RootReceiver(receiver_.clusters->Items()[item]);
  }
  return *slot;
}

const Refiner::Source& Refiner::SourceAt(uint32_t item, Task* task) const {
  auto& slot = task->sources[item - task->first_source];
  if (!slot) {
    slot = RootSource(source_.clusters->Items()[item]);
  }
  return *slot;
}

float Refiner::WeakProbability(float transfer, float form_factor) const {
  return std::min(1.0F,
                  std::max(transfer / static_cast<float>(options_.tau_weak),
                           kWeakGain * form_factor));
}

// ------------------------------------------------------------ the recursion

void Refiner::Visit(const Receiver& r,
                    const Source& s,
                    int blocked,
                    Task* task) const {
  if (task->out->overflowed || IsBehind(s.end, *r.end.patch) ||
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
  if (FewDecide(bound, blocked)) {
    rays.TraceFew();
    if (rays.NoneSeen()) {
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
  const Judgement judgement = Judge(r.end, s, *basis_);
  const Visibility look = Look(r, s, {&judgement, &shaft, blocked}, rays);
  const float unknown =
      judgement.transfer * shadows_ *
      UnknownShare(look.fraction, look.proven, look.few, blocked);
  const float visible = look.fraction > 0 ? 1.0F : 0.0F;
  blocked += look.fraction > 0 ? 0 : 1;
  const float share = ReceiverShare(look.bits, r.end, s.end);
  const float by_receiver =
      visible * judgement.receiver_error + share * unknown;
  const float by_source =
      visible * std::max(judgement.source_error, NearDetail(r, s, judgement)) +
      (1 - share) * unknown;
  // What cannot be split cannot be helped: splitting the other end instead
  // would only make more links of the same error together.
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
  if (!task->Takes(r)) {
    return;
  }
  const float error = r.weight * (by_receiver + by_source);
  if (look.fraction > 0) {
    AddError(error, task);
  } else {
    AddBlockedError(error, task);
  }
  const uint16_t bits = look.proven ? look.bits
                        : look.few  ? rays->AskFewAnew()
                                    : rays->AskAllAnew();
  Accept(r, s, judgement, bits, task);
}

// How wrong the source's nodes are where it lies closest to the receiver, W/m2
// of irradiance. The oracle takes detail as spread over all of the source, and
// so is the kernel if the receiver is far. A bulb before a wall lights a spot
// of it and the shade beside the spot: then both are concentrated, and where,
// the elements say that lie below the source.
float Refiner::NearDetail(const Receiver& r,
                          const Source& s,
                          const Judgement& judgement) const {
  if (!judgement.near || !s.exists ||
      r.weight * judgement.form_factor * s.detail * kMostConcentration <
          static_cast<float>(options_.tau)) {
    return 0;
  }
  float worth = 0;
  Source below = s;
  std::array<float, kTransferNodes> nodes = s.radiosity;
  while (source_.tree->At(below.element).first_child != 0) {
    const size_t child = NearestChild(below.end, r.end.center);
    nodes = Pushed(nodes, below.end.patch->shape, child);
    below = ChildSource(below, child);
    float square = below.detail * below.detail;
    for (size_t q = 0; q < below.end.node_count; ++q) {
      const float beyond = below.radiosity[q] - nodes[q];
      square += below.end.weight[q] * beyond * beyond;
    }
    const float seen =
        std::min(judgement.form_factor, FormFactorBound(r.end, below.end));
    worth = std::max(worth, seen * std::sqrt(square));
  }
  return worth;
}

// A transfer of which few rays saw nothing. Others may see something of it.
void Refiner::AcceptBlocked(const Receiver& r,
                            const Source& s,
                            float error,
                            LinkRays* rays,
                            Task* task) const {
  if (!task->Takes(r)) {
    return;
  }
  AddBlockedError(error, task);
  const uint16_t bits = rays->AskFewAnew();
  if (bits != 0) {
    Accept(r, s, Judge(r.end, s, *basis_), bits, task);
  }
}

// What rays that are all blocked leave unknown, per unoccluded transfer.
float Refiner::UnknownBlocked(bool few, int blocked) {
  return std::ldexp(few ? kUnprovenByFour : kUnprovenBlocked,
                    -kBlockedHalvings * blocked);
}

// The error that the rays of a link leave, likewise.
float Refiner::UnknownShare(float visible, bool proven, bool few, int blocked) {
  if (proven) {
    return 0;
  }
  if (visible <= 0) {
    return UnknownBlocked(few, blocked);
  }
  return kMixedVisibility * std::sqrt(visible * (1 - visible)) +
         (few ? kUnprovenByFour : kUnprovenClear);
}

// Whether what four rays leave unknown of a transfer, where they agree, is
// little.
bool Refiner::FewDecide(float transfer, int blocked) const {
  return transfer * UnknownBlocked(true, blocked) <=
         kDecidedByFour * static_cast<float>(options_.tau);
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

void Refiner::SplitReceiver(const Receiver& r,
                            const Source& s,
                            int blocked,
                            Task* task) const {
  for (size_t c = 0; c < kChildren; ++c) {
    if (task->Enters(r, c)) {
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
  look.few = rays->Agree() &&
             FewDecide(r.weight * sight.judgement->transfer, sight.blocked);
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

// ---------------------------------------------------------------- the links

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
  for (size_t i = 0; i < judgement.kernel.size(); ++i) {
    if ((visible >> i & 1) != 0) {
      link.gain[i / kTransferNodes] += judgement.kernel[i];
    }
  }
  if (constant_basis_) {
    const float mean = std::inner_product(
        link.gain.begin(), link.gain.end(), r.end.weight.begin(), 0.0F);
    link.gain.fill(mean);
    link.kind = LinkKind::kWeak;
    link.value = EncodeCoefficient(mean);
  } else if (judgement.near && !basis_->HasOwnNodes()) {
    NearCoefficients coefficients{};
    for (size_t i = 0; i < coefficients.size(); ++i) {
      if ((visible >> i & 1) != 0) {
        coefficients[i] = EncodeCoefficient(judgement.kernel[i]);
      }
    }
    link.kind = LinkKind::kNear;
    link.value = 0;
    link.near_index = static_cast<uint32_t>(task->out->near.size());
    task->out->near.push_back(coefficients);
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
  AddPending({LinkBetween(r, s),
              coefficient,
              r.weight * PeakOf(s) * coefficient * std::sqrt(1 - probability)},
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
