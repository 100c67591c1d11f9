// The part of the engine that gives a cell its turn.

#include "base/random.h"
#include "base/stopwatch.h"
#include "solver/cell_balance.h"
#include "solver/engine.h"
#include "solver/error_control.h"
#include "solver/least_memory.h"
#include "solver/refine/cover.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace enfilade {
namespace {

// The error at a cover's edge may be this many tau:
// docs/decisions/0011-oracle.md.
constexpr double kCoverShare = 6;
// A cell counts as lit above this share of the mean reflected radiosity.
constexpr double kDarkShare = 1e-6;
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

}  // namespace

// Runs `read`, and records its bytes as data that a cell's turn reads only
// once.
template <typename Read>
auto Engine::ReadOnce(const Read& read) {
  const uint64_t before = store_->Stats().bytes_read;
  auto result = read();
  pager_.Trace().AddReadOnce(store_->Stats().bytes_read - before);
  return result;
}

Engine::Receiver Engine::Load(CellId cell) {
  Receiver r;
  r.id = cell;
  r.sources = SourcesOf(cell, &r.sources_charge);
  const auto self = std::find_if(
      r.sources.begin(), r.sources.end(), [&](const VisibleCell& v) {
        return v.source == cell;
      });
  if (self == r.sources.end()) {
    r.sources.push_back({cell, {cell}});
  } else {
    std::rotate(self, self + 1, r.sources.end());
  }
  pager_.StartTurn(cell, r.sources);
  r.geometry = pager_.Geometry(cell);
  r.tree = pager_.Tree(cell);
  r.received = pager_.Received(cell);
  return r;
}

// What a cell sees, with the cells in between during refinement.
VisibleSet Engine::SourcesOf(CellId cell, MemoryCharge* charge) {
  const auto reserve = [&](uint64_t bytes) {
    *charge = pager_.Reserve(bytes, "what a cell sees");
  };
  if (state_.phase == SolvePhase::kRefine) {
    return ReadOnce([&] { return LoadVisibleSet(*store_, cell, reserve); });
  }
  const std::vector<CellId> seen = pager_.Order().SeenFrom(cell);
  reserve((seen.size() + 1) * sizeof(VisibleCell));
  VisibleSet sources;
  sources.reserve(seen.size() + 1);  // and the cell itself
  for (const CellId source : seen) {
    sources.push_back({source, {}});
  }
  return sources;
}

bool Engine::IsLit(CellId cell) const {
  return static_cast<double>(state_.cells[cell.Index()].peak) >
         kDarkShare * state_.mean_reflected;
}

uint64_t Engine::FindReceivers(Receiver* receiver) {
  const Receiver& r = *receiver;
  const Stopwatch watch(&state_.times.refine_seconds);
  const auto& patches = r.geometry->patches;
  const ReflectedLight light(*r.tree, patches, surfaces_, care_);
  CoverOptions options;
  options.tau = kCoverShare * state_.tau;
  options.seed = MixKey(state_.seed, state_.round);
  const auto occluder = pager_.Occluder(r.id);
  Covers covers = FindCovers(
      options,
      {r.id, patches, r.geometry->clusters.get(), occluder.get(), &light});
  receiver->receivers_charge =
      pager_.Reserve(ClusterTree::BytesFor(covers.receivers.size()) +
                         covers.receivers.size() * sizeof(float),
                     "the receivers of a cell");
  receiver->receivers =
      std::make_unique<ClusterTree>(patches, std::move(covers.receivers));
  receiver->weights =
      ReceiverWeights({.id = r.id,
                       .patches = patches,
                       .clusters = receiver->receivers.get(),
                       .care = care_,
                       .least_reflectance = least_reflectance_});
  return covers.rays;
}

// If a commit falls within a cell's refinement, readers of the store get the
// light that the cell had before the refinement.
void Engine::KeepForReaders() {
  if (state_.phase != SolvePhase::kRefine || state_.round == 0 ||
      IsAtStart(state_.cursor)) {
    return;
  }
  const CellId cell(state_.next_cell);
  const uint64_t before = store_->Stats().bytes_read;
  ReceivedLight::KeepForReaders(*store_, cell);
  pager_.Trace().AddReadOnce(store_->Stats().bytes_read - before);
}

