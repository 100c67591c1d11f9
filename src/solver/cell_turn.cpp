#include "solver/cell_turn.h"

#include "base/stopwatch.h"
#include "solver/cell_balance.h"
#include "solver/error_control.h"
#include "solver/least_memory.h"
#include "solver/pair_refinement.h"
#include "solver/refine/cover.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace enfilade {
namespace {

// The error at a cover's edge may be this many tau:
// docs/decisions/0011-oracle.md.
constexpr double kCoverShare = 6;
// The most cycles of the balance within a cell.
constexpr uint32_t kMostCycles = 40;

// Whether no part of a cell's turn has been done.
bool IsAtStart(const PairCursor& cursor) {
  return cursor.source == 0 && cursor.chunk == 0 && cursor.cycle == 0 &&
         cursor.work == WorkPart{};
}

// Surfaces that all have this reflectance and emit nothing.
SurfaceTable AllGrey(const SurfaceTable& like, float reflectance) {
  SurfaceTable grey = like;
  std::fill(grey.reflectance.begin(), grey.reflectance.end(), reflectance);
  std::fill(grey.exitance.begin(), grey.exitance.end(), 0.0F);
  return grey;
}

// Whether the source has sent anything since the cell's last turn.
bool HasSent(const SolveState& state, CellId source, CellId cell) {
  return source != cell && state.cells[source.Index()].published >
                               state.cells[cell.Index()].processed;
}

}  // namespace

CellTurn::CellTurn(SolveContext& context, Checkpoints& checkpoints, CellId cell)
    : context_(&context), checkpoints_(&checkpoints), r_(context, cell) {}

CellTurn::~CellTurn() {
  checkpoints_->SaveWith({});
  checkpoints_->SetShareOfCell(0);
}

// -------------------------------------------------------------- refinement

void CellTurn::Refine() {
  CellPager& pager = context_->pager;
  const size_t patches = r_.geometry->patches.size();
  r_.care_charge =
      pager.Reserve(patches * sizeof(PatchCare), "the care of a cell");
  r_.care = context_->ReadOnce(
      [&] { return LoadCellCare(context_->store, r_.id, patches); });
  checkpoints_->SaveWith([this] {
    KeepForReaders();
    if (!r_.care.empty()) {
      SaveCellCare(r_.care, r_.id, context_->store);
    }
  });
  const bool begins = IsAtStart(context_->state.cursor);
  if (begins) {
    BeginRefinement();
  }
  // All pairs are done if the solve was stopped while light was balanced.
  if (context_->state.cursor.source < r_.sources.size()) {
    RefinePairs(begins);
  }
  FreeVector(&r_.care);
  r_.care_charge.Reset();
  Settle();
  ReceivedLight::ForgetKept(context_->store, r_.id);
}

void CellTurn::BeginRefinement() {
  for (PatchCare& care : r_.care) {
    care.links = 0;
  }
  CellRow& row = context_->state.cells[r_.id.Index()];
  row.links = 0;
  row.squared_error = 0;
  row.hold = 0;
  row.most_radius = 1;
  r_.received->SetZero();
  context_->pager.ForgetDelta(r_.id);
  context_->pager.MarkReceivedDirty(r_.id);
}

// If a commit falls within a cell's refinement, readers of the store get the
// light that the cell had before the refinement.
void CellTurn::KeepForReaders() {
  const SolveState& state = context_->state;
  if (state.round > 0 && !IsAtStart(state.cursor)) {
    context_->ReadOnce([&] {
      ReceivedLight::KeepForReaders(context_->store, r_.id);
      return true;
    });
  }
}

// Makes the links from the sources that are left.
void CellTurn::RefinePairs(bool begins) {
  SolveState& state = context_->state;
  const MemoryCharge workspace =
      context_->pager.Reserve(kRefineWorkspaceBytes, "the links of a cell");
  const uint64_t rays = FindReceivers();
  state.rays += begins ? rays : 0;  // not again if resumed
  PairRefinement pairs(*context_, *checkpoints_, r_);
  while (state.cursor.source < r_.sources.size()) {
    pairs.Refine(r_.sources[state.cursor.source]);
    state.cursor = {state.cursor.source + 1, {}, 0, 0};
    checkpoints_->Pass();
  }
  context_->chunks.Finish();
  SaveCellCare(r_.care, r_.id, context_->store);
  r_.receivers.reset();
  FreeVector(&r_.weights);
  r_.receivers_charge.Reset();
}

