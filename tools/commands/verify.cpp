// The verb `verify`.

#include "tools/verify/verify.h"

#include "base/stop.h"

#include <memory>
#include <optional>
#include <string>

#include "tools/commands/command.h"
#include "tools/commands/options.h"
#include "tools/pipeline_state.h"
#include "tools/progress.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

struct VerifyCommand {
  CommonOptions common;
  std::string store;
  VerifyOptions options;

  void Run();
};

Json LargestDifferences(const VerifySummary& summary) {
  Json list = Json::array();
  for (const DifferingPoint& d : summary.largest_differences) {
    const Point3 x = d.position;
    const Vec3 n = d.normal;
    Json point;
    point["position"] = {x.x, x.y, x.z};
    point["normal"] = {n.x, n.y, n.z};
    point["material"] = d.material;
    point["solution"] = d.solution;
    point["reference"] = d.reference;
    point["paths"] = d.paths;
    point["share"] = d.share;
    list.push_back(std::move(point));
  }
  return list;
}

// Whether the error of the solution is at most `requested_error`; nullopt if
// `requested_error` lies within the interval of the measured error.
std::optional<bool> MeetsRequest(const VerifySummary& summary,
                                 double requested_error) {
  if (summary.error_high <= requested_error) {
    return true;
  }
  if (summary.error_low > requested_error) {
    return false;
  }
  return std::nullopt;
}

std::string VerdictText(const VerifySummary& summary,
                        std::optional<double> requested_error) {
  if (!requested_error) {
    return {};
  }
  const auto meets = MeetsRequest(summary, *requested_error);
  if (!meets) {
    return fmt::format(
        "requested {}: the interval leaves open whether it was met{}\n",
        *requested_error,
        summary.tight ? "" : "; --seconds makes it narrower");
  }
  return fmt::format(
      "requested {}: {}\n", *requested_error, *meets ? "met" : "not met");
}

Json VerifyReport(const VerifySummary& summary,
                  std::optional<double> requested_error) {
  Json report;
  report["error"] = summary.error;
  report["error_low"] = summary.error_low;
  report["error_high"] = summary.error_high;
  report["requested_error"] = requested_error ? Json(*requested_error) : Json();
  const auto meets =
      requested_error ? MeetsRequest(summary, *requested_error) : std::nullopt;
  report["meets_request"] = meets ? Json(*meets) : Json(nullptr);
  report["points"] = summary.points;
  report["seconds"] = summary.seconds;
  report["mean_deviation"] = summary.mean_deviation;
  report["mean_deviation_low"] = summary.mean_deviation_low;
  report["mean_deviation_high"] = summary.mean_deviation_high;
  report["mean_reflected"] = summary.mean_reflected;
  report["area_m2"] = summary.area_m2;
  report["paths"] = summary.paths;
  report["rays"] = summary.rays;
  report["tight"] = summary.tight;
  report["largest_differences"] = LargestDifferences(summary);
  report["peak_rss_bytes"] = PeakResidentBytes();
  report["version"] = ProgramVersion();
  return report;
}

void VerifyCommand::Run() {
  BeginRun(common, {store});
  options.Validate();
  LimitsInForce limits(common.limits);
  const auto storage = OpenSolvedStore(store);
  const auto requested_error = RequestedError(LoadSettings(*storage));
  options.requested_error = requested_error.value_or(0);
  Progress progress(Progress::ChooseOutput(common.verbose));
  progress.Begin("verify");
  options.progress = [&](double fraction) {
    ThrowIfStopRequested();
    progress.Update(fraction);
  };
  const VerifySummary summary = Verify(*storage, options, limits.Budget());
  progress.End();
  fmt::print(
      "error {:.4f}, 95 % interval {:.4f} to {:.4f} ({} points, {} paths, "
      "{})\n{}mean deviation {:+.4f}, 95 % interval {:+.4f} to {:+.4f}\n",
      summary.error,
      summary.error_low,
      summary.error_high,
      summary.points,
      summary.paths,
      FormatDuration(summary.seconds),
      VerdictText(summary, requested_error),
      summary.mean_deviation,
      summary.mean_deviation_low,
      summary.mean_deviation_high);
  WriteReportIfAsked(common, VerifyReport(summary, requested_error));
}

}  // namespace

void AddVerifyCommand(CLI::App& app) {
  auto options = std::make_shared<VerifyCommand>();
  CLI::App* command = app.add_subcommand(
      "verify", "Measure the delivered error against Monte Carlo");
  command->add_option("store", options->store, "The store to verify")
      ->required()
      ->type_name("STORE");
  command
      ->add_option("--seconds",
                   options->options.max_seconds,
                   "Stop after this time, with a wider interval")
      ->type_name("S")
      ->capture_default_str();
  command
      ->add_option("--tightness",
                   options->options.target_relative_half_width,
                   "Stop at this half-width of the interval, relative to the "
                   "error or to the one asked for, whichever is larger")
      ->type_name("T")
      ->capture_default_str();
  command
      ->add_option("--seed", options->options.seed, "Seed of the light paths")
      ->check(CLI::Validator(CheckSeed, ""))
      ->type_name("N")
      ->capture_default_str();
  AddCommonOptions(*command, options->common);
  SetExample(*command, "enfilade verify office.enf --report verify.json");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
