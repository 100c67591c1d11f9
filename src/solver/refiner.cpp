#include "solver/refiner.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// The oracle's constants: docs/decisions/0011-oracle.md has the measurements.
// A source nearer than this many of its diameters gets exact form factors.
constexpr float kNearDiameters = 2.0F;
// RMS over the element per RMS over the test points, of a residual quadratic
// in the receiver's coordinates (second order) or linear (constant basis).
constexpr float kBilinearResidual = 0.6F;
constexpr float kConstantResidual = 0.9F;
// What sixteen rays leave unknown, as a share of the unoccluded transfer: per
// root of p (1 - p) where some are blocked, and where none or all are.
constexpr float kMixedVisibility = 0.5F;
constexpr float kUnprovenClear = 0.03F;
constexpr float kUnprovenBlocked = 0.04F;
// Of a part of what was blocked already, that much less.
constexpr float kBlockedDecay = 0.25F;
// Of the variance of sixteen samples, the part that is blamed on the larger
// end rather than on the end with which they vary.
constexpr float kVarianceNoise = 0.15F;
// A sampled transfer is kept at least with this multiple of its form factor,
// so that no coefficient exceeds its inverse: with larger ones the operator
// would not contract where it is dark now, and light arriving later would grow.
constexpr float kWeakGain = 4;
// Black surfaces receive too, for probes, but need less care.
constexpr float kLeastWeightReflectance = 0.1F;

// A random point in the part of an element that node g stands for: a quarter
// of a parallelogram, the third of a triangle nearest to a corner.
Vec3f PointNearNode(const TransferEnd& end, size_t g, Random* random) {
  float s = static_cast<float>(random->Next());
  float t = static_cast<float>(random->Next());
  if (end.node_count == 4) {
    s = 0.5F * (s + static_cast<float>(g & 1));
    t = 0.5F * (t + static_cast<float>(g >> 1));
    return PointOn(*end.patch, end.frame, s, t);
  }
  if (s + t > 1) {
    s = 1 - s;
    t = 1 - t;
  }
  // Nodes 0, 1, 2 lie near the corners of weight (1 - s - t), s, t.
  std::array<float, 3> corner = {1 - s - t, s, t};
  const size_t largest = static_cast<size_t>(
      std::max_element(corner.begin(), corner.end()) - corner.begin());
  std::swap(corner[largest], corner[g]);
  return PointOn(*end.patch, end.frame, corner[1], corner[2]);
}

Vec3f RandomPoint(const TransferEnd& end, Random* random) {
  return PointNearNode(
      end, random->NextBelow(static_cast<uint32_t>(end.node_count)), random);
}

void AddSegment(Vec3f from, Vec3f to, SegmentPacket* packet) {
  const uint32_t i = packet->count++;
  packet->from_x[i] = from.x;
  packet->from_y[i] = from.y;
  packet->from_z[i] = from.z;
  packet->to_x[i] = to.x;
  packet->to_y[i] = to.y;
  packet->to_z[i] = to.z;
}

// The unoccluded kernel between two points of the ends, without the source's
// area.
float PointKernel(Vec3f x,
                  Vec3f y,
                  const TransferEnd& r,
                  const TransferEnd& s) {
  const Vec3f d = y - x;
  const float r2 = Dot(d, d) + 1e-12F;
  return std::max(0.0F, Dot(d, r.patch->normal)) *
         std::max(0.0F, -Dot(d, s.patch->normal)) /
         (static_cast<float>(kPi) * r2 * r2);
}

struct PointPair {
  Vec3f x;
  Vec3f y;
};

// A pair of random points near node g of the receiver and node q of the
// source, drawn by the kernel between them: one of a few candidates. The near
// parts of close elements weigh more and are less occluded; uniform samples
// would make such transfers too dark.
PointPair PairByKernel(const TransferEnd& r,
                       size_t g,
                       const TransferEnd& s,
                       size_t q,
                       Random* random) {
  constexpr size_t kCandidates = 6;
  std::array<PointPair, kCandidates> candidates;
  std::array<float, kCandidates> sums{};
  float sum = 0;
  for (size_t i = 0; i < kCandidates; ++i) {
    candidates[i] = {PointNearNode(r, g, random), PointNearNode(s, q, random)};
    sum += PointKernel(candidates[i].x, candidates[i].y, r, s) + 1e-20F;
    sums[i] = sum;
  }
  const float pick = sum * static_cast<float>(random->Next());
  size_t i = 0;
  while (i + 1 < kCandidates && sums[i] < pick) {
    ++i;
  }
  return candidates[i];
}

