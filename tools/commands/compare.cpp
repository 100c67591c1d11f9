// The verb `compare`.

#include "tools/compare.h"

#include "base/stop.h"

#include <memory>
#include <string>

#include "tools/commands/command.h"
#include "tools/commands/options.h"
#include "tools/progress.h"
#include "tools/report.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

struct CompareCommand {
  CommonOptions common;
  std::string a;
  std::string b;
  CompareOptions options;

  void Run();
};

Json CompareReport(const CompareSummary& summary) {
  Json report;
  report["rms_error"] = summary.rms_error;
  report["l1_error"] = summary.l1_error;
  report["max_error"] = summary.max_error;
  report["mean_deviation"] = summary.mean_deviation;
  report["mean_reflected"] = summary.mean_reflected;
  report["points"] = summary.points;
  report["peak_rss_bytes"] = PeakResidentBytes();
  report["version"] = ProgramVersion();
  return report;
}

void CompareCommand::Run() {
  BeginRun(common, {a, b});
  options.Validate();
  LimitsInForce limits(common.limits);
  const auto store_a = OpenSolvedStore(a);
  const auto store_b = OpenSolvedStore(b);
  Progress progress(Progress::ChooseOutput(common.verbose));
  progress.Begin("compare");
  options.progress = [&](double fraction) {
    ThrowIfStopRequested();
    progress.Update(fraction);
  };
  const CompareSummary summary =
      Compare(*store_a, *store_b, options, limits.Budget());
  progress.End();
  fmt::print(
      "rms error {:.6f}, L1 error {:.6f}, largest {:.6f}, mean deviation "
      "{:+.6f} ({} points)\n",
      summary.rms_error,
      summary.l1_error,
      summary.max_error,
      summary.mean_deviation,
      summary.points);
  WriteReportIfAsked(common, CompareReport(summary));
}

}  // namespace

void AddCompareCommand(CLI::App& app) {
  auto options = std::make_shared<CompareCommand>();
  CLI::App* command = app.add_subcommand(
      "compare", "Error of solution A against solution B of the same scene");
  command->add_option("a", options->a, "The store to judge")
      ->required()
      ->type_name("A");
  command->add_option("b", options->b, "The reference")
      ->required()
      ->type_name("B");
  command
      ->add_option("--samples",
                   options->options.samples_per_patch,
                   "At least so many points on each patch, up to 1024: more "
                   "where errors are in one place")
      ->check(CLI::Range(1, 1024).description(""))
      ->type_name("N")
      ->capture_default_str();
  AddCommonOptions(*command, options->common);
  SetExample(*command, "enfilade compare coarse.enf fine.enf");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
