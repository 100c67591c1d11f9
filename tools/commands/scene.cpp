// The verb `scene`: the generated test scenes, one subcommand each.

#include "base/memory.h"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "tools/commands/command.h"
#include "tools/commands/options.h"
#include "tools/report.h"
#include "tools/scenes/chairs.h"
#include "tools/scenes/floorplan.h"
#include "tools/scenes/obj_writer.h"
#include "tools/scenes/simple.h"
#include <CLI/CLI.hpp>

namespace enfilade {

namespace {

struct Output {
  std::filesystem::path scene;
  std::string report;  // empty: none
};

// Writes the scene to output.scene by `write` and prints what was written.
template <typename Options>
void Generate(void (*write)(const Options&, ObjWriter&),
              const Options& options,
              const Output& output) {
  const auto start = std::chrono::steady_clock::now();
  ObjWriter writer(output.scene);
  CheckReport(output.report, {writer.Path(), writer.MaterialPath()});
  RequireNothingUnnamedReplaced(writer.MaterialPath(), writer.Path());
  write(options, writer);
  writer.Finish();
  const std::chrono::duration<double> seconds =
      std::chrono::steady_clock::now() - start;
  fmt::print("wrote {}: {} polygons in {} objects, {} materials\n",
             output.scene.string(),
             writer.Polygons(),
             writer.Objects(),
             writer.Materials());
  if (!output.report.empty()) {
    WriteReport(output.report,
                {{"scene", output.scene.string()},
                 {"polygons", writer.Polygons()},
                 {"objects", writer.Objects()},
                 {"instances", writer.Instances()},
                 {"materials", writer.Materials()},
                 {"wall_seconds", seconds.count()},
                 {"peak_rss_bytes", PeakResidentBytes()},
                 {"version", ProgramVersion()}});
  }
}

// Adds the subcommand of one scene and sets `command` to it. Returns its
// options, which live as long as the app.
template <typename Options>
std::shared_ptr<Options> AddScene(CLI::App& scenes,
                                  CLI::App*& command,
                                  const std::string& name,
                                  const std::string& description,
                                  void (*write)(const Options&, ObjWriter&)) {
  auto options = std::make_shared<Options>();
  auto output = std::make_shared<Output>();
  command = scenes.add_subcommand(name, description);
  command->add_option("out", output->scene, "The file to write, ending in .obj")
      ->required()
      ->type_name("OUT.obj");
  AddReportOption(*command, output->report);
  command->callback(
      [write, options, output] { Generate(write, *options, *output); });
  return options;
}

void AddExample(CLI::App& command, const std::string& arguments) {
  command.footer("Example:\n  enfilade scene " + command.get_name() + " " +
                 arguments);
}

void AddSeed(CLI::App& command, uint64_t& seed) {
  command.add_option("--seed", seed, "Another seed, another scene")
      ->check(CLI::Validator(CheckSeed, ""))
      ->capture_default_str();
}

void AddChairScenes(CLI::App& scenes) {
  CLI::App* command = nullptr;
  const auto chairs =
      AddScene(scenes,
               command,
               "chairs",
               "A room, an overhead light and chairs of 27 polygons",
               &WriteChairs);
  command->add_option("--count", chairs->count, "Number of chairs")
      ->capture_default_str();
  command
      ->add_option("--scaling",
                   chairs->scaling,
                   "How the room grows with the chairs: floor and height, "
                   "floor only, or not at all")
      ->transform(OneOf(std::map<std::string, ChairScaling>{
          {"both", ChairScaling::kBoth},
          {"horizontal", ChairScaling::kHorizontal},
          {"none", ChairScaling::kNone}}))
      ->type_name("both|horizontal|none")
      ->default_str("both");
  AddSeed(*command, chairs->seed);
  AddExample(*command, "--count 36 chairs.obj");

  const auto lights = AddScene(scenes,
                               command,
                               "lights",
                               "The room with 12 chairs and several lights",
                               &WriteLights);
  command->add_option("--lights", lights->lights, "Number of lights")
      ->capture_default_str();
  AddSeed(*command, lights->seed);
  AddExample(*command, "--lights 9 lights.obj");

  const auto furnace =
      AddScene(scenes,
               command,
               "furnace",
               "A closed room, all of which emits and reflects alike",
               &WriteFurnace);
  command->add_option("--count", furnace->count, "Number of chairs")
      ->capture_default_str();
  command
      ->add_option("--reflectance",
                   furnace->reflectance,
                   "Reflectance of every face, at least 0 and below 1")
      ->capture_default_str();
  command
      ->add_option(
          "--emission", furnace->emission, "Exitance of every face, W/m2")
      ->capture_default_str();
  AddSeed(*command, furnace->seed);
  AddExample(*command, "--count 9 --reflectance 0.8 furnace.obj");
}

void AddTwoPatchScenes(CLI::App& scenes) {
  CLI::App* command = nullptr;
  const auto parallel =
      AddScene(scenes,
               command,
               "parallel",
               "Two unit squares face to face, one of which emits",
               &WriteParallel);
  command
      ->add_option("--separation",
                   parallel->separation,
                   "Distance of the squares in metres, above 0")
      ->capture_default_str();
  AddExample(*command, "--separation 0.5 parallel.obj");

  const auto perpendicular =
      AddScene(scenes,
               command,
               "perpendicular",
               "Two unit squares at a right angle, one of which emits",
               &WritePerpendicular);
  command
      ->add_option("--separation",
                   perpendicular->separation,
                   "Distance of the near edges in metres")
      ->capture_default_str();
  AddExample(*command, "--separation 0 perpendicular.obj");

  const auto blocker = AddScene(scenes,
                                command,
                                "blocker",
                                "A light, a receiver and a blocker between",
                                &WriteBlocker);
  command
      ->add_option(
          "--height,--separation",
          blocker->height,
          "Height of the blocker above the receiver in metres, below 2")
      ->capture_default_str();
  AddExample(*command, "--height 0.7 blocker.obj");
}

void AddReflectanceScenes(CLI::App& scenes) {
  CLI::App* command = nullptr;
  const auto box = AddScene(scenes,
                            command,
                            "box",
                            "A box with a light in its ceiling, the brighter "
                            "the darker the walls",
                            &WriteBox);
  command
      ->add_option("--reflectance",
                   box->reflectance,
                   "Reflectance of the walls, above 0 and below 1")
      ->capture_default_str();
  AddExample(*command, "--reflectance 0.7 box.obj");

  const auto tube = AddScene(scenes,
                             command,
                             "tube",
                             "A long tube with a light at one end",
                             &WriteTube);
  command
      ->add_option("--reflectance",
                   tube->reflectance,
                   "Reflectance of the walls, at least 0 and below 1")
      ->capture_default_str();
  AddExample(*command, "--reflectance 0.9 tube.obj");
}

void AddBulbsScene(CLI::App& scenes) {
  CLI::App* command = nullptr;
  const auto bulbs = AddScene(scenes,
                              command,
                              "bulbs",
                              "A room and a table, lit by two bulbs of facets",
                              &WriteBulbs);
  command
      ->add_option("--slices",
                   bulbs->slices,
                   "Facets of a bulb from pole to pole; there are twice as "
                   "many around it")
      ->capture_default_str();
  AddExample(*command, "--slices 6 bulbs.obj");
}

void AddDownlightsScene(CLI::App& scenes) {
  CLI::App* command = nullptr;
  const auto downlights =
      AddScene(scenes,
               command,
               "downlights",
               "A room lit by bulbs in small white tubes below its ceiling",
               &WriteDownlights);
  command->add_option("--count", downlights->count, "Number of downlights")
      ->capture_default_str();
  AddExample(*command, "--count 48 downlights.obj");
}

void AddPieceOptions(CLI::App& command, FloorplanOptions& plan) {
  CLI::Option* const pieces =
      command
          .add_option("--pieces",
                      plan.pieces.folder,
                      "Furnish with the OBJ files of this folder, each written "
                      "once beside OUT and placed by lines")
          ->type_name("DIR")
          ->excludes("--furniture");
  command
      .add_option("--pieces-per-room",
                  plan.pieces_per_room,
                  "Pieces in a room, at most")
      ->needs(pieces)
      ->capture_default_str();
  command
      .add_option("--piece-unit",
                  plan.pieces.metres_per_unit,
                  "Metres per unit of the pieces; without it 0.01 if one is "
                  "longer than 10 units, otherwise 1")
      ->needs(pieces)
      ->check(AboveZero())
      ->type_name("METRES");
  command
      .add_flag("--piece-z-up",
                plan.pieces.z_is_up,
                "The pieces have Z up, their rear at -Y (otherwise Y up, rear "
                "at -Z)")
      ->needs(pieces);
  plan.note = [](const std::string& note) { fmt::print("note: {}\n", note); };
}

void AddFloorplanScene(CLI::App& scenes) {
  CLI::App* command = nullptr;
  const auto plan = AddScene(scenes,
                             command,
                             "floorplan",
                             "Storeys of offices, halls, corridors and stairs",
                             &WriteFloorplan);
  command
      ->add_option("--rooms",
                   plan->rooms,
                   "Offices and halls in all; corridors and stairs come on top")
      ->capture_default_str();
  const CLI::Option* storeys =
      command->add_option("--storeys",
                          plan->storeys,
                          "Number of storeys; one for every 1,000 rooms if not "
                          "given");
  command->parse_complete_callback([plan, storeys] {
    if (storeys->empty()) {
      plan->storeys = UsualStoreys(plan->rooms);
    }
  });
  command
      ->add_option("--furniture",
                   plan->furniture,
                   "How densely rooms are furnished, 0 (empty) to 1 (full)")
      ->capture_default_str();
  AddSeed(*command, plan->seed);
  AddPieceOptions(*command, *plan);
  AddExample(*command,
             "--rooms 60 --storeys 2 --furniture 0.5 office.obj\n"
             "  enfilade scene floorplan --rooms 60 --pieces furniture/ "
             "office.obj");
}

}  // namespace

void AddSceneCommand(CLI::App& app) {
  CLI::App* scenes =
      app.add_subcommand("scene", "Write one of the generated test scenes");
  scenes->require_subcommand(1);
  scenes->footer(
      "Writes OUT.obj and OUT.mtl in metres, Z up.\nExample:\n"
      "  enfilade scene floorplan --rooms 60 office.obj");
  AddChairScenes(*scenes);
  AddTwoPatchScenes(*scenes);
  AddReflectanceScenes(*scenes);
  AddBulbsScene(*scenes);
  AddDownlightsScene(*scenes);
  AddFloorplanScene(*scenes);
}

}  // namespace enfilade
