#include "tools/export/export.h"

#include "base/error.h"
#include "base/lower_case.h"
#include "base/stopwatch.h"
#include "solver/solution/solution.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <string_view>

#include "tools/building_store.h"
#include "tools/export/camera_choice.h"
#include "tools/export/csv.h"
#include "tools/export/elements.h"
#include "tools/export/image.h"
#include "tools/export/render_picture.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

std::string Extension(const std::filesystem::path& out) {
  return LowerCase(out.extension().string());
}

// A progress function that reports the part of the whole from `begin` to `end`.
ExportProgress PartOf(const std::function<void(double)>& progress,
                      double begin,
                      double end) {
  if (!progress) {
    return {};
  }
  return [=](double fraction) { progress(begin + (end - begin) * fraction); };
}

void ExportMesh(StoredBuilding& building,
                const std::string& extension,
                const std::filesystem::path& out,
                const ExportOptions& options,
                ExportSummary& summary) {
  if (extension == ".csv") {
    summary.elements = WriteCsv(building.View(),
                                options.progress,
                                building.WorkBudget(),
                                out,
                                &summary.bytes);
    return;
  }
  const Solution& solution = building.OpenSolution();
  ElementSource source;
  source.cells = solution.CellCount();
  source.for_each_leaf =
      [&](CellId cell, const std::function<void(const LeafElement&)>& visit) {
        solution.ForEachLeaf(cell, visit);
      };
  const MeshKind kind = options.mesh.value_or(
      extension == ".vtu" ? MeshKind::kLeaves : MeshKind::kSmooth);
  const MeshSource faces =
      kind == MeshKind::kLeaves
          ? LeavesOf(source)
          : DisplayMeshOf(solution, {kind == MeshKind::kSmooth});
  const MeshCensus census = TakeCensus(faces, PartOf(options.progress, 0, 0.4));
  MeshOptions mesh;
  mesh.exposure_stops = options.exposure_stops;
  mesh.progress = PartOf(options.progress, 0.4, 1);
  mesh.z_up =
      ChooseUpAxis(*building.View().scene, options.camera.up) == UpAxis::kZ;
  const auto write = extension == ".ply"    ? WritePly
                     : extension == ".glb"  ? WriteGlb
                     : extension == ".gltf" ? WriteGltf
                                            : WriteVtu;
  summary.elements = census.faces;
  summary.bytes = write(faces, census, mesh, out);
}

void ExportPicture(StoredBuilding& building,
                   const std::string& extension,
                   const std::filesystem::path& out,
                   const ExportOptions& options,
                   ExportSummary& summary) {
  const double aspect = static_cast<double>(options.width) / options.height;
  const Camera camera = ChooseCamera(
      building.View(), options.camera, aspect, building.WorkBudget());
  RenderOptions render;
  render.width = options.width;
  render.height = options.height;
  render.samples = options.samples;
  render.smooth = options.mesh != MeshKind::kLeaves;
  render.progress = options.progress;
  const Picture picture =
      RenderPicture(building.View(), camera, render, building.WorkBudget());
  summary.rays = static_cast<uint64_t>(options.width) * options.height *
                 options.samples * options.samples;
  ImageOptions image;
  image.exposure_stops = options.exposure_stops;
  image.white_background = options.camera.view == CameraView::kPlan;
  summary.bytes = extension == ".png" ? WritePng(picture, image, out)
                                      : WriteExr(picture, out);
}

// Throws UsageError if the format does not have the mesh that was asked for.
void RequireFitting(const std::optional<MeshKind>& mesh,
                    const std::string& extension,
                    bool picture) {
  if (extension == ".csv" && mesh) {
    throw UsageError(
        ".csv holds means over patches and has no mesh; leave --mesh out");
  }
  if (picture && mesh == MeshKind::kAnchored) {
    throw UsageError(
        "a picture shows --mesh leaves or smooth: anchored values are those of "
        "the leaves");
  }
}

}  // namespace

void ExportOptions::Validate() const {
  camera.Validate();
  constexpr uint32_t kMostPixels = 32768;
  constexpr uint32_t kMostSamples = 16;
  if (width == 0 || height == 0 || width > kMostPixels ||
      height > kMostPixels) {
    throw UsageError(
        "--size: a picture has 1 to 32768 pixels in each direction");
  }
  constexpr double kMostStops = 64;
  if (!(std::abs(exposure_stops) <= kMostStops)) {
    throw UsageError("--exposure: give a number of stops from -64 to 64");
  }
  if (samples == 0 || samples > kMostSamples) {
    throw UsageError(
        "--samples: a pixel takes 1 to 16 samples in each direction");
  }
}

void RequireFormat(const std::filesystem::path& out) {
  constexpr std::array<std::string_view, 7> kFormats = {
      ".ply", ".glb", ".gltf", ".vtu", ".csv", ".png", ".exr"};
  const std::string extension = Extension(out);
  if (std::find(kFormats.begin(), kFormats.end(), extension) ==
      kFormats.end()) {
    throw UsageError(fmt::format(
        "'{}' ends in '{}', which no format has; use .ply, .glb, .gltf, .vtu, "
        ".csv, .png or .exr",
        out.string(),
        extension));
  }
}

bool IsPicture(const std::filesystem::path& out) {
  const std::string extension = Extension(out);
  return extension == ".png" || extension == ".exr";
}

std::vector<std::filesystem::path> OutputsOf(const std::filesystem::path& out) {
  if (Extension(out) == ".gltf") {
    return {out, BinaryBeside(out)};
  }
  return {out};
}

ExportSummary Export(const BlockStorage& store,
                     const std::filesystem::path& out,
                     const ExportOptions& options,
                     MemoryBudget& budget) {
  options.Validate();
  const std::string extension = Extension(out);
  const bool picture = IsPicture(out);
  RequireFormat(out);
  RequireFitting(options.mesh, extension, picture);
  const auto start = std::chrono::steady_clock::now();
  const bool streams = !picture && extension != ".csv";
  StoredBuilding building(
      store, budget, streams ? Sharing::kAlone : Sharing::kTurns);
  constexpr uint64_t kBufferBytes = 640 << 10;
  const MemoryCharge buffers(
      building.WorkBudget(), kBufferBytes, "the buffers of an export");
  ExportSummary summary;
  (picture ? ExportPicture : ExportMesh)(
      building, extension, out, options, summary);
  summary.seconds = SecondsSince(start);
  return summary;
}

}  // namespace enfilade