void Engine::RefineCell(CellId cell) {
  Receiver r = Load(cell);
  const size_t patches = r.geometry->patches.size();
  MemoryCharge care_charge =
      pager_.Reserve(patches * sizeof(PatchCare), "the care of a cell");
  care_ = ReadOnce([&] { return LoadCellCare(*store_, cell, patches); });
  CellRow& row = state_.cells[cell.Index()];
  const bool begins = IsAtStart(state_.cursor);
  if (begins) {
    for (PatchCare& care : care_) {
      care.links = 0;
    }
    row.links = 0;
    row.squared_error = 0;
    row.hold = 0;
    row.most_radius = 1;
    r.received->SetZero();
    pager_.ForgetDelta(cell);
    pager_.MarkReceivedDirty(cell);
  }
  // All pairs are done if the solve was stopped while light was balanced.
  if (state_.cursor.source < r.sources.size()) {
    RefinePairs(&r, begins);
  }
  FreeVector(&care_);
  care_charge.Reset();
  Settle(r);
  ReceivedLight::ForgetKept(*store_, cell);
  NextCell();
}

// Makes the links from the sources that are left.
void Engine::RefinePairs(Receiver* receiver, bool begins) {
  Receiver& r = *receiver;
  MemoryCharge workspace =
      pager_.Reserve(kRefineWorkspaceBytes, "the links of a cell");
  const uint64_t rays = FindReceivers(&r);
  state_.rays += begins ? rays : 0;  // not again if resumed
  while (state_.cursor.source < r.sources.size()) {
    RefinePair(r, r.sources[state_.cursor.source]);
    state_.cursor = {state_.cursor.source + 1, {}, 0, 0};
    CheckPoint();
  }
  chunks_.Finish();
  SaveCellCare(care_, r.id, *store_);
  r.receivers.reset();
  FreeVector(&r.weights);
  r.receivers_charge.Reset();
}

void Engine::PropagateCell(CellId cell) {
  CellRow& row = state_.cells[cell.Index()];
  const auto has_news = [&](CellId source) {
    return source != cell &&
           state_.cells[source.Index()].published > row.processed;
  };
  const std::vector<CellId> seen = pager_.Order().SeenFrom(cell);
  if (std::none_of(seen.begin(), seen.end(), has_news)) {
    NextCell();
    return;
  }
  Receiver r = Load(cell);
  if (state_.cursor.source == 0) {
    pager_.ForgetDelta(cell);
  }
  while (state_.cursor.source < r.sources.size()) {
    const CellId source = r.sources[state_.cursor.source].source;
    if (has_news(source)) {
      GatherPair(r, source);
    }
    ++state_.cursor.source;
    CheckPoint();
  }
  Settle(r);
  NextCell();
}

// Balances the light within a receiver and updates its row: the receiver's turn
// is over. Commits fall between cycles. All state of a cycle is in the store,
// so a run that resumes after a commit yields the same bits.
void Engine::Settle(const Receiver& r) {
  pager_.Order().MoveTo(r.id, r.id);
  pager_.ForgetWeights(r.id);
  CellRow& row = state_.cells[r.id.Index()];
  const auto delta = pager_.Delta(r.id);
  CellBalance balance({r.id,
                       r.geometry.get(),
                       r.tree.get(),
                       delta.get(),
                       r.received.get(),
                       &row},
                      surfaces_,
                      pager_,
                      *store_,
                      &state_.times);
  const double tolerance = ToleratedResidual(state_, row);
  while (state_.cursor.cycle < kMostCycles && !balance.RunCycle(tolerance)) {
    ++state_.cursor.cycle;
    CheckPoint();
  }
  const bool was_lit = IsLit(r.id);
  const auto& patches = r.geometry->patches;
  const CellBalance::Light light = balance.Sum();
  row.residual = light.unsent;
  row.reflected =
      is_black_ ? LeavingFlux({*r.tree,
                               patches,
                               AllGrey(surfaces_, kLeastWeightReflectance),
                               &r.received->gathered})
                : light.leaving - EmittedFlux(patches, surfaces_);
  row.peak = r.tree->Sent().MaxAbs();
  row.elements = r.tree->Size();
  row.processed = ++state_.tick;
  if (state_.phase == SolvePhase::kRefine) {
    row.changed = SumOverLeaves(*r.tree, patches, *delta).squared;
  }
  if (delta->MaxAbs() > 0) {
    row.published = state_.tick;
    state_.published_in_sweep |= r.sources.size() > 1;
  }
  if (!was_lit && IsLit(r.id) && r.sources.size() > 1) {
    row.lit_late_in = state_.round + uint64_t{1};
  }
  r.tree->UpdateDetail();
  assert(r.tree->IsValid() && delta->IsFinite());
  pager_.MarkDirty(r.id);
  pager_.MarkReceivedDirty(r.id);
  pager_.RenewWeights(r.id);
}

}  // namespace enfilade