// The kernel varies much over the two elements.
bool AreClose(const TransferEnd& r, const TransferEnd& s) {
  return Length(s.center - r.center) < 2.0F * std::max(r.diameter, s.diameter);
}

// The point of an element that is nearest to p, a little off the rim.
UnitPoint NearestOn(const TransferEnd& end, Vec3f p) {
  const PatchGeometry& patch = *end.patch;
  const Vec3f d = p - PointOn(patch, end.frame, 0, 0);
  const Vec3f u = patch.u * end.frame.scale;
  const Vec3f v = patch.v * end.frame.scale;
  const float uu = Dot(u, u);
  const float uv = Dot(u, v);
  const float vv = Dot(v, v);
  const float determinant = std::max(uu * vv - uv * uv, 1e-20F);
  const float du = Dot(d, u);
  const float dv = Dot(d, v);
  constexpr float kRim = 0.03F;
  float s = std::clamp((vv * du - uv * dv) / determinant, kRim, 1 - kRim);
  float t = std::clamp((uu * dv - uv * du) / determinant, kRim, 1 - kRim);
  if (patch.shape == PatchShape::kTriangle && s + t > 1 - kRim) {
    const float scale = (1 - kRim) / (s + t);
    s *= scale;
    t *= scale;
  }
  return {static_cast<double>(s), static_cast<double>(t)};
}

// All of `end` lies behind (or in) the plane of the patch.
bool IsBehind(const TransferEnd& end, const PatchGeometry& patch) {
  const float tolerance = 1e-5F * (1 + patch.diameter);
  const Corners corners = CornersOf(*end.patch, end.frame);
  return std::all_of(
      corners.View().begin(), corners.View().end(), [&](Vec3f p) {
        return Dot(p - patch.origin, patch.normal) <= tolerance;
      });
}

bool IsNear(const TransferEnd& r, const TransferEnd& s) {
  return Length(s.center - r.center) - 0.5F * r.diameter <
         kNearDiameters * s.diameter;
}

// An upper bound of the mean form factor, not far above it when the ends are
// far apart.
float FormFactorBound(const TransferEnd& r, const TransferEnd& s) {
  const Vec3f d = s.center - r.center;
  const float distance = Length(d);
  const float reach = 0.5F * (r.diameter + s.diameter);
  const float gap = distance - reach;
  if (gap <= 0.25F * s.diameter) {
    return 1;
  }
  const float cos_x =
      std::clamp((Dot(d, r.patch->normal) + reach) / gap, 0.0F, 1.0F);
  const float cos_y =
      std::clamp((reach - Dot(d, s.patch->normal)) / gap, 0.0F, 1.0F);
  return std::min(
      1.0F, s.area * cos_x * cos_y / (static_cast<float>(kPi) * gap * gap));
}

// Where the receiver's basis is tested: off its nodes, a little off its rim.
std::span<const UnitPoint> TestPoints(PatchShape shape) {
  static constexpr std::array<UnitPoint, 5> kSquare = {
      {{0.5, 0.5}, {0.04, 0.5}, {0.96, 0.5}, {0.5, 0.04}, {0.5, 0.96}}};
  static constexpr std::array<UnitPoint, 4> kTriangle = {
      {{1.0 / 3, 1.0 / 3}, {0.48, 0.04}, {0.04, 0.48}, {0.48, 0.48}}};
  if (shape == PatchShape::kTriangle) {
    return kTriangle;
  }
  return kSquare;
}

