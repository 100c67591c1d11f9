#include "solver/cell_turn.h"

#include "base/stopwatch.h"
#include "solver/cell_balance.h"
#include "solver/error_control.h"
#include "solver/least_memory.h"
#include "solver/links/gather.h"
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
    : context_(&context), checkpoints_(&checkpoints), cell_(context, cell) {}

CellTurn::~CellTurn() {
  checkpoints_->SaveWith(nullptr);
  checkpoints_->SetShareOfTurn(0);
}

// -------------------------------------------------------------- refinement

void CellTurn::Refine() {
  CellPager& pager = context_->pager;
  const size_t patches = cell_.geometry->patches.size();
  cell_.care_charge =
      pager.Items().Reserve(patches * sizeof(PatchCare), "the care of a cell");
  cell_.care = context_->ReadOnce(
      [&] { return LoadCellCare(context_->store, cell_.id, patches); });
  checkpoints_->SaveWith([this] {
    KeepForReaders();
    if (!cell_.care.empty()) {
      SaveCellCare(cell_.care, cell_.id, context_->store);
    }
  });
  const bool begins = IsAtStart(context_->state.cursor);
  if (begins) {
    BeginRefinement();
  }
  // All pairs are done if the solve was stopped while light was balanced.
  if (context_->state.cursor.source < cell_.sources.size()) {
    RefinePairs(begins);
  }
  FreeVector(&cell_.care);
  cell_.care_charge.Reset();
  Settle();
  ReceivedLight::ForgetKept(context_->store, cell_.id);
}

void CellTurn::BeginRefinement() {
  for (PatchCare& care : cell_.care) {
    care.links = 0;
  }
  CellRow& row = context_->state.cells[cell_.id.Index()];
  row.links = 0;
  row.squared_error = 0;
  row.hold = 0;
  row.most_radius = 1;
  cell_.received->SetZero();
  context_->pager.ForgetDelta(cell_.id);
  context_->pager.MarkReceivedDirty(cell_.id);
}

// If a commit falls within a cell's refinement, readers of the store get the
// light that the cell had before the refinement.
void CellTurn::KeepForReaders() {
  const SolveState& state = context_->state;
  if (state.round > 0 && !IsAtStart(state.cursor)) {
    context_->ReadOnce(
        [&] { ReceivedLight::KeepForReaders(context_->store, cell_.id); });
  }
}

// Makes the links from the sources that are left.
void CellTurn::RefinePairs(bool begins) {
  SolveState& state = context_->state;
  const MemoryCharge workspace = context_->pager.Items().Reserve(
      kRefineWorkspaceBytes, "the links of a cell");
  const uint64_t rays = FindReceivers();
  state.rays += begins ? rays : 0;  // not again if resumed
  PairRefinement pairs(*context_, *checkpoints_, cell_);
  while (state.cursor.source < cell_.sources.size()) {
    pairs.Refine();
    state.cursor = {state.cursor.source + 1, {}, 0, 0};
    checkpoints_->Pass();
  }
  context_->chunks.Finish();
  SaveCellCare(cell_.care, cell_.id, context_->store);
  cell_.receivers.reset();
  FreeVector(&cell_.weights);
  cell_.receivers_charge.Reset();
}

uint64_t CellTurn::FindReceivers() {
  SolveState& state = context_->state;
  const Stopwatch watch(&state.times.refine_seconds);
  const auto& patches = cell_.geometry->patches;
  const ReflectedLight light(
      *cell_.tree, patches, context_->surfaces, cell_.care);
  CoverOptions options;
  options.tau = kCoverShare * state.tau;
  options.seed = context_->SeedOfRound();
  const auto blockers = context_->pager.RayBlockersOf(cell_.id);
  Covers covers = FindCovers(options,
                             {cell_.id,
                              patches,
                              cell_.geometry->clusters.get(),
                              blockers.get(),
                              &light});
  cell_.receivers_charge = context_->pager.Items().Reserve(
      ClusterTree::BytesFor(covers.receivers.size()) +
          covers.receivers.size() * sizeof(float),
      "the receivers of a cell");
  cell_.receivers =
      std::make_unique<ClusterTree>(patches, std::move(covers.receivers));
  cell_.weights =
      WeighReceiver({.id = cell_.id,
                     .patches = patches,
                     .clusters = cell_.receivers.get(),
                     .care = cell_.care,
                     .least_reflectance = context_->surface.least_reflectance});
  return covers.rays;
}

