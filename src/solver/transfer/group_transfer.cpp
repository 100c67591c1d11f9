#include "solver/transfer/group_transfer.h"

#include "solver/transfer/oracle.h"
#include "solver/transfer/shaft.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

float SumOf(const std::array<float, kTransferNodes>& row) {
  return (row[0] + row[1]) + (row[2] + row[3]);
}

}  // namespace

GroupPart WholeGroup(const SourceGroup& group) {
  GroupPart part;
  part.count = group.count;
  std::iota(part.members.begin(), part.members.end(), uint8_t{0});
  return part;
}

GroupTransfer::GroupTransfer(const TransferEnd& receiver,
                             std::span<const PatchGeometry> patches,
                             const SourceGroups& groups,
                             const SourceGroup& group,
                             const GroupPart& candidates)
    : receiver_(&receiver),
      patches_(patches),
      group_(&group),
      members_(groups.PatchesOf(group)) {
  for (size_t i = 0; i < candidates.count; ++i) {
    const uint8_t member = candidates.members[i];
    const PatchGeometry& patch = patches[members_[member]];
    const TransferEnd end = MakeTransferEnd(patch, {});
    if (!IsBehind(end, *receiver.patch) && !IsBehind(receiver, patch)) {
      facing_.members[facing_.count++] = member;
      bound_ += enfilade::FormFactorBound(receiver, end);
    }
  }
  bound_ = std::min(bound_, 1.0F);
}

float GroupTransfer::FormFactorsOf(
    Vec3f at, std::array<float, kMostGroupPatches>* form_factors) const {
  const SurfacePoint x = {at, receiver_->patch->normal};
  float sum = 0;
  for (size_t i = 0; i < facing_.count; ++i) {
    const TransferEnd end = MakeTransferEnd(PatchAt(i), {});
    (*form_factors)[i] = SumOf(IsNear(*receiver_, end) ? NearSource(end).Row(x)
                                                       : QuadratureRow(x, end));
    sum += (*form_factors)[i];
  }
  return sum;
}

Vec3f GroupTransfer::DrawPoint(
    const std::array<float, kMostGroupPatches>& form_factors,
    float share,
    Random* random) const {
  const size_t i =
      IndexAtShare(std::span(form_factors).first(facing_.count), share);
  return RandomPoint(MakeTransferEnd(PatchAt(i), {}), random);
}

void GroupTransfer::Evaluate() {
  std::array<float, kMostGroupPatches> unused{};
  for (size_t g = 0; g < receiver_->node_count; ++g) {
    at_nodes_[g] = FormFactorsOf(receiver_->nodes.At(g), &unused);
  }
}

float GroupTransfer::FormFactor() const {
  return std::inner_product(at_nodes_.begin(),
                            at_nodes_.end(),
                            receiver_->nodes.weight.begin(),
                            0.0F);
}

float GroupTransfer::Residual(const Basis& basis) const {
  const TransferEnd& r = *receiver_;
  std::array<float, kMostGroupPatches> unused{};
  const auto residual_at = [&](UnitPoint at) {
    const float fit = basis.kind.order == 1
                          ? FormFactor()
                          : SecondOrderAt(r.patch->shape, at, at_nodes_);
    const Vec3f x = PointOn(
        *r.patch, r.frame, static_cast<float>(at.a), static_cast<float>(at.b));
    return FormFactorsOf(x, &unused) - fit;
  };
  const auto tests = TestPoints(r.patch->shape);
  return RmsResidual(
      r,
      Extent(),
      basis,
      [&](size_t i) { return residual_at(tests[i]); },
      residual_at);
}

SourceExtent GroupTransfer::Extent() const {
  SourceExtent extent;
  extent.center = (group_->box.low + group_->box.high) * 0.5F;
  extent.diameter = Length(group_->box.Extent());
  extent.area = 0.25F * group_->area;
  extent.near = Length(extent.center - receiver_->center) <
                2 * (receiver_->diameter + extent.diameter);
  const Vec3f lit_side = NormalOfCuts();
  if (Dot(lit_side, lit_side) > 0) {
    extent.lit_side = lit_side;
  }
  return extent;
}

Vec3f GroupTransfer::NormalOfCuts() const {
  Vec3f sum;
  for (size_t i = 0; i < facing_.count; ++i) {
    if (IsCut(*receiver_, PatchAt(i))) {
      sum = sum + PatchAt(i).normal;
    }
  }
  return sum;
}

bool GroupTransfer::IsProvenClear(const Blockers& blockers) const {
  for (size_t i = 0; i < facing_.count; ++i) {
    if (!blockers.LeaveEmpty(
            EndsOf(*receiver_->patch, receiver_->frame, PatchAt(i), {}))) {
      return false;
    }
  }
  return true;
}

bool GroupTransfer::IsPeaked() const {
  return enfilade::IsPeaked(Length(group_->box.Extent()),
                            (group_->box.low + group_->box.high) * 0.5F,
                            *receiver_);
}

