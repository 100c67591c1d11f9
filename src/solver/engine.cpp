#include "solver/engine.h"

#include "base/stop.h"
#include "base/stopwatch.h"
#include "partition/partition_store.h"
#include "solver/error_control.h"
#include "solver/least_memory.h"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr uint32_t kMostSweeps = 60;
constexpr double kTellSeconds = 0.5;  // between two reports of progress
// The first guess of the light assumes at most this mean reflectance.
constexpr double kMostGuessedReflectance = 0.8;

// All reflecting patches together.
struct Reflecting {
  double area = 0;         // m2; what the error is a mean over
  double reflectance = 0;  // mean over the area
};

Reflecting ReflectingPatches(const BlockStorage& store,
                             const SceneInfo& scene,
                             size_t cells) {
  Reflecting all;
  for (size_t i = 0; i < cells; ++i) {
    ThrowIfStopRequested();
    for (const Patch& p : LoadCellPatches(store, CellId(i)).patches) {
      if (Reflects(p, scene.materials)) {
        const Material& material = scene.materials[p.material.Index()];
        all.area += PatchArea(p);
        all.reflectance += PatchArea(p) * MeanChannel(material.reflectance);
      }
    }
  }
  all.reflectance /= std::max(all.area, 1e-30);
  return all;
}

double AreaOfCells(const SolveState& state) {
  double area = 0;
  for (const CellRow& row : state.cells) {
    area += row.area;
  }
  return area;
}

// Names the current phase and the error that earlier rounds have reached.
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
      scene_charge_(budget, kSceneCopies * BytesOf(scene_), kScenePurpose),
      portals_charge_(budget, "the portals of the building"),
      partition_(LoadPartition(
          store, [this](uint64_t bytes) { portals_charge_.GrowTo(bytes); })),
      cells_charge_(budget,
                    partition_.cells.size() * kSolveBytesPerCell,
                    "what is known of the cells"),
      basis_(BasisNamed(options.basis)),
      shape_{&basis_, kRgbChannels},
      surfaces_(MakeSurfaceTable(scene_)),
      device_(budget, scene_.bounds.Center()),
      pager_(store, scene_, partition_, shape_, device_, budget),
      chunks_(
          store,
          [this](LinkChunk&& chunk) { pager_.KeepLinks(std::move(chunk)); }),
      workspace_(ReserveWorkspace()),
      commits_(options.commit_seconds),
      last_told_(std::chrono::steady_clock::now()) {
  const Reflecting reflecting =
      ReflectingPatches(store, scene_, partition_.cells.size());
  area_ = reflecting.area;
  is_black_ = area_ <= 0;
  if (!is_black_) {
    least_reflectance_ = std::min(least_reflectance_,
                                  static_cast<float>(reflecting.reflectance));
  }
  if (LoadSolveState(store, &state_)) {
    RequireSense(state_, partition_.cells.size());
  } else {
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

void Engine::Run() {
  if (TakeRequest(options_.error, &state_) == RequestStep::kNewRound) {
    state_.tau = state_.rounds.back().tau;
    ++state_.round;
    StartRound(NextTau(state_));
  }
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
    ThrowIfStopRequested();
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
  // The mean reflected radiosity is a guess until the first round has measured
  // it. The guess assumes that no light is lost.
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
  pager_.ForgetLinks();  // the round makes all links anew
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
    Commit();  // the rays may take long, and a stop ends them
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

// Adds the bytes read since the last call, and the bytes that an optimal cache
// would have read.
void Engine::TakeReads() {
  const TracedReads reads = pager_.Trace().TakeReads();
  state_.times.bytes_read += reads.read;
  state_.times.bytes_belady += reads.belady;
  state_.times.bytes_compulsory += reads.compulsory;
}

void Engine::Commit() {
  const Stopwatch watch(&state_.times.store_seconds);
  commits_.Begin();
  chunks_.Finish();
  KeepForReaders();
  pager_.Flush();
  if (!care_.empty()) {
    SaveCellCare(care_, CellId(state_.next_cell), *store_);
  }
  SaveSolveState(state_, *store_);
  store_->Commit();
  commits_.End();
}

// Called at the end of a step: commits if a commit is due, and throws
// InterruptedError if a stop was requested.
void Engine::CheckPoint() {
  const bool stop = options_.stop != nullptr && options_.stop->load();
  if (stop) {
    TakeReads();
  }
  const bool commits = stop || commits_.IsDue();
  if (commits) {
    Commit();
  }
  if (stop) {
    throw InterruptedError("stopped as asked; all work is kept");
  }
  if (commits || IsTimeToTell()) {
    Tell(ShareOfSweep(), PhaseText(state_));
  }
}

bool Engine::IsTimeToTell() const {
  return SecondsSince(last_told_) >= kTellSeconds;
}

void Engine::Tell(double fraction, const std::string& phase) {
  if (options_.progress) {
    options_.progress(fraction, phase);
    last_told_ = std::chrono::steady_clock::now();
  }
}

double Engine::ShareOfSweep() const {
  return (static_cast<double>(state_.next_cell) + share_of_cell_) /
         static_cast<double>(state_.cells.size());
}

}  // namespace enfilade