// Whose fault unknown visibility is: near 1 where it varies with the point of
// the receiver, near 0 where it varies with the point of the source. Splitting
// the wrong end would turn one error that is seen into many that are too small
// to be seen but add up.
float ReceiverShare(uint16_t bits, const TransferEnd& r, const TransferEnd& s) {
  std::array<float, kTransferNodes> rows{};
  std::array<float, kTransferNodes> columns{};
  float mean = 0;
  for (size_t g = 0; g < r.node_count; ++g) {
    for (size_t q = 0; q < s.node_count; ++q) {
      const size_t bit = g * kTransferNodes + q;
      const float v = (bits >> bit & 1) != 0 ? 1.0F : 0.0F;
      rows[g] += v * s.weight[q];
      columns[q] += v * r.weight[g];
      mean += v * s.weight[q] * r.weight[g];
    }
  }
  float by_row = 0;
  for (size_t g = 0; g < r.node_count; ++g) {
    by_row += r.weight[g] * (rows[g] - mean) * (rows[g] - mean);
  }
  float by_column = 0;
  for (size_t q = 0; q < s.node_count; ++q) {
    by_column += s.weight[q] * (columns[q] - mean) * (columns[q] - mean);
  }
  const float size = r.diameter / (r.diameter + s.diameter + 1e-9F);
  const float noise = kVarianceNoise * mean * (1 - mean) + 1e-3F;
  return (by_row + noise * size) / (by_row + by_column + noise);
}

// The values of the second-order Lagrange functions at the test points.
struct TestTable {
  Basis basis{2};
  std::array<std::array<std::array<float, kTransferNodes>, 5>, 2> values{};

  TestTable() {
    for (const PatchShape shape :
         {PatchShape::kParallelogram, PatchShape::kTriangle}) {
      const auto points = TestPoints(shape);
      for (size_t i = 0; i < points.size(); ++i) {
        const auto all = basis.On(shape).Evaluate(points[i]);
        for (size_t g = 0; g < kTransferNodes; ++g) {
          values[static_cast<size_t>(shape)][i][g] = static_cast<float>(all[g]);
        }
      }
    }
  }
};

const TestTable& Tests() {
  static const TestTable table;
  return table;
}

float WeightedSum(const float* row,
                  const std::array<float, kTransferNodes>& radiosity) {
  return (row[0] * radiosity[0] + row[1] * radiosity[1]) +
         (row[2] * radiosity[2] + row[3] * radiosity[3]);
}

}  // namespace

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
    out.source =
        source
            .FindOrCreate(
                PatchId(link.source_patch), link.source_path, source_patches)
            .value;
    out.kind = link.kind;
    out.value = link.value;
    if (link.kind == LinkKind::kNear) {
      out.near_index = static_cast<uint32_t>(block->near.size());
      block->near.push_back(raw.near[link.near_index]);
    }
    block->links.push_back(out);
  }
}

// Weak links wait for their rays until a packet is full.
struct Refiner::Task {
  struct Pending {
    RawLink link;
    float coefficient;
  };

  RawLinks* out = nullptr;
  SegmentPacket packet{};
  std::array<Pending, 16> pending{};
};

Refiner::Refiner(const RefineOptions& options,
                 const RefineSide& receiver,
                 const RefineSide& source,
                 const Blockers& blockers,
                 const CoverMap* cover)
    : options_(options),
      receiver_(receiver),
      source_(source),
      blockers_(&blockers),
      cover_(cover),
      constant_basis_(receiver.tree->Shape().NodeStride() == 1) {}

uint64_t Refiner::KeyOf(const Receiver& r, const Source& s) const {
  uint64_t key = MixKey(options_.seed,
                        uint64_t{receiver_.id.value} << 32 | source_.id.value);
  key = MixKey(key, uint64_t{r.patch} << 32 | r.path);
  return MixKey(key, uint64_t{s.patch} << 32 | s.path);
}

// ---------------------------------------------------------------- the ends

void Refiner::SetRadiosity(Source* source) const {
  const TreeShape& shape = source_.tree->Shape();
  const auto sent = source_.tree->Sent()[source->element];
  source->radiosity.fill(0);
  for (size_t c = 0; c < shape.channels; ++c) {
    for (size_t q = 0; q < source->end.node_count; ++q) {
      const size_t node = constant_basis_ ? 0 : q;
      source->radiosity[q] = std::max(
          source->radiosity[q], std::abs(sent[c * shape.NodeStride() + node]));
    }
  }
  source->detail = source_.tree->Detail(source->element);
}

Refiner::Source Refiner::RootSource(size_t patch) const {
  Source s;
  s.end = MakeTransferEnd(source_.patches[patch], {});
  s.patch = static_cast<uint32_t>(patch);
  s.element = ElementId(patch);
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
  if (constant_basis_) {
    s.radiosity = parent.radiosity;
    return s;
  }
  const ShapeBasis& basis = source_.tree->Shape().basis->On(patch.shape);
  for (size_t q = 0; q < s.end.node_count; ++q) {
    double sum = 0;
    for (size_t g = 0; g < s.end.node_count; ++g) {
      sum += basis.Push(child, q, g) * static_cast<double>(parent.radiosity[g]);
    }
    s.radiosity[q] = std::abs(static_cast<float>(sum));
  }
  return s;
}

