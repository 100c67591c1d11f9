#include "solver/cell_balance.h"

#include "base/stopwatch.h"
#include "solver/gather.h"
#include "solver/held_gain.h"

#include <algorithm>

namespace enfilade {
namespace {

// The semi-iteration takes transport for symmetric. Sampled links are not
// quite: where unsent light grows, a smaller radius may do, down to one that
// hardly minds; growth beyond that is of the links' gains.
constexpr double kTolerantRadius = 0.5;
constexpr double kCautious = 0.8;
// Then steps end: what has grown leaves its rounding errors behind.
constexpr double kMostGrowth = 3;
constexpr int kCycleSteps = 8;
constexpr const char* kPurpose = "the working arrays of a cell";

}  // namespace

CellBalance::CellBalance(const BalancedCell& cell,
                         const SurfaceTable& surfaces,
                         CellPager& pager,
                         SolveTimes* times)
    : cell_(cell), surfaces_(&surfaces), pager_(&pager), times_(times) {
  HoldGains();
  const uint64_t array = cell.tree->Sent().SizeBytes();
  work_charge_ = pager.Reserve(2 * array, kPurpose);
  if (!cell.tree->HasDelta()) {
    pager.Reserve(array, kPurpose).Reset();  // room for it
    cell.tree->StartDelta();
    pager.MarkDirty(cell.id);
  }
}

void CellBalance::HoldGains() {
  const HoldLevel level = cell_.row->hold;
  const CoefficientArray& gain = cell_.received->gain;
  kept_charge_ = pager_->Reserve(HeldSharesBytes(gain, level), kPurpose);
  kept_ = HeldShares(*cell_.tree, gain, cell_.geometry->patches, level);
}

CoefficientArray CellBalance::Radiosity() const {
  const Stopwatch watch(&times_->push_pull_seconds);
  return PushPull(*cell_.tree,
                  cell_.received->gathered,
                  cell_.geometry->patches,
                  *surfaces_,
                  kept_);
}

bool CellBalance::RunCycle(double tolerance) {
  CellRow& row = *cell_.row;
  SemiIteration iteration(row.radius);
  const CycleEnd end = Iterate(tolerance, &iteration);
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

CellBalance::CycleEnd CellBalance::Iterate(double tolerance,
                                           SemiIteration* iteration) {
  CellTree& tree = *cell_.tree;
  const auto& patches = cell_.geometry->patches;
  const GatherSide side{patches, &tree, &cell_.geometry->groups};
  CoefficientArray step(tree.Shape().Stride());
  step.GrowTo(tree.Size());
  double first = 0;
  double last = 0;
  for (int i = 0; i < kCycleSteps; ++i) {
    CoefficientArray unsent = Radiosity();
    unsent.Subtract(tree.Sent());
    last = SumOverLeaves(tree, patches, unsent).absolute;
    first = i == 0 ? last : first;
    if (last <= tolerance) {
      return CycleEnd::kSettled;
    }
    if (last > kMostGrowth * first) {
      return CycleEnd::kGrew;
    }
    const auto weight = static_cast<float>(iteration->NextWeight(last));
    step.Blend(weight, unsent, weight - 1);
    const Stopwatch watch(&times_->gather_seconds);
    const LinkEnds ends{tree.Size(), tree.Size(), side.groups->All().size()};
    pager_->VisitLinks({cell_.id, cell_.id}, ends, [&](const LinkBlock& block) {
      Gather(block, side, side, step, cell_.received->gathered);
    });
    tree.Sent().Add(step);
    tree.Delta().Add(step);
    pager_->MarkDirty(cell_.id);
    pager_->MarkReceivedDirty(cell_.id);
  }
  return last < first ? CycleEnd::kShrank : CycleEnd::kGrew;
}

}  // namespace enfilade
