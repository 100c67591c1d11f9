#include "tools/export/csv.h"

#include <string>
#include <vector>

#include <fmt/format.h>

namespace enfilade {
namespace {

struct PatchMeans {
  double area = 0;
  Rgb radiosity{};
  Rgb irradiance{};
};

// Adds the area times the mean of the corners. That is the mean over the
// element, exactly so for linear and bilinear functions.
void AddLeaf(const LeafElement& leaf, PatchMeans& means) {
  const double area = Length(AreaVector(leaf.corners));
  const double weight = area / static_cast<double>(leaf.corners.size());
  means.area += area;
  for (size_t i = 0; i < leaf.corners.size(); ++i) {
    for (size_t c = 0; c < kRgbChannels; ++c) {
      means.radiosity[c] += weight * leaf.radiosity[i][c];
      means.irradiance[c] += weight * leaf.irradiance[i][c];
    }
  }
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

std::string CornerColumns(const Patch& patch) {
  const Point3 o = patch.origin;
  const bool triangle = patch.shape == PatchShape::kTriangle;
  std::vector<Point3> corners = {o, o + patch.u, o + patch.u + patch.v};
  if (triangle) {
    corners[2] = o + patch.v;
  } else {
    corners.push_back(o + patch.v);
  }
  std::string text;
  for (const Point3 p : corners) {
    text += fmt::format("{:.9g},{:.9g},{:.9g},", p.x, p.y, p.z);
  }
  return text + (triangle ? ",,," : "");
}

std::string Columns(const Rgb& sum, double area) {
  const double scale = area > 0 ? 1 / area : 0;
  return fmt::format(
      "{:.9g},{:.9g},{:.9g}", sum[0] * scale, sum[1] * scale, sum[2] * scale);
}

}  // namespace

uint64_t WriteCsv(const BuildingView& building,
                  const ElementSource& source,
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
  for (size_t c = 0; c < source.cells; ++c) {
    const uint64_t count = building.partition->cells.at(c).patches;
    const MemoryCharge charge(budget,
                              count * (sizeof(PatchMeans) + sizeof(Patch)),
                              "the patches of a cell");
    std::vector<PatchMeans> means(count);
    source.for_each_leaf(CellId(c), [&](const LeafElement& leaf) {
      AddLeaf(leaf, means.at(leaf.patch.Index()));
    });
    const CellPatches cell = building.load_cell(CellId(c));
    for (size_t p = 0; p < cell.patches.size(); ++p) {
      const Patch& patch = cell.patches[p];
      const Material& material =
          building.scene->materials.at(patch.material.Index());
      text.PutText(fmt::format("{},{},{},{},{:.9g},{}{},{}\n",
                               c,
                               p,
                               Quoted(material.name),
                               patch.emits ? 1 : 0,
                               PatchArea(patch),
                               CornerColumns(patch),
                               Columns(means[p].radiosity, means[p].area),
                               Columns(means[p].irradiance, means[p].area)));
    }
    patches += count;
    if (progress) {
      progress(static_cast<double>(c + 1) / static_cast<double>(source.cells));
    }
  }
  text.Flush();
  file.Finish();
  *bytes = file.Size();
  return patches;
}

}  // namespace enfilade