Refiner::Receiver Refiner::ChildReceiver(const Receiver& parent,
                                         size_t child) const {
  Receiver r;
  const PatchGeometry& patch = *parent.end.patch;
  r.end = MakeTransferEnd(patch, ChildOf(parent.end.frame, patch.shape, child));
  r.patch = parent.patch;
  r.path = ChildPath(parent.path, child);
  r.weight = 0.5F * parent.weight;
  return r;
}

// ------------------------------------------------------------ the recursion

void Refiner::Refine(PatchId receiver,
                     size_t first_source,
                     size_t last_source,
                     RawLinks* out) const {
  const PatchGeometry& patch = receiver_.patches[receiver.Index()];
  if (!patch.reflects) {
    return;
  }
  Task task;
  task.out = out;
  Receiver r;
  r.end = MakeTransferEnd(patch, {});
  r.patch = receiver.value;
  r.weight = std::max(patch.max_reflectance, kLeastWeightReflectance) *
             std::sqrt(patch.area);
  for (size_t i = first_source; i < last_source; ++i) {
    Visit(r, RootSource(i), 0, &task);
  }
  FlushWeak(&task);
}

void Refiner::Visit(const Receiver& r,
                    const Source& s,
                    int blocked,
                    Task* task) const {
  const float peak =
      *std::max_element(s.radiosity.begin(), s.radiosity.end()) + s.detail;
  const float tau_weak = static_cast<float>(options_.tau_weak);
  if (IsBehind(s.end, *r.end.patch) || IsBehind(r.end, *s.end.patch)) {
    return;
  }
  if (cover_ != nullptr && cover_->MustSplit(r.patch, r.path)) {
    if (r.path == kRootPath && MissesAGate(r.end, s.end)) {
      return;
    }
    SplitReceiver(r, s, blocked, task);
    return;
  }
  const float form_factor = FormFactorBound(r.end, s.end);
  const float bound = r.weight * peak * form_factor;
  if (bound < tau_weak) {
    AddWeak(r, s, form_factor, bound, task);
    return;
  }
  if (MissesAGate(r.end, s.end)) {
    return;
  }
  const Judgement judgement = Judge(r.end, s);
  const Visibility look = Look(r, s, judgement, task);
  const float p = look.fraction;
  float unknown = judgement.transfer;
  if (look.proven) {
    unknown = 0;
  } else if (p > 0 && p < 1) {
    unknown *= kMixedVisibility * std::sqrt(p * (1 - p)) + kUnprovenClear;
  } else if (p > 0) {
    unknown *= kUnprovenClear;
  } else {
    unknown *=
        kUnprovenBlocked * std::pow(kBlockedDecay, static_cast<float>(blocked));
    ++blocked;
  }
  const float visible = p > 0 ? 1.0F : 0.0F;
  const float share = ReceiverShare(look.bits, r.end, s.end);
  const float by_receiver =
      visible * judgement.receiver_error + share * unknown;
  const float by_source =
      visible * judgement.source_error + (1 - share) * unknown;
  const float error = r.weight * (by_receiver + by_source);
  const bool can_split_r = r.end.diameter > options_.least_diameter &&
                           r.path < (1U << (2 * kMaxLevel));
  const bool can_split_s = s.end.diameter > options_.least_diameter &&
                           s.path < (1U << (2 * kMaxLevel));
  if (error <= static_cast<float>(options_.tau) ||
      (!can_split_r && !can_split_s)) {
    Accept(r, s, judgement, look, error, task);
  } else if (can_split_r && (by_receiver >= by_source || !can_split_s)) {
    SplitReceiver(r, s, blocked, task);
  } else {
    SplitSource(r, s, blocked, task);
  }
}

bool Refiner::MissesAGate(const TransferEnd& r, const TransferEnd& s) const {
  return std::any_of(blockers_->gates.begin(),
                     blockers_->gates.end(),
                     [&](const ShaftBlockers* portals) {
                       return portals->IsEmptyBetween(
                           *r.patch, r.frame, *s.patch, s.frame);
                     });
}

