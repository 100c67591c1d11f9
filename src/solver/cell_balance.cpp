#include "solver/cell_balance.h"

#include "base/stopwatch.h"
#include "solver/elements/coefficient_pages.h"
#include "solver/links/gather.h"
#include "solver/state/held_gain.h"

#include <algorithm>
#include <functional>
#include <vector>

namespace enfilade {
namespace {

// The semi-iteration assumes that transport is symmetric, which sampled links
// are only roughly. Where unsent light grows, a smaller radius may help, down
// to kTolerantRadius, which hardly depends on the symmetry. Growth beyond that
// comes from the links' gains.
constexpr double kTolerantRadius = 0.5;
constexpr double kCautious = 0.8;
// A cycle ends if unsent light has grown by this factor: light that has grown
// leaves its rounding errors behind.
constexpr double kMostGrowth = 3;
constexpr int kCycleSteps = 8;
constexpr const char* kPurpose = "the working arrays of a cell";

BlockKey AsideKey(CellId cell) {
  return {BlockKind::kScratch, cell.value};
}

}  // namespace

CellBalance::CellBalance(const BalancedCell& cell,
                         const SurfaceTable& surfaces,
                         CellPager& pager,
                         BlockStorage& store,
                         SolveTimes* times)
    : cell_(cell),
      surfaces_(&surfaces),
      pager_(&pager),
      store_(&store),
      times_(times) {
  HoldGains();
  if (cell.delta->Size() == 0) {
    StartDelta();
  }
}

void CellBalance::StartDelta() {
  pager_->Items().Reserve(cell_.tree->Sent().SizeBytes(), kPurpose).Reset();
  cell_.delta->GrowTo(cell_.tree->Size());
  pager_->MarkDeltaDirty(cell_.id);
}

void CellBalance::HoldGains() {
  const HoldLevel level = cell_.row->hold;
  const CoefficientArray& gain = cell_.received->gain;
  kept_ = CoefficientArray(1);  // both at once are not foreseen
  kept_charge_.Reset();
  kept_charge_ =
      pager_->Items().Reserve(HeldSharesBytes(gain, level), kPurpose);
  kept_ = HeldShares(*cell_.tree, gain, cell_.geometry->patches, level);
}

ReflectingCell CellBalance::Reflecting() const {
  return {*cell_.tree,
          cell_.geometry->patches,
          *surfaces_,
          &cell_.received->gathered,
          &kept_};
}

void CellBalance::VisitUnsent(const UnsentVisitor& visit) const {
  const Stopwatch watch(&times_->push_pull_seconds);
  const CellTree& tree = *cell_.tree;
  const ReflectingCell reflecting = Reflecting();
  std::vector<std::vector<float>> unsent(
      BlockCount(reflecting), std::vector<float>(tree.Shape().Stride()));
  VisitRadiosity(reflecting,
                 [&](size_t block, ElementId e, std::span<const float> b) {
                   const auto sent = tree.Sent()[e];
                   std::transform(b.begin(),
                                  b.end(),
                                  sent.begin(),
                                  unsent[block].begin(),
                                  std::minus<>());
                   visit(block, e, b, unsent[block]);
                 });
}

CellBalance::Light CellBalance::Sum() const {
  std::vector<LeafSums> all(BlockCount(Reflecting()));
  std::vector<LeafSums> unsent(all.size());
  VisitUnsent([&](size_t block,
                  ElementId e,
                  std::span<const float> radiosity,
                  std::span<const float> difference) {
    AddIfLeaf(e, radiosity, &all[block]);
    AddIfLeaf(e, difference, &unsent[block]);
  });
  return {Total(all).value, Total(unsent).absolute};
}

void CellBalance::AddIfLeaf(ElementId id,
                            std::span<const float> values,
                            LeafSums* sums) const {
  const Element& e = cell_.tree->At(id);
  if (e.first_child == 0) {
    AddLeaf(cell_.tree->Shape(),
            cell_.geometry->patches[e.patch],
            e.frame,
            values,
            sums);
  }
}

bool CellBalance::RunCycle(double tolerance) {
  CellRow& row = *cell_.row;
  SemiIteration iteration(row.radius);
  PutDeltaAside();
  const CycleEnd end = Iterate(tolerance, &iteration);
  TakeDeltaBack();
  if (end == CycleEnd::kSettled) {
    return true;
  }
  if (end == CycleEnd::kShrank) {
    row.radius = std::min(iteration.LearntRadius(), row.most_radius);
  } else if (row.radius > kTolerantRadius) {
    row.most_radius = std::max(kTolerantRadius, kCautious * row.radius);
    row.radius = kTolerantRadius;
  } else {
    row.most_radius = 1;
    row.hold = std::min<HoldLevel>(row.hold + 1, kMostHold);
    HoldGains();
  }
  return false;
}

// The delta becomes what other cells have already been told of: all of `sent`
// except the delta. That difference does not change while `sent` does.
void CellBalance::PutDeltaAside() {
  const CoefficientArray& sent = cell_.tree->Sent();
  cell_.delta->Blend(1, sent, -1);
  const uint64_t bytes = sent.SizeBytes();
  step_charge_ = pager_->Items().ReserveIfPossible(bytes, kPurpose);
  is_delta_stored_ = step_charge_.Bytes() < bytes;
  if (is_delta_stored_) {
    const Stopwatch watch(&times_->store_seconds);
    SavePages(*store_, AsideKey(cell_.id), *cell_.delta);
    cell_.delta->Clear();
    pager_->MarkDeltaDirty(cell_.id);
    step_charge_ = pager_->Items().Reserve(bytes, kPurpose);
  }
}

void CellBalance::TakeDeltaBack() {
  step_charge_.Reset();
  if (is_delta_stored_) {
    const Stopwatch watch(&times_->store_seconds);
    StartDelta();
    LoadPages(*store_, AsideKey(cell_.id), cell_.tree->Size(), cell_.delta);
    store_->EraseAll(BlockKind::kScratch, cell_.id.value);
  }
  cell_.delta->Blend(1, cell_.tree->Sent(), -1);
  pager_->MarkDeltaDirty(cell_.id);
}

CellBalance::CycleEnd CellBalance::Iterate(double tolerance,
                                           SemiIteration* iteration) {
  CellTree& tree = *cell_.tree;
  const GatherSide side{
      cell_.geometry->patches, &tree, &cell_.geometry->groups};
  CoefficientArray step(tree.Shape().Stride());
  step.GrowTo(tree.Size());
  double first = 0;
  double last = 0;
  for (int i = 0; i < kCycleSteps; ++i) {
    last = NextStep(static_cast<float>(iteration->NextWeight()), &step);
    first = i == 0 ? last : first;
    if (last <= tolerance) {
      return CycleEnd::kSettled;
    }
    if (last > kMostGrowth * first) {
      return CycleEnd::kGrew;
    }
    iteration->Saw(last);
    const Stopwatch watch(&times_->gather_seconds);
    const LinkEnds ends{tree.Size(), tree.Size(), side.groups->All().size()};
    pager_->Links().Visit(
        {cell_.id, cell_.id}, ends, [&](const LinkBlock& block) {
          Gather(block, side, side, step, cell_.received->gathered);
        });
    tree.Sent().Add(step);
    pager_->MarkDirty(cell_.id);
    pager_->MarkReceivedDirty(cell_.id);
  }
  return last < first ? CycleEnd::kShrank : CycleEnd::kGrew;
}

double CellBalance::NextStep(float weight, CoefficientArray* step) const {
  std::vector<LeafSums> sums(BlockCount(Reflecting()));
  VisitUnsent([&](size_t block,
                  ElementId e,
                  std::span<const float> /*radiosity*/,
                  std::span<const float> unsent) {
    AddIfLeaf(e, unsent, &sums[block]);
    const auto own = (*step)[e];
    for (size_t k = 0; k < own.size(); ++k) {
      own[k] = weight * unsent[k] + (weight - 1) * own[k];
    }
  });
  return Total(sums).absolute;
}

}  // namespace enfilade