// ------------------------------------------------------------- propagation

bool CellTurn::HasNews(SolveContext& context, CellId cell) {
  const std::vector<CellId> seen = context.pager.Pairs().SeenFrom(cell);
  return std::any_of(seen.begin(), seen.end(), [&](CellId source) {
    return HasSent(context.state, source, cell);
  });
}

void CellTurn::Propagate() {
  PairCursor& cursor = context_->state.cursor;
  if (cursor.source == 0) {
    context_->pager.ForgetDelta(cell_.id);
  }
  while (cursor.source < cell_.sources.size()) {
    const CellId source = cell_.sources[cursor.source].source;
    if (HasSent(context_->state, source, cell_.id)) {
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
  if (!pager.Pairs().IsLinked(cell_.id, source)) {
    return;
  }
  pager.Order().MoveTo(cell_.id, source);
  const auto geometry = pager.Geometry(source);
  const auto tree = pager.Elements(source);
  const auto delta = pager.Delta(source);
  if (delta->Size() == 0) {
    return;
  }
  const Stopwatch watch(&context_->state.times.gather_seconds);
  pager.Links().Visit(
      {cell_.id, source},
      {cell_.tree->Size(), tree->Size(), geometry->groups.All().size()},
      [&](const LinkBlock& block) {
        Gather(block,
               {cell_.geometry->patches, cell_.tree.get(), nullptr},
               SourceSide(*geometry, *tree),
               *delta,
               cell_.received->gathered);
      });
  pager.MarkReceivedDirty(cell_.id);
}

// ------------------------------------------------------------- the balance

void CellTurn::Settle() {
  CellPager& pager = context_->pager;
  SolveState& state = context_->state;
  pager.Order().MoveTo(cell_.id, cell_.id);
  pager.ForgetWeights(cell_.id);
  const auto delta = pager.Delta(cell_.id);
  const CellBalance::Light light = Balance(delta.get());
  CellRow& row = state.cells[cell_.id.Index()];
  const bool was_lit = context_->IsLit(cell_.id);
  RecordLight(light, &row);
  row.elements = cell_.tree->Size();
  row.processed = ++state.tick;
  if (state.phase == SolvePhase::kRefine) {
    row.changed =
        SumOverLeaves(*cell_.tree, cell_.geometry->patches, *delta).squared;
  }
  const bool sees_others = cell_.sources.size() > 1;
  if (delta->MaxAbs() > 0) {
    row.published = state.tick;
    state.published_in_sweep |= sees_others;
  }
  if (!was_lit && context_->IsLit(cell_.id) && sees_others) {
    row.lit_late_in = state.round + uint64_t{1};
  }
  cell_.tree->UpdateDetail();
  assert(cell_.tree->IsValid() && delta->IsFinite());
  pager.MarkDirty(cell_.id);
  pager.MarkReceivedDirty(cell_.id);
  pager.RenewWeights(cell_.id);
}

// Commits fall between cycles; all state of a cycle is then in the store.
CellBalance::Light CellTurn::Balance(CoefficientArray* delta) {
  SolveState& state = context_->state;
  CellRow& row = state.cells[cell_.id.Index()];
  CellBalance balance({cell_.id,
                       cell_.geometry.get(),
                       cell_.tree.get(),
                       delta,
                       cell_.received.get(),
                       &row},
                      context_->surfaces,
                      context_->pager,
                      context_->store,
                      &state.times);
  const double tolerance = ToleratedResidual(state, row);
  while (state.cursor.cycle < kMostCycles && !balance.RunCycle(tolerance)) {
    ++state.cursor.cycle;
    checkpoints_->Pass();
  }
  return balance.Sum();
}

void CellTurn::RecordLight(const CellBalance::Light& light,
                           CellRow* row) const {
  const auto& patches = cell_.geometry->patches;
  row->residual = light.unsent;
  row->reflected =
      context_->surface.is_black
          ? LeavingFlux({*cell_.tree,
                         patches,
                         AllGrey(context_->surfaces, kLeastWeightReflectance),
                         &cell_.received->gathered})
          : light.leaving - EmittedFlux(patches, context_->surfaces);
  row->peak = cell_.tree->Sent().MaxAbs();
}

}  // namespace enfilade
