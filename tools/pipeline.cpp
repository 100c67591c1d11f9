#include "tools/pipeline.h"

#include "base/error.h"
#include "base/stop.h"
#include "base/stopwatch.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "tools/report.h"
#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace enfilade {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSecondsBetweenRecords = 1.0;

// One run of the stages. Keeps the run record up to date in the store, so that
// commits carry the time and the bytes that led to them, up to a second or so.
class PipelineRun {
 public:
  PipelineRun(BlockStorage& store,
              const SolveSettings& settings,
              const RunLimits& limits,
              MemoryBudget& budget,
              Progress& progress);

  // Checks the cap a last time, however the run ends.
  ~PipelineRun() { WarnIfCapExceeded("the run"); }

  PipelineRun(const PipelineRun&) = delete;
  PipelineRun& operator=(const PipelineRun&) = delete;

  // All stages before the solve.
  void Prepare();
  SolveSummary Solve();

 private:
  void Import();
  void Partition();
  void Visibility();
  void TraceChunks();
  // Does nothing if the store has reached `stage`. Else runs `work`, adds its
  // time to `seconds` and commits.
  template <typename Work>
  void RunStage(Stage stage,
                std::string_view name,
                double& seconds,
                const Work& work);
  void UpdateRecord();
  // Logs the peak of memory. Warns, once per run, if the peak exceeds the cap,
  // which is a bug.
  void WarnIfCapExceeded(std::string_view stage);
  // The progress function of the stages before the solve. It shows progress,
  // and throws InterruptedError if a stop was requested.
  std::function<void(double)> ProgressOrStop();

  BlockStorage& store_;
  const SolveSettings& settings_;
  const RunLimits& limits_;
  MemoryBudget& budget_;
  Progress& progress_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point recorded_ = begin_;
  RunRecord before_;  // of the runs before this one
  RunRecord record_;
  bool warned_of_cap_ = false;
};

PipelineRun::PipelineRun(BlockStorage& store,
                         const SolveSettings& settings,
                         const RunLimits& limits,
                         MemoryBudget& budget,
                         Progress& progress)
    : store_(store),
      settings_(settings),
      limits_(limits),
      budget_(budget),
      progress_(progress),
      before_(LoadRunRecord(store)),
      record_(before_) {
  ++record_.runs;
  record_.memory_cap_bytes = limits.memory_cap_bytes;
  record_.threads = limits.threads;
  record_.version = ENFILADE_VERSION;
}

void PipelineRun::Prepare() {
  Import();
  Partition();
  Visibility();
  TraceChunks();
}

void PipelineRun::Import() {
  RunStage(Stage::kImported, "import", record_.import_seconds, [&] {
    ImportOptions options = ImportOptionsOf(settings_);
    options.progress = ProgressOrStop();
    const SceneInfo info =
        ImportScene(settings_.scene, options, budget_, store_);
    for (const std::string& note : info.notes) {
      spdlog::info("import: {}", note);
    }
  });
}

void PipelineRun::Partition() {
  RunStage(Stage::kPartitioned, "partition", record_.partition_seconds, [&] {
    PartitionOptions options;
    options.progress = ProgressOrStop();
    const enfilade::Partition partition =
        BuildPartition(store_, options, budget_);
    for (const std::string& note : partition.notes) {
      spdlog::info("partition: {}", note);
    }
  });
}

void PipelineRun::Visibility() {
  RunStage(Stage::kVisible, "visibility", record_.visibility_seconds, [&] {
    VisibilityOptions options;
    options.progress = ProgressOrStop();
    BuildVisibleSets(
        LoadCells(store_),
        [this](const std::function<void(const Portal&)>& visit) {
          ForEachPortal(store_, visit);
        },
        options,
        budget_,
        store_);
  });
}

void PipelineRun::TraceChunks() {
  RunStage(Stage::kTraceable, "trace chunks", record_.visibility_seconds, [&] {
    BuildTraceChunks(store_, budget_);
  });
}

