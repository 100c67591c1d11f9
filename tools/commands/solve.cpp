// The verbs `solve` and `resume`.

#include "base/error.h"
#include "scene/import.h"
#include "store/store_files.h"

#include <memory>
#include <optional>

#include "tools/commands/command.h"
#include "tools/commands/method_options.h"
#include "tools/commands/options.h"
#include "tools/pipeline.h"
#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

struct SolveCommand {
  CommonOptions common;
  std::string scene;
  std::string store;
  SceneOptions options;

  // `given`: the command as it was parsed.
  void Run(const CLI::App& given);
};

struct ResumeCommand {
  CommonOptions common;
  std::string store;
  std::optional<double> error;

  void Run();
};

// Throws UsageError because `path` exists and is not to be overwritten; the
// message says what is there and what to do instead.
[[noreturn]] void RefuseExistingStore(const fs::path& path,
                                      const SolveSettings& settings) {
  std::unique_ptr<BlockStorage> store;
  std::optional<SolveSettings> held;
  bool converged = false;
  try {
    store = OpenStore(path, StoreAccess::kRead);
    held = LoadSettings(*store);
    converged = LoadSummaryOf(*store, *held).converged;
  } catch (const Error& error) {
    throw UsageError(
        fmt::format("'{}' exists and cannot be opened as a store ({}); give "
                    "another name with -o, or remove it if it is not needed",
                    path.string(),
                    error.what()));
  }
  held->error = settings.error;
  const bool same = *held == settings;
  throw UsageError(fmt::format(
      "'{}' exists: it holds {} {} of {}; {}",
      path.string(),
      converged ? "a" : "an unfinished",
      same ? "solution" : "solution with other settings or",
      same ? "this scene" : "another scene",
      same ? fmt::format("go on with 'enfilade resume {}', or remove it",
                         path.string())
           : "remove it, or give another name with -o"));
}

// Whether the store holds nothing worth keeping, as before the scene is
// imported. False if that cannot be read.
bool IsWorthless(const BlockStorage& store) {
  try {
    return LoadStage(store) < Stage::kImported;
  } catch (const Error&) {
    return false;
  }
}

// Runs the stages. If they are interrupted, or run out of memory after work
// that is worth keeping, the error says how to resume.
SolveSummary RunStages(BlockStorage& store,
                       const fs::path& path,
                       const SolveSettings& settings,
                       const CommonOptions& common,
                       MemoryBudget& budget) {
  Progress progress(Progress::ChooseOutput(common.verbose));
  try {
    return RunPipeline(store, settings, common.limits, budget, progress);
  } catch (const InterruptedError&) {
    throw InterruptedError(
        fmt::format("stopped; {} 'enfilade resume {}'",
                    TraitsOf(settings.method.kind).keeps_work
                        ? "the work so far is kept: go on with"
                        : "this method keeps nothing before its end: begin "
                          "again with",
                    path.string()));
  } catch (const NoRoomError& error) {
    if (!TraitsOf(settings.method.kind).keeps_work || IsWorthless(store)) {
      throw;  // nothing is kept
    }
    throw NoRoomError(
        fmt::format("{}; the work so far is kept: 'enfilade resume {}' goes on",
                    error.what(),
                    path.string()));
  }
}

std::string WhyItEnded(const SolveSummary& summary, const fs::path& path) {
  if (summary.ran_out_of_rounds) {
    return fmt::format(
        " after as many rounds as one run has; 'enfilade resume {}' goes on",
        path.string());
  }
  return summary.exhausted ? ", and more links no longer lower it" : "";
}

// Throws Error (ExitCode::kNotDone): the solve ended short of what was asked.
[[noreturn]] void ThrowNotDone(const fs::path& path,
                               const SolveSettings& settings,
                               const SolveSummary& summary) {
  const auto requested = RequestedError(settings);
  const std::string what =
      requested
          ? fmt::format(
                "the requested error {} was not reached; {:.4f} is estimated{}",
                *requested,
                summary.estimated_error,
                WhyItEnded(summary, path))
          : NotSettledText(summary);
  throw Error(
      ExitCode::kNotDone,
      fmt::format("{}. The solution is kept in '{}'", what, path.string()));
}

// Reports on a store that was closed and is complete on disk. Opens the store
// anew, so that the reported size is the size of the file that the user sees.
// Throws Error (ExitCode::kNotDone) if the solve ended short of what was asked.
void ReportSolve(const fs::path& path,
                 const SolveSummary& summary,
                 const CommonOptions& common,
                 MemoryBudget& budget) {
  const auto store = OpenStore(path, StoreAccess::kRead);
  const SolveSettings settings = LoadSettings(*store);
  Progress progress(Progress::ChooseOutput(common.verbose));
  Json report = SolveReport(*store, settings, budget, progress);
  report["peak_rss_bytes"] = PeakResidentBytes();
  WriteReportIfAsked(common, report);
  fmt::print("{}{}", SummaryText(report), NotesText(report));
  if (!summary.converged) {
    ThrowNotDone(path, settings, summary);
  }
}