std::optional<PointPair> GroupTransfer::PairAtPeak(Random* random) const {
  std::array<float, kMostGroupPatches> areas{};
  for (size_t i = 0; i < facing_.count; ++i) {
    areas[i] = PatchAt(i).area;
  }
  const TransferEnd source = MakeTransferEnd(
      PatchAt(IndexAtShare(std::span(areas).first(facing_.count),
                           static_cast<float>(random->Next()))),
      {});
  return enfilade::PairAtPeak(*receiver_, source, random);
}

SampledTransfer GroupTransfer::Sample(Random* random) const {
  const Vec3f x = RandomPoint(*receiver_, random);
  std::array<float, kMostGroupPatches> form_factors{};
  const float sum = FormFactorsOf(x, &form_factors);
  if (!(sum > 0)) {
    return {};
  }
  const auto share = static_cast<float>(random->Next());
  return {sum, {x, DrawPoint(form_factors, share, random)}};
}

// ------------------------------------------------------------------ the rays

// A point of the receiver from which rays go to the group.
struct GroupRays::Point {
  size_t node = 0;
  float form_factor = 0;
  uint32_t seen = 0;  // number of rays that got through

  [[nodiscard]] float Share(size_t rays) const {
    return static_cast<float>(seen) / static_cast<float>(rays);
  }
};

GroupSight GroupRays::Look(size_t points, size_t rays) {
  std::array<Point, kTransferNodes * kMostPoints> all;
  const size_t count = points * receiver_->node_count;
  for (size_t i = 0; i < count; ++i) {
    all[i].node = i / points;
  }
  Trace(std::span(all).first(count), rays);
  return SightOf(std::span(all).first(count), rays);
}

bool GroupRays::SeesPeak() {
  SegmentPacket packet;
  for (size_t i = 0; transfer_->IsPeaked() && i < kPeakRays; ++i) {
    if (const auto pair = transfer_->PairAtPeak(&random_)) {
      AddSegment(*pair, &packet);
    }
  }
  return SeenIn(*blockers_, packet, count_) != 0;
}

// Sends the rays of each point to as many strata of the group.
void GroupRays::Trace(std::span<Point> points, size_t rays) {
  SegmentPacket packet;
  std::array<Point*, 16> lanes{};
  const auto flush = [&] {
    const uint32_t seen = SeenIn(*blockers_, packet, count_);
    for (uint32_t lane = 0; lane < packet.count; ++lane) {
      lanes[lane]->seen += seen >> lane & 1;
    }
    packet.count = 0;
  };
  std::array<float, kMostGroupPatches> form_factors{};
  for (Point& point : points) {
    const Vec3f x = PointNearNode(*receiver_, point.node, &random_);
    point.form_factor = transfer_->FormFactorsOf(x, &form_factors);
    if (!(point.form_factor > 0)) {
      continue;
    }
    for (size_t k = 0; k < rays; ++k) {
      const float share =
          (static_cast<float>(k) + static_cast<float>(random_.Next())) /
          static_cast<float>(rays);
      const Vec3f y = transfer_->DrawPoint(form_factors, share, &random_);
      lanes[packet.count] = &point;
      AddSegment({x, y}, &packet);
      if (packet.count == lanes.size()) {
        flush();
      }
    }
  }
  if (packet.count != 0) {
    flush();
  }
}

GroupSight GroupRays::SightOf(std::span<const Point> points, size_t rays) {
  GroupSight sight;
  std::array<float, kTransferNodes> all{};
  float sum = 0;
  bool none_blocked = true;
  for (const Point& p : points) {
    none_blocked &= !(p.form_factor > 0) || p.seen == rays;
    sight.points += p.form_factor > 0 ? 1U : 0U;
    all[p.node] += p.form_factor;
    sight.at_nodes[p.node] += p.form_factor * p.Share(rays);
    sum += p.form_factor;
  }
  if (!(sum > 0)) {
    // No point faces any patch of the group: no rays were traced, and nothing
    // is known of what stands in between.
    sight.at_nodes.fill(1);
    sight.fraction = 1;
    return sight;
  }
  const float seen =
      std::accumulate(sight.at_nodes.begin(), sight.at_nodes.end(), 0.0F);
  sight.fraction = none_blocked ? 1 : seen / sum;
  for (size_t g = 0; g < kTransferNodes; ++g) {
    sight.at_nodes[g] =
        all[g] > 0 ? sight.at_nodes[g] / all[g] : sight.fraction;
  }
  for (const Point& p : points) {
    const float v = p.Share(rays);
    const float weight = p.form_factor / sum;
    sight.by_receiver += weight * (v - sight.fraction) * (v - sight.fraction);
    sight.by_source += weight * v * (1 - v);
  }
  if (rays > 1) {
    const auto n = static_cast<float>(rays);
    sight.by_source *= n / (n - 1);
    // Subtract the variance between points that stems from their few rays.
    sight.by_receiver = std::max(0.0F, sight.by_receiver - sight.by_source / n);
  }
  return sight;
}

}  // namespace enfilade
