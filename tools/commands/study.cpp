// The verb `study`.

#include "tools/study/study.h"

#include "base/error.h"
#include "base/memory.h"
#include "base/stopwatch.h"

#include <chrono>
#include <memory>
#include <ostream>
#include <set>
#include <string>

#include "tools/commands/command.h"
#include "tools/commands/options.h"
#include "tools/pending_file.h"
#include "tools/study/curves.h"
#include "tools/study/report.h"
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace enfilade {
namespace {

struct StudyCommand {
  StudyOptions options;
  std::string folder = "study";
  std::string experiment;
  std::string report;  // empty: none
  bool list = false;

  void Run();
};

void List() {
  for (const Experiment& e : Experiments()) {
    fmt::print("{:14} {} ({} or {} values, {} settings each)\n",
               e.name,
               e.about,
               e.few_values.size(),
               e.all_values.size(),
               e.settings.size());
  }
}

// Throws UsageError if the experiment does not have one of `methods`.
void RequireMethods(const Experiment& experiment,
                    const std::vector<std::string>& methods) {
  std::set<std::string> known;
  for (const StudySetting& setting : experiment.settings) {
    known.insert(setting.method);
  }
  for (const std::string& method : methods) {
    if (known.count(method) == 0) {
      throw UsageError(fmt::format("--methods {}: experiment {} has {}",
                                   method,
                                   experiment.name,
                                   fmt::join(known, ", ")));
    }
  }
}

void WriteTables(const std::filesystem::path& path, const std::string& tables) {
  WriteFileInOneStep(path, [&](std::ostream& out) { out << tables; });
  fmt::print("\n{}\n", tables);
}

// Draws the curves, prints their paths and returns how many there are.
size_t DrawCurves(const Experiment& experiment,
                  const std::vector<Json>& lines,
                  const std::filesystem::path& folder) {
  const auto pictures = DrawStudy(experiment, lines, folder);
  for (const auto& picture : pictures) {
    fmt::print("{}\n", picture.string());
  }
  if (pictures.empty()) {
    fmt::print("no curves: gnuplot is not there or failed ({}/{}.gp)\n",
               folder.string(),
               experiment.name);
  }
  return pictures.size();
}

void StudyCommand::Run() {
  if (list) {
    List();
    return;
  }
  if (experiment.empty()) {
    throw UsageError("name an experiment, or give --list");
  }
  const auto start = std::chrono::steady_clock::now();
  options.folder = std::filesystem::absolute(folder);
  const Experiment& chosen = FindExperiment(experiment);
  RequireMethods(chosen, options.methods);
  const auto tables = options.folder / (chosen.name + ".md");
  CheckReport(report, {tables, options.folder / (chosen.name + ".jsonl")});
  Progress progress(Progress::ChooseOutput(false));
  const std::vector<Json> lines = RunStudy(chosen, options, progress);
  WriteTables(tables, StudyTables(chosen, lines));
  const size_t pictures = DrawCurves(chosen, lines, options.folder);
  if (!report.empty()) {
    WriteReport(report,
                {{"experiment", chosen.name},
                 {"folder", options.folder.string()},
                 {"runs", lines.size()},
                 {"pictures", pictures},
                 {"seconds", SecondsSince(start)},
                 {"peak_rss_bytes", PeakResidentBytes()},
                 {"version", ProgramVersion()}});
  }
}

}  // namespace

void AddStudyCommand(CLI::App& app) {
  auto options = std::make_shared<StudyCommand>();
  CLI::App* command = app.add_subcommand(
      "study", "Run an experiment of the 1997 study and tabulate it");
  command->add_option("experiment", options->experiment, "One of --list")
      ->type_name("EXPERIMENT");
  command->add_flag("--list", options->list, "List the experiments");
  command
      ->add_option("--out",
                   options->folder,
                   "Folder of its lines, tables and curves; runs that it "
                   "already holds are not run again")
      ->type_name("DIR")
      ->capture_default_str();
  command->add_flag("--full",
                    options->options.all_values,
                    "All values of the parameter, not a few");
  command
      ->add_option("--values",
                   options->options.values,
                   "Values of the parameter, by commas")
      ->delimiter(',')
      ->option_text("V,...");
  command
      ->add_option("--methods",
                   options->options.methods,
                   "Only these: haar, f2, f3, m2, m3, matrix, progressive, "
                   "substructuring, or what else the experiment has")
      ->delimiter(',')
      ->option_text("METHOD,...");
  command
      ->add_option("--seconds",
                   options->options.most_seconds,
                   "Longest time of one run; what takes longer is stopped")
      ->check(AboveZero())
      ->type_name("S")
      ->capture_default_str();
  command
      ->add_option("--verify",
                   options->options.verify_seconds,
                   "Seconds that verify has for each run; 0: none")
      ->check(CLI::NonNegativeNumber.description(""))
      ->type_name("S")
      ->capture_default_str();
  AddReportOption(*command, options->report);
  SetExample(*command, "enfilade study blocker --out study");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