SolveSummary PipelineRun::Solve() {
  ThrowIfStopRequested();
  progress_.Begin("solve");
  SolveOptions options = SolveOptionsOf(settings_);
  options.stop = &StopRequested();
  options.progress = [&](const SolveProgress& progress) {
    progress_.UpdatePart(progress.part, progress.fraction, progress.detail);
    if (SecondsSince(recorded_) > kSecondsBetweenRecords) {
      UpdateRecord();
    }
  };
  bool has_told_of_darkness = false;
  options.round_ended = [&](const RoundSummary& round) {
    progress_.Note(
        fmt::format("solve: round {}: {} elements, {} links, error {:.4f}{}",
                    round.round,
                    round.elements,
                    round.links,
                    round.estimated_error,
                    round.is_seen_by_rays ? "" : ", predicted"));
    const std::string note = DarknessNote(round.lit_share, options.error);
    if (!note.empty() && !std::exchange(has_told_of_darkness, true)) {
      spdlog::warn("{}", note);
    }
  };
  options.may_not_fit = [&](uint64_t cap_bytes) {
    spdlog::warn(
        "error {} may take more than --memory {}M: some {}M, by what other "
        "models took; if so, the solve stops later and can be resumed",
        options.error,
        limits_.memory_cap_bytes >> 20,
        cap_bytes >> 20);
  };
  UpdateRecord();
  const SolveSummary summary = enfilade::Solve(store_, options, budget_);
  UpdateRecord();
  store_.Commit();
  progress_.End();
  WarnIfCapExceeded("solve");
  return summary;
}

template <typename Work>
void PipelineRun::RunStage(Stage stage,
                           std::string_view name,
                           double& seconds,
                           const Work& work) {
  if (LoadStage(store_) >= stage) {
    return;
  }
  ThrowIfStopRequested();
  progress_.Begin(name);
  const auto begin = Clock::now();
  work();
  seconds += SecondsSince(begin);
  SaveStage(store_, stage);
  UpdateRecord();
  store_.Commit();
  ReleaseFreedMemory();
  ReleaseCode();  // the next stage runs other code
  progress_.End();
  WarnIfCapExceeded(name);
}

void PipelineRun::UpdateRecord() {
  recorded_ = Clock::now();
  const StoreStats stats = store_.Stats();
  record_.wall_seconds = before_.wall_seconds + SecondsSince(begin_);
  record_.bytes_read = before_.bytes_read + stats.bytes_read;
  record_.bytes_written = before_.bytes_written + stats.bytes_written;
  record_.peak_rss_bytes =
      std::max(before_.peak_rss_bytes, PeakResidentBytes());
  SaveRunRecord(store_, record_);
}

void PipelineRun::WarnIfCapExceeded(std::string_view stage) {
  const uint64_t peak = PeakResidentBytes();
  spdlog::info("{}: peak resident size {:.1f} MiB, peak of the budget {:.1f}",
               stage,
               static_cast<double>(peak) / (1 << 20),
               static_cast<double>(budget_.PeakBytes()) / (1 << 20));
  if (limits_.memory_cap_bytes != 0 && peak > limits_.memory_cap_bytes &&
      !std::exchange(warned_of_cap_, true)) {
    spdlog::warn(
        "internal error: {} took {:.1f} MiB, more than the cap of {:.1f} MiB; "
        "please report this",
        stage,
        static_cast<double>(peak) / (1 << 20),
        static_cast<double>(limits_.memory_cap_bytes) / (1 << 20));
  }
}

std::function<void(double)> PipelineRun::ProgressOrStop() {
  return [this](double fraction) {
    progress_.Update(fraction);
    ThrowIfStopRequested();
  };
}

}  // namespace

SolveSummary RunPipeline(BlockStorage& store,
                         const SolveSettings& settings,
                         const RunLimits& limits,
                         MemoryBudget& budget,
                         Progress& progress) {
  PipelineRun run(store, settings, limits, budget, progress);
  run.Prepare();
  return run.Solve();
}

void PreparePipeline(BlockStorage& store,
                     const SolveSettings& settings,
                     const RunLimits& limits,
                     MemoryBudget& budget,
                     Progress& progress) {
  PipelineRun(store, settings, limits, budget, progress).Prepare();
}

bool CheckSceneUnchanged(const BlockStorage& store,
                         const SolveSettings& settings) {
  if (LoadStage(store) < Stage::kImported) {
    return true;  // the scene is still to be read
  }
  const SceneHash hash =
      HashSceneFiles(settings.scene, ImportOptionsOf(settings));
  const SceneInfo scene = LoadSceneInfo(store);
  if (hash.value == scene.source_hash) {
    return true;
  }
  if (hash.is_whole || (hash.is_there && scene.lacks_files)) {
    throw InputError(
        fmt::format("'{}' (or a file it uses) has changed since this store "
                    "was made; solve it into a new store, or put the old "
                    "scene back",
                    settings.scene.string()));
  }
  return false;
}

}  // namespace enfilade
