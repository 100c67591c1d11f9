#include "solver/engine.h"

#include "base/random.h"
#include "base/stopwatch.h"
#include "solver/cell_balance.h"
#include "solver/cover.h"
#include "solver/error_control.h"
#include "solver/least_memory.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Covers may leave edges of this many tau: docs/decisions/0011-oracle.md.
constexpr double kCoverShare = 6;
// A cell counts as lit from this share of the mean radiosity on.
constexpr double kDarkShare = 1e-6;
constexpr uint32_t kMostSweeps = 60;
// Cycles of the balance within a cell, at most.
constexpr uint32_t kMostCycles = 40;
// A commit writes all of a cell's tree, however little of it has changed: work
// between two takes so many times as long, but no longer than a minute.
constexpr double kWorkPerCommit = 20;
constexpr double kMostCommitSeconds = 60;
constexpr double kTellSeconds = 0.5;  // between two reports of progress
// The light before the first round is guessed with at most this reflectance.
constexpr double kMostGuessedReflectance = 0.8;

// The area of the sides that the error is a mean over, m2: those that reflect.
double ReflectingArea(const BlockStorage& store,
                      const SceneInfo& scene,
                      size_t cells) {
  double area = 0;
  for (size_t i = 0; i < cells; ++i) {
    for (const Patch& p : LoadCellPatches(store, CellId(i)).patches) {
      area += Reflects(p, scene.materials) ? PatchArea(p) : 0;
    }
  }
  return area;
}

double AreaOfCells(const SolveState& state) {
  double area = 0;
  for (const CellRow& row : state.cells) {
    area += row.area;
  }
  return area;
}

// Surfaces that all reflect so much and emit nothing.
SurfaceTable AllGrey(const SurfaceTable& like, float reflectance) {
  SurfaceTable grey = like;
  std::fill(grey.reflectance.begin(), grey.reflectance.end(), reflectance);
  std::fill(grey.exitance.begin(), grey.exitance.end(), 0.0F);
  return grey;
}

// What is being done, and how far the rounds before have come.
std::string PhaseText(const SolveState& state) {
  std::string text =
      fmt::format("round {} {}",
                  state.rounds.size() + 1,
                  state.phase == SolvePhase::kRefine ? "refine" : "propagate");
  if (!state.rounds.empty()) {
    text += fmt::format(", error {:.3f} so far",
                        state.rounds.back().estimated_error);
  }
  return text;
}

}  // namespace

Engine::Engine(BlockStorage& store,
               const SolveOptions& options,
               MemoryBudget& budget)
    : store_(&store),
      options_(options),
      budget_(&budget),
      scene_(LoadSceneInfo(store)),
      partition_(LoadPartition(store)),
      basis_(BasisNamed(options.basis)),
      shape_{&basis_, kRgbChannels},
      surfaces_(MakeSurfaceTable(scene_)),
      device_(budget, scene_.bounds.Center()),
      pager_(store, scene_, partition_, shape_, device_, budget),
      workspace_(ReserveWorkspace()),
      area_(ReflectingArea(store, scene_, partition_.cells.size())),
      is_black_(area_ <= 0),
      commit_seconds_(options.commit_seconds),
      last_commit_(std::chrono::steady_clock::now()),
      last_told_(last_commit_) {
  if (!LoadSolveState(store, &state_)) {
    Start();
  }
  if (is_black_) {
    area_ = AreaOfCells(state_);
  }
  pager_.Order().Watch(state_.cells);
  pager_.Order().StartSweep(state_.phase == SolvePhase::kRefine
                                ? SweepKind::kRefine
                                : SweepKind::kPropagate);
}

// ------------------------------------------------------------- the schedule

SolveSummary Engine::Run() {
  TakeRequest();
  while (state_.phase != SolvePhase::kDone) {
    if (state_.next_cell == state_.cells.size()) {
      FinishSweep();
    } else if (state_.phase == SolvePhase::kRefine) {
      RefineCell(CellId(state_.next_cell));
    } else {
      PropagateCell(CellId(state_.next_cell));
    }
  }
  pager_.Flush();
  SaveSolveState(state_, *store_);
  store_->Commit();
  return LoadSolveSummary(*store_);
}

