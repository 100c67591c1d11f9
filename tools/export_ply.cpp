#include "base/error.h"

#include <array>
#include <limits>
#include <string>

#include "tools/export_elements.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr uint64_t kVertexBytes = 39;  // 3 floats, 3 bytes, 6 floats

std::string PlyHeader(const ElementCensus& census) {
  return fmt::format(
      "ply\n"
      "format binary_little_endian 1.0\n"
      "comment written by Enfilade\n"
      "comment radiosity and irradiance are linear, per channel\n"
      "element vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float radiosity_r\nproperty float radiosity_g\n"
      "property float radiosity_b\n"
      "property float irradiance_r\nproperty float irradiance_g\n"
      "property float irradiance_b\n"
      "element face {}\n"
      "property list uchar int vertex_indices\n"
      "end_header\n",
      census.Vertices(),
      census.leaves);
}

void PutVertex(SectionWriter& out,
               const LeafElement& leaf,
               size_t corner,
               const ToneMap& tone) {
  const Point3 p = leaf.corners[corner];
  for (size_t i = 0; i < 3; ++i) {
    out.Put(static_cast<float>(p[i]));
  }
  out.Put(tone.Encoded(leaf.radiosity[corner]));
  for (const Rgb* values :
       {&leaf.radiosity[corner], &leaf.irradiance[corner]}) {
    for (const double value : *values) {
      out.Put(static_cast<float>(value));
    }
  }
}

}  // namespace

uint64_t WritePly(const ElementSource& source,
                  const ElementCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out) {
  if (census.Vertices() > std::numeric_limits<int32_t>::max()) {
    throw UsageError(
        "the solution has more vertices than a PLY file can "
        "number; export it as .vtu");
  }
  OutputFile file(out);
  const ToneMap tone(census.meter.Key(), options.exposure_stops);
  const std::string header = PlyHeader(census);
  SectionWriter vertices(file, 0);
  vertices.PutText(header);
  SectionWriter faces(file, header.size() + kVertexBytes * census.Vertices());
  int32_t next = 0;
  ForEachElement(
      source, options.progress, [&](CellId, const LeafElement& leaf) {
        const auto corners = static_cast<uint8_t>(leaf.corners.size());
        faces.Put(corners);
        for (size_t i = 0; i < corners; ++i) {
          PutVertex(vertices, leaf, i, tone);
          faces.Put(next++);
        }
      });
  vertices.Flush();
  faces.Flush();
  file.Finish();
  return file.Size();
}

}  // namespace enfilade
