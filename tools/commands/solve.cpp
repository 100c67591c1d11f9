// The verbs `solve` and `resume`.

#include "base/error.h"
#include "scene/import.h"
#include "solver/reference/form_factor_kinds.h"
#include "store/store_files.h"

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "tools/commands/command.h"
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
  bool basis_given = false;
  bool linear_solver_given = false;
  bool form_factors_given = false;  // or --projection
  bool error_given = false;
  SceneOptions options;

  void Run();

 private:
  void ChooseByMethod();
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

// Sets the defaults that depend on the method. Throws UsageError for options
// that the method does not take.
void SolveCommand::ChooseByMethod() {
  MethodOptions& method = options.settings.method;
  const MethodTraits& traits = TraitsOf(method.kind);
  if (!traits.has_panels && form_factors_given) {
    throw UsageError(
        "--form-factors and --projection are of the reference methods; give "
        "--method matrix, progressive or substructuring");
  }
  if (!traits.knows_error && error_given) {
    throw UsageError(fmt::format(
        "--method {} does not know its error: give --epsilon", traits.name));
  }
  if (traits.is_reference && !basis_given) {
    options.settings.basis = "haar";
  }
  if (!linear_solver_given && !FormFactorOptionsOf(method).AreSymmetric()) {
    method.linear_solver = "gs";
  }
}

void SolveCommand::Run() {
  BeginRun(common, {scene, store, options.overrides});
  ChooseByMethod();
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

std::map<std::string, SolveMethod> MethodsByName() {
  std::map<std::string, SolveMethod> methods;
  for (const MethodTraits& traits : AllMethods()) {
    methods.emplace(traits.name, traits.method);
  }
  return methods;
}

void AddFormFactorOptions(CLI::App& command, MethodOptions& method) {
  command
      .add_option("--form-factors",
                  method.form_factors,
                  "With matrix, progressive and substructuring: exact, point, "
                  "polygon, switch, hemicube "
                  "or montecarlo (docs/reference-methods.md)")
      ->check(
          CLI::IsMember(
              {"exact", "point", "polygon", "switch", "hemicube", "montecarlo"})
              .description(""))
      ->type_name("KIND")
      ->capture_default_str();
  command
      .add_option("--projection",
                  method.projection,
                  "With --method matrix: galerkin (irradiance averaged over an "
                  "element) or collocation (at its centre)")
      ->check(CLI::IsMember({"galerkin", "collocation"}).description(""))
      ->type_name("PROJECTION")
      ->capture_default_str();
}

void AddHierarchicalOptions(CLI::App& command, MethodOptions& method) {
  const auto add = [&](const char* name, std::string& value, const char* what) {
    command.add_option(name, value, what)->type_name("NAME");
  };
  command
      .add_option(
          "--epsilon",
          method.epsilon,
          "With --method hierarchical: the error by its oracle above which "
          "a link is refined (0.001 if not given)")
      ->check(AboveZero())
      ->type_name("EPS");
  add("--visibility",
      method.visibility,
      "With --method hierarchical: ray, fractional, triage, quadrature or "
      "stratified");
  add("--singular",
      method.singular,
      "With --method hierarchical, where surfaces touch: none, switch, cc or "
      "near");
  add("--oracle",
      method.oracle,
      "With --method hierarchical: form-factor, power, polynomial or transfer");
}

void AddMethodOptions(CLI::App& command, SceneOptions& options) {
  MethodOptions& method = options.settings.method;
  command
      .add_option("--method",
                  method.kind,
                  "matrix, progressive, substructuring, hierarchical or "
                  "wavelet: all but wavelet are for comparison, and hold the "
                  "scene whole (docs/reference-methods.md)")
      ->transform(OneOf(MethodsByName()))
      ->type_name("METHOD")
      ->default_str(std::string(TraitsOf(method.kind).name));
  command
      .add_option(
          "--linear-solver",
          method.linear_solver,
          "With --method matrix: gs (Gauss-Seidel), sor or cg (conjugate "
          "gradients, for symmetric form factors; for others the default "
          "is gs)")
      ->check(CLI::IsMember({"gs", "sor", "cg"}).description(""))
      ->type_name("SOLVER")
      ->capture_default_str();
  AddFormFactorOptions(command, method);
  AddHierarchicalOptions(command, method);
  command
      .add_option("--elements",
                  method.elements,
                  "With matrix, progressive and substructuring: dice as finely "
                  "as this number of elements "
                  "allows, whatever the error")
      ->check(WholeAboveZero())
      ->type_name("N");
  command.add_flag("--ambient",
                   method.ambient,
                   "Progressive and substructuring: add the light still to "
                   "come as an even ambient term");
}

}  // namespace

void AddSolveCommand(CLI::App& app) {
  auto options = std::make_shared<SolveCommand>();
  CLI::App* command =
      app.add_subcommand("solve", "Compute the light in a scene into a store");
  command
      ->add_option("scene",
                   options->scene,
                   "Scene file: .obj or gbXML .xml; .gz as well")
      ->required()
      ->type_name("SCENE");
  command->add_option("-o,--output", options->store, "The store to make")
      ->required()
      ->type_name("STORE");
  command
      ->add_option("--seed",
                   options->options.settings.seed,
                   "Seed of the visibility samples")
      ->check(CLI::Validator(CheckSeed, ""))
      ->type_name("N")
      ->capture_default_str();
  AddMethodOptions(*command, options->options);
  AddSceneOptions(*command, options->options);
  AddCommonOptions(*command, options->common);
  SetExample(*command,
             "enfilade solve office.obj -o office.enf --error 0.05 --memory "
             "256M --report office.json");
  command->callback([options, command] {
    options->basis_given = command->count("--basis") > 0;
    options->linear_solver_given = command->count("--linear-solver") > 0;
    options->form_factors_given = command->count("--form-factors") > 0 ||
                                  command->count("--projection") > 0;
    options->error_given = command->count("--error") > 0;
    options->Run();
  });
}

void AddResumeCommand(CLI::App& app) {
  auto options = std::make_shared<ResumeCommand>();
  CLI::App* command = app.add_subcommand(
      "resume", "Continue after a stop, or to a smaller error");
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