// The error that is asked for now may be another than that of the run before. A
// round in progress is judged by it at its end; but one that makes more links
// than are asked for now begins anew, since it may be what did not fit.
void Engine::TakeRequest() {
  const double before = std::exchange(state_.error, options_.error);
  if (state_.error == before) {
    return;
  }
  state_.first_round = state_.rounds.size();
  const bool asks_more = state_.error < before;
  bool restart = false;
  if (state_.phase == SolvePhase::kDone) {
    state_.converged = HasMetError(state_);
    restart = asks_more && !state_.converged;
  } else if (state_.phase == SolvePhase::kRefine && !state_.rounds.empty()) {
    restart = !asks_more;
  }
  if (restart) {
    state_.tau = state_.rounds.back().tau;
    ++state_.round;
    StartRound(NextTau(state_));
  }
}

void Engine::Start() {
  state_.basis = options_.basis;
  state_.seed = options_.seed;
  state_.error = options_.error;
  state_.cells.resize(partition_.cells.size());
  double emitted = 0;
  double reflecting = 0;  // area times reflectance
  double patches = 0;
  for (size_t i = 0; i < partition_.cells.size(); ++i) {
    CellRow& row = state_.cells[i];
    for (const Patch& p : LoadCellPatches(*store_, CellId(i)).patches) {
      const Material& m = scene_.materials.at(p.material.Index());
      if (p.emits) {
        emitted += PatchArea(p) * MeanChannel(m.exitance);
        row.peak =
            std::max(row.peak, static_cast<float>(MaxChannel(m.exitance)));
      }
      row.area += p.reflects ? PatchArea(p) : 0;
      reflecting += p.reflects ? PatchArea(p) * MeanChannel(m.reflectance) : 0;
      ++patches;
    }
  }
  const double all_area = std::max(AreaOfCells(state_), 1e-12);
  const double area = is_black_ ? all_area : area_;
  // A guess until the first round has measured it: as if nothing were lost.
  const double reflectance =
      is_black_ ? double{kLeastWeightReflectance}
                : std::min(reflecting / all_area, kMostGuessedReflectance);
  state_.mean_reflected = emitted / area * reflectance / (1 - reflectance);
  StartRound(FirstTau(state_, area, patches));
}

void Engine::StartRound(double tau) {
  state_.tau = tau;
  state_.phase = SolvePhase::kRefine;
  state_.next_cell = 0;
  state_.cursor = {};
  state_.converged = false;
  state_.published_in_sweep = false;
  state_.sweeps_in_round = 0;
  pager_.ForgetLinks();  // they are made anew
  pager_.Order().StartSweep(SweepKind::kRefine);
}

MemoryCharge Engine::ReserveWorkspace() {
  return pager_.Reserve(kSolveWorkspaceBytes, "the solver's work space");
}

void Engine::NextCell() {
  ++state_.next_cell;
  state_.cursor = {};
  share_of_cell_ = 0;
  CheckPoint();
}

void Engine::FinishSweep() {
  const bool ends_round =
      !state_.published_in_sweep || state_.sweeps_in_round + 1 >= kMostSweeps;
  if (ends_round) {
    TakeReads();
    Commit();  // rays may take long now, and a stop ends them
  }
  ++state_.sweeps;
  ++state_.sweeps_in_round;
  if (ends_round) {
    FinishRound();
  } else {
    state_.phase = SolvePhase::kPropagate;
    pager_.Order().StartSweep(SweepKind::kPropagate);
    state_.next_cell = 0;
    state_.published_in_sweep = false;
  }
  CheckPoint();
}

// Adds what was read since the last call, beside what the best cache would
// have.
void Engine::TakeReads() {
  const TracedReads reads = pager_.Trace().TakeReads();
  state_.times.bytes_read += reads.read;
  state_.times.bytes_belady += reads.belady;
  state_.times.bytes_compulsory += reads.compulsory;
}

// ----------------------------------------------------------------- one cell

// What a cell's turn reads once.
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
  VisibleCell self{cell, {cell}};
  for (VisibleCell& v : SourcesOf(cell, &r.sources_charge)) {
    if (v.source == cell) {
      self = std::move(v);
    } else {
      r.sources.push_back(std::move(v));
    }
  }
  r.sources.push_back(std::move(self));
  pager_.StartTurn(cell, r.sources);
  r.geometry = pager_.Geometry(cell);
  r.tree = pager_.Tree(cell);
  r.received = pager_.Received(cell);
  return r;
}