void Refiner::SplitReceiver(const Receiver& r,
                            const Source& s,
                            int blocked,
                            Task* task) const {
  for (size_t c = 0; c < kChildren; ++c) {
    Visit(ChildReceiver(r, c), s, blocked, task);
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

// --------------------------------------------------------------- the oracle

Refiner::Judgement Refiner::Judge(const TransferEnd& r, const Source& s) const {
  Judgement j;
  j.near = IsNear(r, s.end);
  j.kernel = j.near ? NearKernel(r, s.end) : QuadratureKernel(r, s.end);
  std::array<float, kTransferNodes> at_nodes{};
  float form_factor = 0;  // the largest seen
  for (size_t g = 0; g < r.node_count; ++g) {
    const float* row = &j.kernel[g * kTransferNodes];
    at_nodes[g] = WeightedSum(row, s.radiosity);
    j.transfer += r.weight[g] * at_nodes[g];
    form_factor += r.weight[g] * ((row[0] + row[1]) + (row[2] + row[3]));
  }
  const PatchShape shape = r.patch->shape;
  const auto residual_at = [&](UnitPoint at, const float* lagrange) {
    const Vec3f x = PointOn(
        *r.patch, r.frame, static_cast<float>(at.a), static_cast<float>(at.b));
    const auto row = j.near ? NearRow(x, r.patch->normal, s.end)
                            : QuadratureRow(x, r.patch->normal, s.end);
    form_factor = std::max(form_factor, (row[0] + row[1]) + (row[2] + row[3]));
    const float fit =
        constant_basis_ ? j.transfer : WeightedSum(lagrange, at_nodes);
    return WeightedSum(row.data(), s.radiosity) - fit;
  };
  const auto points = TestPoints(shape);
  float square = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto& lagrange = Tests().values[static_cast<size_t>(shape)][i];
    const float residual = residual_at(points[i], lagrange.data());
    square += residual * residual;
  }
  square /= static_cast<float>(points.size());
  if (s.end.diameter < 2 * r.diameter && j.near) {
    // A small source close to a large receiver peaks between its nodes: over
    // an area like the source's, widened by its distance.
    const UnitPoint at = NearestOn(r, s.end.center);
    const auto values = Tests().basis.On(shape).Evaluate(at);
    std::array<float, kTransferNodes> lagrange{};
    for (size_t g = 0; g < r.node_count; ++g) {
      lagrange[g] = static_cast<float>(values[g]);
    }
    const Vec3f x = PointOn(
        *r.patch, r.frame, static_cast<float>(at.a), static_cast<float>(at.b));
    const Vec3f d = s.end.center - x;
    const float residual = residual_at(at, lagrange.data());
    square +=
        residual * residual * std::min(1.0F, (s.end.area + Dot(d, d)) / r.area);
  }
  j.receiver_error = (constant_basis_ ? kConstantResidual : kBilinearResidual) *
                     std::sqrt(square);
  // The source's radiosity beyond its nodes, damped by the kernel's
  // smoothness: one order of distance per order of the basis.
  const float distance = Length(s.end.center - r.center);
  float damping = std::min(1.0F, s.end.diameter / std::max(distance, 1e-6F));
  damping = constant_basis_ ? damping : damping * damping;
  const auto [low, high] = std::minmax_element(
      s.radiosity.begin(),
      s.radiosity.begin() + static_cast<std::ptrdiff_t>(s.end.node_count));
  const float spread = j.near ? 0.25F * (*high - *low) * damping : 0.0F;
  j.source_error = form_factor * (s.detail * damping + spread);
  return j;
}

Refiner::Visibility Refiner::Look(const Receiver& r,
                                  const Source& s,
                                  const Judgement& judgement,
                                  Task* task) const {
  Visibility look;
  look.proven =
      std::all_of(blockers_->shafts.begin(),
                  blockers_->shafts.end(),
                  [&](const ShaftBlockers* shaft) {
                    return shaft->IsEmptyBetween(
                        *r.end.patch, r.end.frame, *s.end.patch, s.end.frame);
                  });
  Random random(KeyOf(r, s));
  const bool close = AreClose(r.end, s.end);
  SegmentPacket packet{};
  std::array<uint8_t, 16> lane_bit{};
  for (size_t g = 0; g < r.end.node_count; ++g) {
    for (size_t q = 0; q < s.end.node_count; ++q) {
      const size_t bit = g * kTransferNodes + q;
      if (look.proven) {
        look.bits = static_cast<uint16_t>(look.bits | 1U << bit);
        continue;
      }
      lane_bit[packet.count] = static_cast<uint8_t>(bit);
      const PointPair ends = close
                                 ? PairByKernel(r.end, g, s.end, q, &random)
                                 : PointPair{PointNearNode(r.end, g, &random),
                                             PointNearNode(s.end, q, &random)};
      AddSegment(ends.x, ends.y, &packet);
    }
  }
  if (look.proven) {
    return look;
  }
  const uint32_t blocked = Occluded(blockers_->occluders, packet);
  task->out->rays += packet.count;
  float sum = 0;
  float visible = 0;
  for (uint32_t lane = 0; lane < packet.count; ++lane) {
    const size_t bit = lane_bit[lane];
    const float share =
        judgement.kernel[bit] * s.radiosity[bit % kTransferNodes] + 1e-20F;
    sum += share;
    if ((blocked >> lane & 1) == 0) {
      visible += share;
      look.bits = static_cast<uint16_t>(look.bits | 1U << bit);
    }
  }
  look.fraction = visible / sum;
  return look;
}

// ---------------------------------------------------------------- the links

void Refiner::Accept(const Receiver& r,
                     const Source& s,
                     const Judgement& judgement,
                     const Visibility& visibility,
                     float error,
                     Task* task) const {
  task->out->squared_error +=
      static_cast<double>(error) * static_cast<double>(error);
  if (visibility.bits == 0) {
    return;
  }
  RawLink link{
      r.patch, r.path, s.patch, s.path, LinkKind::kFar, visibility.bits, 0};
  if (constant_basis_) {
    float mean = 0;
    for (size_t i = 0; i < judgement.kernel.size(); ++i) {
      if ((visibility.bits >> i & 1) != 0) {
        mean += r.end.weight[i / kTransferNodes] * judgement.kernel[i];
      }
    }
    link.kind = LinkKind::kWeak;
    link.value = EncodeCoefficient(mean);
  } else if (judgement.near) {
    NearCoefficients coefficients{};
    for (size_t i = 0; i < coefficients.size(); ++i) {
      if ((visibility.bits >> i & 1) != 0) {
        coefficients[i] = EncodeCoefficient(judgement.kernel[i]);
      }
    }
    link.kind = LinkKind::kNear;
    link.value = 0;
    link.near_index = static_cast<uint32_t>(task->out->near.size());
    task->out->near.push_back(coefficients);
  }
  task->out->links.push_back(link);
}

void Refiner::AddWeak(const Receiver& r,
                      const Source& s,
                      float form_factor_bound,
                      float bound,
                      Task* task) const {
  const float probability =
      std::min(1.0F,
               std::max(bound / static_cast<float>(options_.tau_weak),
                        kWeakGain * form_factor_bound));
  Random random(KeyOf(r, s));
  if (random.Next() >= static_cast<double>(probability)) {
    return;
  }
  const Vec3f x = RandomPoint(r.end, &random);
  const Vec3f y = RandomPoint(s.end, &random);
  float form_factor = 0;
  if (IsNear(r.end, s.end)) {
    for (const float k : NearRow(x, r.end.patch->normal, s.end)) {
      form_factor += k;
    }
  } else {
    form_factor = s.end.area * PointKernel(x, y, r.end, s.end);
  }
  const double spread = static_cast<double>(bound / probability);
  task->out->squared_error +=
      spread * spread * static_cast<double>(1 - probability);
  if (!(form_factor > 0)) {
    return;
  }
  task->pending[task->packet.count] = {
      {r.patch, r.path, s.patch, s.path, LinkKind::kWeak, 0, 0},
      form_factor / probability};
  AddSegment(x, y, &task->packet);
  if (task->packet.count == task->pending.size()) {
    FlushWeak(task);
  }
}

void Refiner::FlushWeak(Task* task) const {
  if (task->packet.count == 0) {
    return;
  }
  const uint32_t blocked = Occluded(blockers_->occluders, task->packet);
  task->out->rays += task->packet.count;
  for (uint32_t i = 0; i < task->packet.count; ++i) {
    if ((blocked >> i & 1) == 0) {
      RawLink link = task->pending[i].link;
      link.value = EncodeCoefficient(task->pending[i].coefficient);
      task->out->links.push_back(link);
    }
  }
  task->packet.count = 0;
}

}  // namespace enfilade
