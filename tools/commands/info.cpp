// The verb `info`.

#include "base/error.h"
#include "base/memory.h"
#include "base/stop.h"
#include "scene/import.h"
#include "store/sqlite_store.h"
#include "visibility/audit.h"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "tools/commands/command.h"
#include "tools/commands/options.h"
#include "tools/cost_estimate.h"
#include "tools/pipeline.h"
#include "tools/progress.h"
#include "tools/temporary_path.h"
#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace enfilade {
namespace {

struct InfoCommand {
  CommonOptions common;
  std::string path;                          // of a store or a scene
  SceneOptions scene_options;                // used if `path` is a scene
  std::vector<const CLI::Option*> of_scene;  // those of AddSceneOptions
  uint64_t audit_rays = 0;
  bool checks = false;  // every block of the store

  void Run() const;
  [[nodiscard]] bool AsksForError() const;
  void RunOnScene() const;
  void RunOnStore() const;
  // Audits if asked, and writes the report.
  void Finish(const BlockStorage& storage,
              Json& report,
              MemoryBudget& budget) const;
};

// A folder of a name that nothing had, removed with all that is in it.
class TemporaryFolder {
 public:
  // Throws DiskError.
  TemporaryFolder() {
    std::string name = TemporaryPath() / "enfilade_info_XXXXXX";
    if (mkdtemp(name.data()) == nullptr) {
      throw DiskError(fmt::format("cannot make the folder '{}': {}",
                                  name,
                                  std::generic_category().message(errno)));
    }
    path_ = name;
  }

  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& Path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// A store in a folder of its own.
class TemporaryStore {
 public:
  [[nodiscard]] BlockStorage& Store() { return *store_; }

