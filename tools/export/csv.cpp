#include "tools/export/csv.h"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace enfilade {
namespace {

// The sum over leaves of area times irradiance.
struct PatchSum {
  double area = 0;
  Rgb irradiance{};

  void Add(const LeafMean& leaf) {
    area += leaf.area;
    for (size_t c = 0; c < kRgbChannels; ++c) {
      irradiance[c] += leaf.area * leaf.irradiance[c];
    }
  }

  // Of higher orders a mean that should be 0 may fall a little below.
  [[nodiscard]] Rgb Mean() const {
    Rgb mean{};
    for (size_t c = 0; c < kRgbChannels; ++c) {
      mean[c] = area > 0 ? std::max(0.0, irradiance[c] / area) : 0.0;
    }
    return mean;
  }
};

// What each patch of a cell receives.
std::vector<PatchSum> SumsOf(const BuildingView& building,
                             CellId cell,
                             size_t patches) {
  const auto ids = FirstIds<PatchId>(patches);
  std::vector<PatchSum> sums(patches);
  building.for_each_mean(cell, ids, [&](const LeafMean& leaf) {
    sums.at(leaf.patch.Index()).Add(leaf);
  });
  return sums;
}

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) {
    return text;
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c == '"' ? "\"\"" : std::string(1, c);
  }
  return quoted + '"';
}

// The shortest digits that read back as the same number: nine are millimetres
// off in map coordinates.
std::string CornerColumns(const Patch& patch) {
  const CornerList<Point3> corners = CornersOf(patch);
  std::string text;
  for (const Point3 p : corners.View()) {
    text += fmt::format("{},{},{},", p.x, p.y, p.z);
  }
  return text + (corners.count == 3 ? ",,," : "");
}

std::string Columns(const Rgb& rgb) {
  return fmt::format("{:.9g},{:.9g},{:.9g}", rgb[0], rgb[1], rgb[2]);
}

}  // namespace

uint64_t WriteCsv(const BuildingView& building,
                  const ExportProgress& progress,
                  MemoryBudget& budget,
                  const std::filesystem::path& out,
                  uint64_t* bytes) {
  OutputFile file(out);
  SectionWriter text(file, 0);
  text.PutText(
      "cell,patch,material,emits,area_m2,x0,y0,z0,x1,y1,z1,x2,y2,z2,x3,y3,z3,"
      "radiosity_r,radiosity_g,radiosity_b,"
      "irradiance_r,irradiance_g,irradiance_b\n");
  uint64_t patches = 0;
  const size_t cells = building.partition->cells.size();
  for (size_t c = 0; c < cells; ++c) {
    const uint64_t count = building.partition->cells.at(c).patches;
    const MemoryCharge charge(
        budget,
        count * (sizeof(PatchSum) + sizeof(PatchId) + sizeof(Patch)),
        "the patches of a cell");
    const std::vector<PatchSum> sums = SumsOf(building, CellId(c), count);
    const CellPatches cell = building.load_cell(CellId(c));
    for (size_t p = 0; p < cell.patches.size(); ++p) {
      const Patch& patch = cell.patches[p];
      const Material& material =
          building.scene->materials.at(patch.material.Index());
      const Rgb irradiance = sums[p].Mean();
      text.PutText(
          fmt::format("{},{},{},{},{:.9g},{}{},{}\n",
                      c,
                      p,
                      Quoted(material.name),
                      patch.emits ? 1 : 0,
                      PatchArea(patch),
                      CornerColumns(patch),
                      Columns(RadiosityOf(patch, material, irradiance)),
                      Columns(irradiance)));
    }
    patches += count;
    if (progress) {
      progress(static_cast<double>(c + 1) / static_cast<double>(cells));
    }
  }
  text.Flush();
  file.Finish();
  *bytes = file.Size();
  return patches;
}

}  // namespace enfilade