// Makes a store that holds the settings from the start, so that a run that is
// killed at any moment can be resumed.
std::unique_ptr<BlockStorage> CreateStoreOf(const SolveSettings& settings,
                                            const fs::path& path) {
  return MakeStore(path, [&](BlockStorage& store) {
    SaveSettings(store, settings);
    SaveStage(store, Stage::kCreated);
  });
}

void SolveCommand::Run(const CLI::App& given) {
  BeginRun(common, {scene, store, options.overrides});
  ChooseByMethod(given, options.settings);
  if (IsSceneName(store)) {
    throw UsageError(fmt::format(
        "'{}' is a name of scenes, which no verb would open as a store; give "
        "another, such as '{}'",
        store,
        fs::path(store).replace_extension(".enf").string()));
  }
  const SolveSettings settings = SettingsOf(scene, options);
  if (fs::exists(store)) {
    RefuseExistingStore(store, settings);
  }
  LimitsInForce limits(common.limits);
  auto storage = CreateStoreOf(settings, store);
  try {
    const SolveSummary summary =
        RunStages(*storage, store, settings, common, limits.Budget());
    storage.reset();
    ReportSolve(store, summary, common, limits.Budget());
  } catch (const InterruptedError&) {
    throw;
  } catch (...) {
    // Removing a worthless store lets the user solve the corrected scene into
    // the same file.
    const bool worthless = storage != nullptr && IsWorthless(*storage);
    storage.reset();
    if (worthless) {
      RemoveStoreFiles(store);
    }
    throw;
  }
}

// Throws UsageError if the store's method is asked for no error.
void RequireErrorIsAsked(const fs::path& path, const SolveSettings& settings) {
  if (RequestedError(settings)) {
    return;
  }
  const MethodTraits& method = TraitsOf(settings.method.kind);
  throw UsageError(fmt::format(
      "--error: {} was solved with {}: solve the scene again with another {}",
      path.string(),
      method.knows_error
          ? "--elements, whatever the error"
          : fmt::format("--method {}, which does not know its error",
                        method.name),
      method.knows_error ? "--elements" : "--epsilon"));
}

void ResumeCommand::Run() {
  BeginRun(common, {store});
  auto storage = OpenExistingStore(store, StoreAccess::kWrite);
  SolveSettings settings = LoadSettings(*storage);
  CheckReport(common.report,
              {settings.scene, settings.overrides.value_or(fs::path())});
  if (LoadStage(*storage) < Stage::kImported) {
    RequireSceneFile(settings.scene);
  } else if (!CheckSceneUnchanged(*storage, settings)) {
    spdlog::warn(
        "'{}' or a file that it uses is no longer there, so that nobody knows "
        "whether they have changed; the store holds all that is needed",
        settings.scene.string());
  }
  if (error) {
    RequireErrorIsAsked(store, settings);
    settings.error = *error;
    SolveOptionsOf(settings).Validate();
    SaveSettings(*storage, settings);
    storage->Commit();  // also if the cap is refused: a resume has the error
  }
  LimitsInForce limits(common.limits);
  const SolveSummary summary =
      RunStages(*storage, store, settings, common, limits.Budget());
  storage.reset();
  ReportSolve(store, summary, common, limits.Budget());
}

}  // namespace

void AddSolveCommand(CLI::App& app) {
  auto options = std::make_shared<SolveCommand>();
  CLI::App* command =
      app.add_subcommand("solve", "Compute the light in a scene into a store");
  command
      ->add_option("scene",
                   options->scene,
                   "Scene file: .obj, or gbXML (.xml, .gbxml); .gz as well")
      ->required()
      ->type_name("SCENE");
  command->add_option("-o,--output", options->store, "The store to make")
      ->required()
      ->type_name("STORE");
  AddSceneOptions(*command, options->options);
  command
      ->add_option("--seed",
                   options->options.settings.seed,
                   "Seed of the visibility samples")
      ->check(CLI::Validator(CheckSeed, ""))
      ->type_name("N")
      ->capture_default_str();
  AddCommonOptions(*command, options->common);
  command->option_defaults()->group(
      "To compare methods (docs/reference-methods.md)");
  AddMethodOptions(*command, options->options.settings.method);
  SetExample(*command,
             "enfilade solve office.obj -o office.enf --error 0.05 --memory "
             "256M --report office.json");
  command->callback([options, command] { options->Run(*command); });
}

void AddResumeCommand(CLI::App& app) {
  auto options = std::make_shared<ResumeCommand>();
  CLI::App* command = app.add_subcommand(
      "resume", "Continue after a stop, or to another error");
  command->add_option("store", options->store, "The store to continue")
      ->required()
      ->type_name("STORE");
  command->add_option("--error", options->error, "New relative error to reach")
      ->type_name("E");
  AddCommonOptions(*command, options->common);
  SetExample(*command, "enfilade resume office.enf --error 0.02 --memory 256M");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
