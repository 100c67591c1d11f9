// The verb `flatland`.

#include "base/error.h"
#include "base/memory.h"

#include <bit>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "tools/commands/command.h"
#include "tools/commands/options.h"
#include "tools/study/flatland_matrix.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

struct FlatlandCommand {
  FlatlandScene scene = FlatlandScene::kParallel;
  FlatlandBasis basis = FlatlandBasis::kHaar;
  FlatlandForm form = FlatlandForm::kNodal;
  size_t elements = 32;
  std::filesystem::path out;
  std::string report;  // empty: none

  void Run() const {
    if (out.extension() != ".svg") {
      throw UsageError(fmt::format(
          "'{}': the picture is an SVG; give a name that ends in .svg",
          out.string()));
    }
    if (!std::has_single_bit(elements) || elements < 4 || elements > 512) {
      throw UsageError(fmt::format(
          "--elements {}: give a power of two from 4 to 512", elements));
    }
    CheckReport(report, {out});
    constexpr double kLarge = 0.001;
    const SquareMatrix matrix =
        InWaveletBasis(FlatlandFormFactors(scene, elements), basis, form);
    WriteDots(matrix, out);
    fmt::print("wrote {}: {} of {} entries are above {} of the largest\n",
               out.string(),
               CountLarge(matrix, kLarge),
               matrix.values.size(),
               kLarge);
    if (!report.empty()) {
      WriteReport(report,
                  {{"entries", matrix.values.size()},
                   {"large_entries", CountLarge(matrix, kLarge)},
                   {"large_from", kLarge},
                   {"peak_rss_bytes", PeakResidentBytes()},
                   {"version", ProgramVersion()}});
    }
  }
};

// Adds an option that takes one of the names in `choices`.
template <typename T>
void AddChoice(CLI::App& command,
               const std::string& name,
               T& value,
               const std::map<std::string, T>& choices,
               const std::string& what) {
  command.add_option(name, value, what)
      ->transform(OneOf(choices))
      ->type_name("NAME");
}

}  // namespace

void AddFlatlandCommand(CLI::App& app) {
  auto options = std::make_shared<FlatlandCommand>();
  CLI::App* command = app.add_subcommand(
      "flatland", "Draw form factors of two segments in a wavelet basis");
  command->add_option("out", options->out, "The picture, .svg")
      ->type_name("OUT.svg")
      ->required();
  AddChoice<FlatlandScene>(*command,
                           "--scene",
                           options->scene,
                           {{"parallel", FlatlandScene::kParallel},
                            {"corner", FlatlandScene::kCorner}},
                           "parallel (default) or corner");
  AddChoice<FlatlandBasis>(
      *command,
      "--basis",
      options->basis,
      {{"haar", FlatlandBasis::kHaar}, {"f2", FlatlandBasis::kFlatlets}},
      "haar (default) or f2");
  AddChoice<FlatlandForm>(*command,
                          "--form",
                          options->form,
                          {{"nodal", FlatlandForm::kNodal},
                           {"standard", FlatlandForm::kStandard},
                           {"nonstandard", FlatlandForm::kNonstandard}},
                          "nodal (default: no wavelets), standard or "
                          "nonstandard");
  command->add_option("--elements", options->elements, "Elements of a segment")
      ->type_name("N")
      ->capture_default_str();
  AddReportOption(*command, options->report);
  SetExample(*command,
             "enfilade flatland --scene corner --form standard --basis f2 "
             "corner.svg");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