// What a cell sees, and what stands between where that is needed.
VisibleSet Engine::SourcesOf(CellId cell, MemoryCharge* charge) {
  const auto reserve = [&](uint64_t bytes) {
    *charge = pager_.Reserve(bytes, "what a cell sees");
  };
  if (state_.phase == SolvePhase::kRefine) {
    return ReadOnce([&] { return LoadVisibleSet(*store_, cell, reserve); });
  }
  VisibleSet sources;
  for (const CellId source : pager_.Order().SeenFrom(cell)) {
    sources.push_back({source, {}});
  }
  reserve(BytesOf(sources));
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
  std::vector<float> reflected(patches.size());
  for (size_t i = 0; i < patches.size(); ++i) {
    reflected[i] = care_[i].care * MeanReflected(patches[i],
                                                 r.tree->Sent()[ElementId(i)],
                                                 shape_,
                                                 surfaces_);
  }
  CoverOptions options;
  options.tau = kCoverShare * state_.tau;
  options.seed = MixKey(state_.seed, state_.round);
  const auto occluder = pager_.Occluder(r.id);
  Covers covers =
      FindCovers(options,
                 {r.id, patches, r.geometry->clusters.get(), occluder.get()},
                 reflected);
  receiver->receivers_charge = pager_.Reserve(
      ClusterTree::BytesFor(covers.receivers.size()), "the clusters of a cell");
  receiver->receivers =
      std::make_unique<ClusterTree>(patches, std::move(covers.receivers));
  receiver->weights = ReceiverWeights(patches, *receiver->receivers, care_);
  return covers.rays;
}

void Engine::RefineCell(CellId cell) {
  Receiver r = Load(cell);
  const size_t patches = r.geometry->patches.size();
  MemoryCharge care_charge =
      pager_.Reserve(patches * sizeof(PatchCare), "the care of a cell");
  care_ = ReadOnce([&] { return LoadCellCare(*store_, cell, patches); });
  CellRow& row = state_.cells[cell.Index()];
  const bool begins = state_.cursor.source == 0 && state_.cursor.chunk == 0 &&
                      state_.cursor.work == WorkPart{};
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
  MemoryCharge workspace =
      pager_.Reserve(kRefineWorkspaceBytes, "the links of a cell");
  const uint64_t rays = FindReceivers(&r);
  state_.rays += begins ? rays : 0;  // not again where a cell is gone on with
  while (state_.cursor.source < r.sources.size()) {
    RefinePair(r, r.sources[state_.cursor.source]);
    state_.cursor = {state_.cursor.source + 1, {}, 0, 0};
    CheckPoint();
  }
  SaveCellCare(care_, cell, *store_);
  FreeVector(&care_);
  care_charge.Reset();
  r.receivers.reset();
  FreeVector(&r.weights);
  r.receivers_charge.Reset();
  workspace.Reset();
  Settle(r);
  NextCell();
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

// Balances the light within a receiver and takes stock: its turn is over.
// Commits come between cycles, whose state is in the store: the bits are the
// same after one.
void Engine::Settle(const Receiver& r) {
  pager_.Order().MoveTo(r.id, r.id);
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
}

// ------------------------------------------------------------------ commits

void Engine::Commit() {
  const Stopwatch watch(&state_.times.store_seconds);
  const auto begin = std::chrono::steady_clock::now();
  pager_.Flush();
  if (!care_.empty()) {
    SaveCellCare(care_, CellId(state_.next_cell), *store_);
  }
  SaveSolveState(state_, *store_);
  store_->Commit();
  last_commit_ = std::chrono::steady_clock::now();
  commit_seconds_ =
      options_.commit_seconds > 0
          ? std::max(options_.commit_seconds,
                     std::min(kWorkPerCommit * SecondsSince(begin),
                              kMostCommitSeconds))
          : 0;
}

// The end of a step: commits now and then, and stops here when asked to.
void Engine::CheckPoint() {
  const bool stop = options_.stop != nullptr && options_.stop->load();
  if (stop) {
    TakeReads();
  }
  const bool commits = stop || SecondsSince(last_commit_) >= commit_seconds_;
  if (commits) {
    Commit();
  }
  if (stop) {
    throw InterruptedError("stopped as asked; all work is kept");
  }
  if (options_.progress &&
      (commits || SecondsSince(last_told_) >= kTellSeconds)) {
    options_.progress(ShareOfSweep(), PhaseText(state_));
    last_told_ = std::chrono::steady_clock::now();
  }
}

double Engine::ShareOfSweep() const {
  return (static_cast<double>(state_.next_cell) + share_of_cell_) /
         static_cast<double>(state_.cells.size());
}

}  // namespace enfilade
