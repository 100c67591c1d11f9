#include "tools/report.h"

#include "partition/partition.h"
#include "partition/partition_store.h"
#include "scene/scene_store.h"
#include "solver/solution/solution.h"
#include "solver/solve.h"
#include "visibility/visible_set.h"

#include <cmath>
#include <ostream>

#include "tools/pending_file.h"
#include "tools/progress.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

// The report gets a note if the rays leave open an error of more than this many
// times the requested one.
constexpr double kUnsureFrom = 1.5;

double PerSecond(uint64_t count, double seconds) {
  return seconds > 0 ? static_cast<double>(count) / seconds : 0;
}

Json Digest(const BlockStorage& store,
            MemoryBudget& budget,
            Progress& progress) {
  if (store.Count(BlockKind::kCellTree) == 0) {
    return nullptr;
  }
  const MemoryCharge scene_charge(
      budget, BytesOf(LoadSceneInfo(store)), kScenePurpose);
  progress.Begin("digest");
  std::string digest = Solution(store, budget).Digest([&](double fraction) {
    progress.Update(fraction);
  });
  progress.End();
  return digest;
}

// The counts of a gbXML file; null for any other.
Json GbxmlReport(const SceneInfo& scene) {
  if (!scene.gbxml) {
    return nullptr;
  }
  return {{"spaces", scene.gbxml->spaces},
          {"surfaces", scene.gbxml->surfaces},
          {"interior_doors", scene.gbxml->interior_doors},
          {"open_boundaries", scene.gbxml->open_boundaries},
          {"closed_shells", scene.gbxml->closed_shells},
          {"closed_spaces", scene.gbxml->closed_spaces}};
}

void AddSceneKeys(const BlockStorage& store, Stage stage, Json& report) {
  const bool imported = stage >= Stage::kImported;
  const SceneInfo scene = imported ? LoadSceneInfo(store) : SceneInfo{};
  const bool partitioned = stage >= Stage::kPartitioned;
  uint64_t portals = 0;
  const Partition partition =
      partitioned ? LoadWithoutPortals(store, &portals) : Partition{};
  const uint64_t patches = PatchCount(partition.cells);
  report["scene"] = scene.source_path;
  report["polygons"] = scene.input_polygons;
  report["faces"] = scene.faces;
  report["spaces"] = scene.spaces.size();
  report["cells"] = partition.cells.size();
  report["portals"] = portals;
  report["visible_pairs"] =
      stage >= Stage::kVisible ? LoadVisibilitySummary(store).visible_pairs : 0;
  report["patches"] = patches;
  report["gbxml"] = GbxmlReport(scene);
  report["notes"] = scene.notes;
  for (const std::string& note : partition.notes) {
    report["notes"].push_back(note);
  }
}

void AddSolveKeys(const SolveSummary& summary,
                  const SolveSettings& settings,
                  Json& report) {
  report["elements"] = summary.elements;
  report["links"] = summary.links;
  report["links_per_second"] = PerSecond(summary.links, summary.refine_seconds);
  report["rays"] = summary.rays;
  report["rays_per_second"] = PerSecond(summary.rays, summary.refine_seconds);
  report["sweeps"] = summary.sweeps;
  report["residual"] = summary.residual;
  const auto requested = RequestedError(settings);
  report["requested_error"] = requested ? Json(*requested) : Json();
  const bool knows_error = TraitsOf(settings.method.kind).knows_error;
  report["estimated_error"] =
      knows_error ? Json(summary.estimated_error) : Json();
  report["converged"] = summary.converged;
  report["exhausted"] = summary.exhausted;
}

void AddCostKeys(const BlockStorage& store,
                 const SolveSummary& summary,
                 const RunRecord& record,
                 Json& report) {
  report["wall_seconds"] = record.wall_seconds;
  report["stage_seconds"] = {{"import", record.import_seconds},
                             {"partition", record.partition_seconds},
                             {"visibility", record.visibility_seconds},
                             {"refine", summary.refine_seconds},
                             {"gather", summary.gather_seconds},
                             {"push_pull", summary.push_pull_seconds},
                             {"store", summary.store_seconds},
                             {"check", summary.check_seconds}};
  report["peak_rss_bytes"] = record.peak_rss_bytes;
  report["memory_cap_bytes"] = record.memory_cap_bytes;
  report["store_bytes"] = store.FileBytes();
  report["link_bytes_per_link"] = summary.link_bytes_per_link;
  report["bytes_read"] = record.bytes_read;
  report["bytes_written"] = record.bytes_written;
  report["bytes_read_solve"] = summary.bytes_read;
  report["bytes_belady"] = summary.bytes_belady;
  report["bytes_compulsory"] = summary.bytes_compulsory;
  report["threads"] = record.threads;
}

// The estimated error is that of the last finished round. While another round
// is under way, the error of the stored light may be far from it.
std::string ErrorText(const Json& report) {
  if (report.at("estimated_error").is_null()) {
    return "not known to this method; measure it with 'enfilade verify'";
  }
  const double estimated = report.at("estimated_error").get<double>();
  const bool is_under_way = !report.at("converged").get<bool>() &&
                            !report.at("exhausted").get<bool>();
  std::string text = fmt::format("{:.4f} estimated", estimated);
  if (is_under_way) {
    text =
        estimated > 0
            ? fmt::format("{} after the last round, unknown in this one", text)
            : "unknown in the first round";
  }
  const Json& requested = report.at("requested_error");
  return requested.is_null()
             ? text
             : fmt::format(
                   "{}, {:.4f} requested", text, requested.get<double>());
}

}  // namespace

