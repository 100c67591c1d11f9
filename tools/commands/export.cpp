// The verb `export`.

#include "tools/export/export.h"

#include "base/stop.h"

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/commands/command.h"
#include "tools/commands/options.h"
#include "tools/pending_file.h"
#include "tools/progress.h"
#include "tools/report.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

struct ExportCommand {
  CommonOptions common;
  std::string store;
  std::string output;
  std::vector<double> eye;
  std::vector<double> target;
  std::vector<uint32_t> size;
  ExportOptions options;
  std::vector<const CLI::Option*> of_pictures;
  std::vector<const CLI::Option*> of_perspective;
  const CLI::Option* of_plan = nullptr;

  void Run();
  void RequireFitting() const;
};

Point3 PointOf(const std::vector<double>& xyz) {
  return Point3{xyz.at(0), xyz.at(1), xyz.at(2)};
}

// Throws UsageError if an option would be without effect.
void ExportCommand::RequireFitting() const {
  const auto refuse = [](const CLI::Option* option, const std::string& why) {
    if (option->count() > 0) {
      throw UsageError(fmt::format("{} {}", option->get_name(), why));
    }
  };
  RequireFormat(output);
  if (!IsPicture(output)) {
    for (const CLI::Option* option : of_pictures) {
      refuse(option, "is for pictures (.png, .exr); leave it out");
    }
  } else if (options.camera.view == CameraView::kPlan) {
    for (const CLI::Option* option : of_perspective) {
      refuse(option, "is for --view perspective: a plan shows the whole");
    }
  } else {
    refuse(of_plan, "is for --view plan");
  }
}

void ExportCommand::Run() {
  BeginRun(common, {store});
  for (const std::filesystem::path& file : OutputsOf(output)) {
    RequireApart(file, {store});
    RequireWritable(file);
    CheckReport(common.report, {file});
    RequireNothingUnnamedReplaced(file, output);
  }
  RequireFitting();
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

void AddMeshOption(CLI::App& command, ExportCommand& options) {
  command
      .add_option_function<MeshKind>(
          "--mesh",
          [&options](const MeshKind& kind) { options.options.mesh = kind; },
          "leaves: the elements as solved; anchored (not in pictures): without "
          "T-vertices; smooth: the same, values averaged at vertices. Smooth "
          "if not given, but leaves in .vtu; not for .csv (docs/export.md)")
      ->transform(OneOf<MeshKind>({{"leaves", MeshKind::kLeaves},
                                   {"anchored", MeshKind::kAnchored},
                                   {"smooth", MeshKind::kSmooth}}))
      ->type_name("MESH");
}

void AddCameraOptions(CLI::App& command, ExportCommand& options) {
  CLI::Option* const eye =
      command
          .add_option("--eye", options.eye, "Where the camera stands, metres")
          ->expected(3)
          ->delimiter(',')
          ->option_text("X,Y,Z");
  CLI::Option* const target =
      command.add_option("--target", options.target, "What it looks at")
          ->expected(3)
          ->delimiter(',')
          ->option_text("X,Y,Z");
  CLI::Option* const fov =
      command
          .add_option("--fov",
                      options.options.camera.vertical_fov_degrees,
                      "Vertical field of view, degrees")
          ->type_name("DEGREES")
          ->capture_default_str();
  CLI::Option* const view =
      command
          .add_option("--view",
                      options.options.camera.view,
                      "perspective (default), or plan: from above, cut open")
          ->transform(
              OneOf<CameraView>({{"perspective", CameraView::kPerspective},
                                 {"plan", CameraView::kPlan}}))
          ->type_name("VIEW");
  CLI::Option* const cut = command
                               .add_option("--cut",
                                           options.options.camera.plan_cut_m,
                                           "Height of the plan's cut, metres")
                               ->type_name("HEIGHT");
  options.of_perspective = {eye, target, fov};
  options.of_plan = cut;
  options.of_pictures = {eye, target, fov, view, cut};
}

void AddPictureOptions(CLI::App& command, ExportCommand& options) {
  command
      .add_option(
          "--up",
          options.options.camera.up,
          "Axis that is up in pictures and glTF: auto (default), y or z")
      ->transform(OneOf<UpAxis>(
          {{"auto", UpAxis::kAutomatic}, {"y", UpAxis::kY}, {"z", UpAxis::kZ}}))
      ->type_name("AXIS");
  options.of_pictures.push_back(
      command
          .add_option(
              "--size", options.size, "Size of a picture, pixels (1280,720)")
          ->expected(2)
          ->delimiter(',')
          ->option_text("WIDTH,HEIGHT"));
  options.of_pictures.push_back(
      command
          .add_option("--samples",
                      options.options.samples,
                      "Samples per pixel and direction")
          ->type_name("N")
          ->capture_default_str());
  command
      .add_option("--exposure",
                  options.options.exposure_stops,
                  "Stops of brightness to add to .png and to colours of meshes")
      ->type_name("STOPS")
      ->capture_default_str();
}

}  // namespace

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
                   "File to write: .ply .gltf (and a .bin beside it) .glb .vtu "
                   ".csv .png .exr (docs/export.md)")
      ->required()
      ->type_name("OUT");
  AddMeshOption(*command, *options);
  AddCameraOptions(*command, *options);
  AddPictureOptions(*command, *options);
  AddCommonOptions(*command, options->common);
  SetExample(*command,
             "enfilade export office.enf office.png --eye 1,1,1.6 --target "
             "5,4,1 --size 1280,720\n"
             "  enfilade export office.enf office.ply --mesh leaves");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