 private:
  TemporaryFolder folder_;  // goes after the store
  std::unique_ptr<BlockStorage> store_ =
      CreateStore(folder_.Path() / "scene.enf");
};

// One line: whether the solve is done, and otherwise how to go on.
std::string OutlookText(const SolveSummary& summary,
                        const SolveSettings& settings,
                        const std::string& stage,
                        const std::string& store) {
  if (summary.converged) {
    return "state     solved\n";
  }
  if (summary.exhausted && !RequestedError(settings)) {
    return fmt::format("state     ended: {}\n", NotSettledText(summary));
  }
  if (summary.exhausted && !summary.ran_out_of_rounds) {
    return fmt::format(
        "state     ended short of the error that was asked for; 'enfilade "
        "resume {} --error E' asks for another\n",
        store);
  }
  return fmt::format(
      "state     unfinished ({}); go on with 'enfilade resume {}'\n",
      stage,
      store);
}

// Shoots `rays` rays and warns of the first pairs of cells that the visible
// sets miss. Throws InputError if the store cannot be traced yet.
AuditSummary RunAudit(const BlockStorage& store,
                      const CommonOptions& common,
                      const std::string& path,
                      uint64_t rays,
                      MemoryBudget& budget) {
  if (LoadStage(store) < Stage::kTraceable) {
    throw InputError(
        fmt::format("{}: cannot be audited before its surfaces can be traced; "
                    "go on with 'enfilade resume {}'",
                    path,
                    path));
  }
  Progress progress(Progress::ChooseOutput(common.verbose));
  progress.Begin("audit");
  AuditSummary audit = Audit(store, rays, budget, [&](double fraction) {
    ThrowIfStopRequested();
    progress.Update(fraction);
  });
  progress.End();
  for (const MissedPair& pair : audit.first_missed) {
    spdlog::warn(
        "cells {} and {} see each other from ({}, {}, {}) to ({}, {}, "
        "{}), but not by the visible sets",
        pair.origin.value,
        pair.target.value,
        pair.from.x,
        pair.from.y,
        pair.from.z,
        pair.to.x,
        pair.to.y,
        pair.to.z);
  }
  return audit;
}

void AddAuditKeys(const AuditSummary& audit, Json& report) {
  report["audit_rays"] = audit.audit_rays;
  report["audit_missed"] = audit.audit_missed;
  report["audit_leaks"] = audit.audit_leaks;
  report["conservative_pairs"] = audit.conservative_pairs;
  report["sampled_pairs"] = audit.sampled_pairs;
}

std::string AuditText(const AuditSummary& audit) {
  return fmt::format(
      "audit     {} rays, {} missed, {} leaks; {} conservative pairs over {} "
      "sampled\n",
      audit.audit_rays,
      audit.audit_missed,
      audit.audit_leaks,
      audit.conservative_pairs,
      audit.sampled_pairs);
}

void InfoCommand::Finish(const BlockStorage& storage,
                         Json& report,
                         MemoryBudget& budget) const {
  uint64_t missed = 0;
  if (audit_rays > 0) {
    const AuditSummary audit =
        RunAudit(storage, common, path, audit_rays, budget);
    AddAuditKeys(audit, report);
    fmt::print("{}", AuditText(audit));
    missed = audit.audit_missed;
  }
  WriteReportIfAsked(common, report);
  if (missed > 0) {
    throw Error(ExitCode::kNotDone,
                fmt::format("{} rays join cells that the visible sets keep "
                            "apart; please report this with the scene",
                            missed));
  }
}

// Runs the stages before the solve in a temporary store, and estimates from
// their results what the solve would cost.
void InfoCommand::RunOnScene() const {
  const SolveSettings settings = SettingsOf(path, scene_options);
  LimitsInForce limits(common.limits);
  TemporaryStore temporary;
  BlockStorage& storage = temporary.Store();
  SaveSettings(storage, settings);
  SaveStage(storage, Stage::kCreated);
  Progress progress(Progress::ChooseOutput(common.verbose));
  PreparePipeline(storage, settings, common.limits, limits.Budget(), progress);
  const SolveOptions options = SolveOptionsOf(settings);
  const CostEstimate estimate =
      EstimateCost(storage, options, common.limits.threads, limits.Budget())
          .WithCap(MemoryBudget::CapForBudget(BytesToImport(path)));
  Json report = SolveReport(storage, settings, limits.Budget(), progress);
  report["estimate"] = EstimateReport(estimate);
  fmt::print("{}{}{}",
             SummaryText(report),
             NotesText(report),
             EstimateText(estimate, options));
  Finish(storage, report, limits.Budget());
}

// Whether --error is given, which asks for the cost of a resume to that error.
// Throws UsageError for any other scene option, which a store does not take.
bool InfoCommand::AsksForError() const {
  bool asks = false;
  for (const CLI::Option* option : of_scene) {
    if (option->count() == 0) {
      continue;
    }
    asks = option->get_name() == "--error";
    if (!asks) {
      throw UsageError(
          fmt::format("{} is for a scene file; '{}' is a store, which has its "
                      "own settings",
                      option->get_name(),
                      path));
    }
  }
  return asks;
}

// Reads all of the store. Throws DamagedStoreError if any of it is damaged.
uint64_t CheckBlocks(const BlockStorage& store, const CommonOptions& common) {
  Progress progress(Progress::ChooseOutput(common.verbose));
  progress.Begin("check");
  const uint64_t blocks = store.VerifyAll([&](double fraction) {
    ThrowIfStopRequested();
    progress.Update(fraction);
  });
  progress.End();
  return blocks;
}

// Reports what the store holds. If the wavelet solve is unfinished or --error
// is given, also estimates what a resume would cost.
void InfoCommand::RunOnStore() const {
  const bool asks = AsksForError();
  LimitsInForce limits(common.limits);
  const auto storage = OpenExistingStore(path, StoreAccess::kRead);
  const auto blocks =
      checks ? std::optional(CheckBlocks(*storage, common)) : std::nullopt;
  SolveSettings settings = LoadSettings(*storage);
  Progress progress(Progress::ChooseOutput(common.verbose));
  Json report = SolveReport(*storage, settings, limits.Budget(), progress);
  if (blocks) {
    report["blocks_checked"] = *blocks;
    fmt::print("check     {} blocks, all whole\n", *blocks);
  }
  fmt::print("{}{}{}",
             SummaryText(report),
             NotesText(report),
             OutlookText(LoadSummaryOf(*storage, settings),
                         settings,
                         report.at("stage").get<std::string>(),
                         path));
  const bool is_solved = report.at("converged").get<bool>();
  const bool is_known = settings.method.kind == SolveMethod::kWavelet &&
                        LoadStage(*storage) >= Stage::kVisible;
  if (asks && !is_known) {
    spdlog::warn(
        "what another error would take is known of wavelet solves alone, and "
        "once they have found what cells see");
  }
  if ((asks || !is_solved) && is_known) {
    settings.error = asks ? scene_options.settings.error : settings.error;
    const SolveOptions options = SolveOptionsOf(settings);
    options.Validate();
    const CostEstimate estimate =
        EstimateCost(*storage, options, common.limits.threads, limits.Budget());
    report["estimate"] = EstimateReport(estimate);
    fmt::print("{}", EstimateText(estimate, options));
  }
  Finish(*storage, report, limits.Budget());
}

void InfoCommand::Run() const {
  BeginRun(common, {path, scene_options.overrides});
  if (IsSceneName(path)) {
    if (checks) {
      throw UsageError(
          fmt::format("--check is for a store; '{}' is a scene file", path));
    }
    RunOnScene();
  } else {
    RunOnStore();
  }
}

}  // namespace

void AddInfoCommand(CLI::App& app) {
  auto options = std::make_shared<InfoCommand>();
  CLI::App* command =
      app.add_subcommand("info",
                         "What a store holds and how far it is, or what a "
                         "scene would take");
  command
      ->add_option("store",
                   options->path,
                   "The store; or a scene file, to estimate what a solve of it "
                   "would take")
      ->required()
      ->type_name("STORE|SCENE");
  command
      ->add_option("--audit",
                   options->audit_rays,
                   "Check the visible sets with this many rays")
      ->check(WholeAboveZero())
      ->type_name("N");
  command->add_flag("--check",
                    options->checks,
                    "Read all of the store and test its checksums");
  const size_t others = command->get_options().size();
  AddSceneOptions(*command, options->scene_options);
  command->get_option("--error")->description(
      "Relative error that a solve of the scene, or a resume of the store, "
      "would be asked for");
  command->get_option("--basis")->description(
      "haar (or m1), m2, m3, m4, f2 or f3");
  const auto all = command->get_options();
  options->of_scene.assign(all.begin() + static_cast<ptrdiff_t>(others),
                           all.end());
  AddCommonOptions(*command, options->common);
  SetExample(*command,
             "enfilade info office.enf --report office.json\n"
             "  enfilade info office.enf --check\n"
             "  enfilade info office.enf --error 0.02\n"
             "  enfilade info office.obj --error 0.05 --audit 1000000");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
