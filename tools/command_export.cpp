// The verbs `probe` and `export`: what a solution says elsewhere.

#include "base/error.h"

#include <cerrno>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <system_error>
#include <vector>

#include "tools/command.h"
#include "tools/command_options.h"
#include "tools/export.h"
#include "tools/pending_file.h"
#include "tools/probe.h"
#include "tools/progress.h"
#include "tools/report.h"
#include "tools/signal.h"
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

struct ExportCommand {
  CommonOptions common;
  std::string store;
  std::string output;
  std::vector<double> eye;
  std::vector<double> target;
  std::vector<uint32_t> size;
  ExportOptions options;

  void Run();
};

// Calls write(stream) on a file that appears under `path` only if complete.
void WriteFileInOneStep(const fs::path& path,
                        const std::function<void(std::ostream&)>& write) {
  PendingFile pending(path);
  std::ofstream file(pending.Path(), std::ios::binary | std::ios::trunc);
  if (file) {
    write(file);
    file.close();
  }
  if (!file) {
    throw DiskError(fmt::format("cannot write '{}': {}",
                                path.string(),
                                std::system_category().message(errno)));
  }
  pending.Keep();
}

// The size of a file; 0 of what is none, as a pipe.
double BytesOf(const fs::path& path) {
  std::error_code is_no_file;
  const auto bytes = fs::file_size(path, is_no_file);
  return is_no_file ? 0.0 : static_cast<double>(bytes);
}

// The share of a stream of so many bytes that has been read.
double ShareRead(std::istream& stream, double all_bytes) {
  if (all_bytes <= 0) {
    return 0;
  }
  const auto at = stream.tellg();  // none at the end
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

Point3 PointOf(const std::vector<double>& xyz) {
  return Point3{xyz.at(0), xyz.at(1), xyz.at(2)};
}

void ExportCommand::Run() {
  BeginRun(common, {store, output});
  RequireApart(output, {store});
  if (!eye.empty()) {
    options.camera.eye = PointOf(eye);
  }
  if (!target.empty()) {
    options.camera.target = PointOf(target);
  }
  if (!size.empty()) {
    options.width = size.at(0);
    options.height = size.at(1);
  }
  options.Validate();
  RequireWritable(output);
  LimitsInForce limits(common.limits);
  const auto storage = OpenSolvedStore(store);
  Progress progress(Progress::ChooseOutput(common.verbose));
  progress.Begin("export");
  options.progress = [&](double fraction) {
    ThrowIfStopRequested();
    progress.Update(fraction);
  };
  const ExportSummary summary =
      Export(*storage, output, options, limits.Budget());
  progress.End();
  const std::string what =
      summary.elements > 0
          ? fmt::format("{} elements, ", summary.elements)
          : fmt::format("{} x {} pixels, ", options.width, options.height);
  fmt::print("wrote {}: {}{}\n",
             output,
             what,
             FormatBytes(static_cast<double>(summary.bytes)));
  WriteReportIfAsked(common,
                     Json{{"elements", summary.elements},
                          {"rays", summary.rays},
                          {"bytes", summary.bytes},
                          {"seconds", summary.seconds},
                          {"peak_rss_bytes", PeakResidentBytes()},
                          {"version", ProgramVersion()}});
}

// Reads one of a few names.
template <typename Enum>
CLI::Validator OneOf(const std::map<std::string, Enum>& names) {
  return CLI::CheckedTransformer(names, CLI::ignore_case).description("");
}

void AddMeshOption(CLI::App& command, ExportCommand& options) {
  command
      .add_option_function<MeshKind>(
          "--mesh",
          [&options](const MeshKind& kind) { options.options.mesh = kind; },
          "leaves: the elements as solved; anchored: without T-vertices; "
          "smooth: the same, values averaged at vertices. Smooth if not given, "
          "but leaves in .vtu")
      ->transform(OneOf<MeshKind>({{"leaves", MeshKind::kLeaves},
                                   {"anchored", MeshKind::kAnchored},
                                   {"smooth", MeshKind::kSmooth}}))
      ->type_name("MESH");
}

void AddCameraOptions(CLI::App& command, ExportCommand& options) {
  command.add_option("--eye", options.eye, "Where the camera stands, metres")
      ->expected(3)
      ->delimiter(',')
      ->option_text("X,Y,Z");
  command.add_option("--target", options.target, "What it looks at")
      ->expected(3)
      ->delimiter(',')
      ->option_text("X,Y,Z");
  command
      .add_option("--fov",
                  options.options.camera.vertical_fov_degrees,
                  "Vertical field of view, degrees")
      ->type_name("DEGREES")
      ->capture_default_str();
  command
      .add_option("--view",
                  options.options.camera.view,
                  "perspective (default), or plan: from above, cut open")
      ->transform(OneOf<CameraView>({{"perspective", CameraView::kPerspective},
                                     {"plan", CameraView::kPlan}}))
      ->type_name("VIEW");
  command
      .add_option("--cut",
                  options.options.camera.plan_cut_m,
                  "Height of the plan's cut, metres")
      ->type_name("HEIGHT");
  command
      .add_option("--up", options.options.camera.up, "auto (default), y or z")
      ->transform(OneOf<UpAxis>(
          {{"auto", UpAxis::kAutomatic}, {"y", UpAxis::kY}, {"z", UpAxis::kZ}}))
      ->type_name("AXIS");
  command
      .add_option(
          "--size", options.size, "Size of a picture, pixels (1280,720)")
      ->expected(2)
      ->delimiter(',')
      ->option_text("WIDTH,HEIGHT");
  command
      .add_option("--samples",
                  options.options.samples,
                  "Samples per pixel and direction")
      ->type_name("N")
      ->capture_default_str();
  command
      .add_option("--exposure",
                  options.options.exposure_stops,
                  "Stops of brightness to add")
      ->type_name("STOPS")
      ->capture_default_str();
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

void AddExportCommand(CLI::App& app) {
  auto options = std::make_shared<ExportCommand>();
  CLI::App* command = app.add_subcommand(
      "export",
      "Write a mesh, a picture or a table of a solution; the "
      "extension chooses the format");
  command->add_option("store", options->store, "The store to read")
      ->required()
      ->type_name("STORE");
  command
      ->add_option("out",
                   options->output,
                   "File to write: .ply .gltf .glb .vtu .csv .png .exr")
      ->required()
      ->type_name("OUT");
  AddMeshOption(*command, *options);
  AddCameraOptions(*command, *options);
  AddCommonOptions(*command, options->common);
  SetExample(*command,
             "enfilade export office.enf office.png --eye 1,1,1.6 --target "
             "5,4,1 --size 1280,720\n"
             "  enfilade export office.enf office.ply --mesh leaves");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