std::string ProgramVersion() {
  return ENFILADE_VERSION;
}

std::string DarknessNote(double lit_share, double error) {
  constexpr double kSmall = 1.0 / 300;
  if (lit_share >= kSmall) {
    return {};
  }
  // Light on a share s of the area only: the mean over all is s of the mean
  // there, and the root mean square of differences there is sqrt(s) over all.
  return fmt::format(
      "the light is as uneven as if all of it were on {:.1g} % of the "
      "surfaces: "
      "an error of {} of the mean over all is one of {:.1g} there, and costs "
      "as "
      "much; leave out what no light reaches, or ask for a larger error",
      100 * lit_share,
      error,
      error * std::sqrt(lit_share));
}

std::string NotSettledText(const SolveSummary& summary) {
  return fmt::format(
      "the method did not settle in {} passes: it still split links, or the "
      "light still changed",
      summary.sweeps);
}

Json SolveReport(const BlockStorage& store,
                 const SolveSettings& settings,
                 MemoryBudget& budget,
                 Progress& progress) {
  const RunRecord record = LoadRunRecord(store);
  const Stage stage = LoadStage(store);
  const SolveSummary summary = LoadSummaryOf(store, settings);
  Json report;
  report["stage"] = summary.converged ? "solved" : StageName(stage);
  AddSceneKeys(store, stage, report);
  AddSolveKeys(summary, settings, report);
  if (summary.most_error_by_rays > kUnsureFrom * settings.error) {
    report["notes"].push_back(fmt::format(
        "light is so uneven that the rays which check the error leave it open "
        "up to {:.2f}; to know more: enfilade verify --seconds 600",
        summary.most_error_by_rays));
  }
  // Only where there is no light can there be no error at all.
  if (summary.converged && summary.estimated_error <= 0 &&
      settings.method.kind == SolveMethod::kWavelet) {
    report["notes"].push_back(
        "no light falls on a surface that reflects; check which way the "
        "emitting faces look");
  }
  AddCostKeys(store, summary, record, report);
  report["runs"] = record.runs;
  report["seed"] = settings.seed;
  report["method"] = TraitsOf(settings.method.kind).name;
  report["basis"] = settings.basis;
  report["version"] = record.version;
  report["digest"] = Digest(store, budget, progress);
  return report;
}

void WriteReport(const std::filesystem::path& path, const Json& report) {
  // Names of a scene may be bytes that are no UTF-8.
  const std::string text =
      report.dump(2, ' ', false, Json::error_handler_t::replace);
  WriteFileInOneStep(path, [&](std::ostream& out) { out << text << '\n'; });
}

std::string FormatBytes(double bytes) {
  if (bytes < 1024.0 * 1024.0) {
    return fmt::format("{:.1f} KiB", bytes / 1024.0);
  }
  if (bytes < 1024.0 * 1024.0 * 1024.0) {
    return fmt::format("{:.1f} MiB", bytes / (1024.0 * 1024.0));
  }
  return fmt::format("{:.2f} GiB", bytes / (1024.0 * 1024.0 * 1024.0));
}

std::string SummaryText(const Json& report) {
  const auto number = [&](const char* key) {
    return report.at(key).get<double>();
  };
  const auto bytes = [&](const char* key) { return FormatBytes(number(key)); };
  const double cap = number("memory_cap_bytes");
  std::string text;
  text += fmt::format("scene     {}\n", report.at("scene").get<std::string>());
  text += fmt::format(
      "building  {} polygons, {} cells, {} portals, {} visible "
      "pairs\n",
      number("polygons"),
      number("cells"),
      number("portals"),
      number("visible_pairs"));
  if (number("elements") > 0) {  // else there is no solution yet
    text += fmt::format(
        "solution  {} patches, {} elements, {} links, {} sweeps, "
        "{}, basis {}\n",
        number("patches"),
        number("elements"),
        number("links"),
        number("sweeps"),
        report.at("method").get<std::string>(),
        report.at("basis").get<std::string>());
    text += "error     " + ErrorText(report) + "\n";
  }
  text += fmt::format("cost      {}, peak {} (cap {}), store {}\n",
                      FormatDuration(number("wall_seconds")),
                      bytes("peak_rss_bytes"),
                      cap > 0 ? FormatBytes(cap) : "none",
                      bytes("store_bytes"));
  return text;
}

std::string NotesText(const Json& report) {
  std::string text;
  if (const Json& gbxml = report.at("gbxml"); !gbxml.is_null()) {
    text += fmt::format(
        "gbXML     {} Spaces ({} closed shells), {} surfaces, {} interior "
        "doors, {} open boundaries\n",
        gbxml.at("spaces").get<uint32_t>(),
        gbxml.at("closed_shells").get<uint32_t>(),
        gbxml.at("surfaces").get<uint32_t>(),
        gbxml.at("interior_doors").get<uint32_t>(),
        gbxml.at("open_boundaries").get<uint32_t>());
  }
  for (const Json& note : report.at("notes")) {
    text += fmt::format("note      {}\n", note.get<std::string>());
  }
  return text;
}

}  // namespace enfilade