uint64_t CellTurn::FindReceivers() {
  SolveState& state = context_->state;
  const Stopwatch watch(&state.times.refine_seconds);
  const auto& patches = r_.geometry->patches;
  const ReflectedLight light(*r_.tree, patches, context_->surfaces, r_.care);
  CoverOptions options;
  options.tau = kCoverShare * state.tau;
  options.seed = context_->SeedOfRound();
  const auto occluder = context_->pager.Occluder(r_.id);
  Covers covers = FindCovers(
      options,
      {r_.id, patches, r_.geometry->clusters.get(), occluder.get(), &light});
  r_.receivers_charge =
      context_->pager.Reserve(ClusterTree::BytesFor(covers.receivers.size()) +
                                  covers.receivers.size() * sizeof(float),
                              "the receivers of a cell");
  r_.receivers =
      std::make_unique<ClusterTree>(patches, std::move(covers.receivers));
  r_.weights =
      ReceiverWeights({.id = r_.id,
                       .patches = patches,
                       .clusters = r_.receivers.get(),
                       .care = r_.care,
                       .least_reflectance = context_->least_reflectance});
  return covers.rays;
}

// ------------------------------------------------------------- propagation

bool CellTurn::HasNews(SolveContext& context, CellId cell) {
  const std::vector<CellId> seen = context.pager.Order().SeenFrom(cell);
  return std::any_of(seen.begin(), seen.end(), [&](CellId source) {
    return HasSent(context.state, source, cell);
  });
}

void CellTurn::Propagate() {
  PairCursor& cursor = context_->state.cursor;
  if (cursor.source == 0) {
    context_->pager.ForgetDelta(r_.id);
  }
  while (cursor.source < r_.sources.size()) {
    const CellId source = r_.sources[cursor.source].source;
    if (HasSent(context_->state, source, r_.id)) {
      GatherPair(source);
    }
    ++cursor.source;
    checkpoints_->Pass();
  }
  Settle();
}

void CellTurn::GatherPair(CellId source) {
  CellPager& pager = context_->pager;
  // Half of all visible pairs have no links, and reading a tree for nothing is
  // expensive: docs/decisions/schedules.md.
  if (!pager.Order().IsLinked(r_.id, source)) {
    return;
  }
  pager.Order().MoveTo(r_.id, source);
  const auto geometry = pager.Geometry(source);
  const auto tree = pager.Elements(source);
  const auto delta = pager.Delta(source);
  if (delta->Size() == 0) {
    return;
  }
  const Stopwatch watch(&context_->state.times.gather_seconds);
  pager.VisitLinks(
      {r_.id, source},
      {r_.tree->Size(), tree->Size(), geometry->groups.All().size()},
      [&](const LinkBlock& block) {
        Gather(block,
               {r_.geometry->patches, r_.tree.get(), nullptr},
               SourceSide(*geometry, *tree),
               *delta,
               r_.received->gathered);
      });
  pager.MarkReceivedDirty(r_.id);
}

// ------------------------------------------------------------- the balance

void CellTurn::Settle() {
  CellPager& pager = context_->pager;
  SolveState& state = context_->state;
  pager.Order().MoveTo(r_.id, r_.id);
  pager.ForgetWeights(r_.id);
  CellRow& row = state.cells[r_.id.Index()];
  const auto delta = pager.Delta(r_.id);
  CellBalance balance({r_.id,
                       r_.geometry.get(),
                       r_.tree.get(),
                       delta.get(),
                       r_.received.get(),
                       &row},
                      context_->surfaces,
                      pager,
                      context_->store,
                      &state.times);
  // Commits fall between cycles; all state of a cycle is then in the store.
  const double tolerance = ToleratedResidual(state, row);
  while (state.cursor.cycle < kMostCycles && !balance.RunCycle(tolerance)) {
    ++state.cursor.cycle;
    checkpoints_->Pass();
  }
  const bool was_lit = context_->IsLit(r_.id);
  const auto& patches = r_.geometry->patches;
  const CellBalance::Light light = balance.Sum();
  row.residual = light.unsent;
  row.reflected =
      context_->is_black
          ? LeavingFlux({*r_.tree,
                         patches,
                         AllGrey(context_->surfaces, kLeastWeightReflectance),
                         &r_.received->gathered})
          : light.leaving - EmittedFlux(patches, context_->surfaces);
  row.peak = r_.tree->Sent().MaxAbs();
  row.elements = r_.tree->Size();
  row.processed = ++state.tick;
  if (state.phase == SolvePhase::kRefine) {
    row.changed = SumOverLeaves(*r_.tree, patches, *delta).squared;
  }
  const bool sends = r_.sources.size() > 1;
  if (delta->MaxAbs() > 0) {
    row.published = state.tick;
    state.published_in_sweep |= sends;
  }
  if (!was_lit && context_->IsLit(r_.id) && sends) {
    row.lit_late_in = state.round + uint64_t{1};
  }
  r_.tree->UpdateDetail();
  assert(r_.tree->IsValid() && delta->IsFinite());
  pager.MarkDirty(r_.id);
  pager.MarkReceivedDirty(r_.id);
  pager.RenewWeights(r_.id);
}

}  // namespace enfilade
