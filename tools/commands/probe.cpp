// The verb `probe`.

#include "tools/probe.h"

#include "base/error.h"
#include "base/stop.h"

#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <system_error>

#include "tools/commands/command.h"
#include "tools/commands/options.h"
#include "tools/pending_file.h"
#include "tools/progress.h"
#include "tools/report.h"
#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

struct ProbeCommand {
  CommonOptions common;
  std::string store;
  std::string points;
  std::string output;  // empty: standard output
  ProbeOptions options;

  void Run();
};

// The size of a regular file; 0 for anything else, such as a pipe.
double BytesOf(const fs::path& path) {
  std::error_code is_no_file;
  const auto bytes = fs::file_size(path, is_no_file);
  return is_no_file ? 0.0 : static_cast<double>(bytes);
}

// The fraction of a stream of `all_bytes` bytes that has been read; 0 if
// `all_bytes` is not known (0).
double ShareRead(std::istream& stream, double all_bytes) {
  if (all_bytes <= 0) {
    return 0;
  }
  const auto at = stream.tellg();  // -1 once the end has been read
  return at < 0 ? 1 : static_cast<double>(at) / all_bytes;
}

void ProbeCommand::Run() {
  BeginRun(common, {store, points, output});
  options.Validate();
  if (!output.empty()) {
    RequireApart(output, {store, points});
    RequireWritable(output);
  }
  LimitsInForce limits(common.limits);
  const auto storage = OpenSolvedStore(store);
  std::ifstream input(points);
  if (!input || fs::is_directory(points)) {
    throw InputError(fmt::format("cannot read the points '{}'", points));
  }
  Progress progress(Progress::ChooseOutput(common.verbose));
  progress.Begin("probe");
  const double all_bytes = BytesOf(points);
  options.progress = [&](uint64_t done) {
    ThrowIfStopRequested();
    progress.Update(ShareRead(input, all_bytes),
                    fmt::format("{} points", done));
  };
  ProbeSummary summary;
  const auto probe = [&](std::ostream& out) {
    summary = Probe(*storage, input, points, out, options, limits.Budget());
  };
  if (output.empty()) {
    probe(std::cout);
    std::cout.flush();
    if (!std::cout) {
      throw DiskError("cannot write to standard output");
    }
  } else {
    WriteFileInOneStep(output, probe);
  }
  progress.End();
  if (summary.points == 0) {
    spdlog::warn("'{}' holds no points: give lines of x,y,z,nx,ny,nz", points);
  }
  WriteReportIfAsked(common,
                     Json{{"points", summary.points},
                          {"on_patches", summary.on_patches},
                          {"gathered", summary.gathered},
                          {"seconds", summary.seconds},
                          {"peak_rss_bytes", PeakResidentBytes()},
                          {"version", ProgramVersion()}});
}

}  // namespace

void AddProbeCommand(CLI::App& app) {
  auto options = std::make_shared<ProbeCommand>();
  CLI::App* command =
      app.add_subcommand("probe", "Irradiance at points x,y,z,nx,ny,nz");
  command->add_option("store", options->store, "The store to read")
      ->required()
      ->type_name("STORE");
  command->add_option("points", options->points, "The points")
      ->required()
      ->type_name("POINTS.csv");
  command
      ->add_option("-o,--output",
                   options->output,
                   "Where to write; standard output otherwise")
      ->type_name("OUT.csv");
  command
      ->add_option("--rays",
                   options->options.gather_rays,
                   "Rays over the hemisphere of a point in free space")
      ->type_name("N")
      ->capture_default_str();
  AddCommonOptions(*command, options->common);
  SetExample(*command, "enfilade probe office.enf points.csv -o lux.csv");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
