#include "base/error.h"

#include <array>
#include <limits>
#include <string>

#include "tools/export/elements.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr uint64_t kPlyVertexBytes = 51;  // 3 doubles, 3 bytes, 6 floats

std::string PlyHeader(const MeshCensus& census) {
  return fmt::format(
      "ply\n"
      "format binary_little_endian 1.0\n"
      "comment written by Enfilade\n"
      "comment radiosity and irradiance are linear, per channel\n"
      "element vertex {}\n"
      "property double x\nproperty double y\nproperty double z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float radiosity_r\nproperty float radiosity_g\n"
      "property float radiosity_b\n"
      "property float irradiance_r\nproperty float irradiance_g\n"
      "property float irradiance_b\n"
      "element face {}\n"
      "property list uchar int vertex_indices\n"
      "end_header\n",
      census.vertices,
      census.faces);
}

void PutVertex(SectionWriter& out,
               const MeshVertex& vertex,
               const ToneMap& tone) {
  for (size_t i = 0; i < 3; ++i) {
    out.Put(vertex.position[i]);
  }
  out.Put(tone.Encoded(vertex.radiosity));
  for (const Rgb* values : {&vertex.radiosity, &vertex.irradiance}) {
    for (const double value : *values) {
      out.Put(static_cast<float>(value));
    }
  }
}

}  // namespace

uint64_t WritePly(const MeshSource& source,
                  const MeshCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out) {
  if (census.vertices > std::numeric_limits<int32_t>::max()) {
    throw UsageError(
        "the solution has more vertices than a PLY file can "
        "number; export it as .vtu");
  }
  OutputFile file(out);
  const ToneMap tone(census.meter.Key(), options.exposure_stops);
  const std::string header = PlyHeader(census);
  SectionWriter vertices(file, 0);
  vertices.PutText(header);
  SectionWriter faces(file, header.size() + kPlyVertexBytes * census.vertices);
  MeshSink sink;
  sink.vertex = [&](const MeshVertex& vertex) {
    PutVertex(vertices, vertex, tone);
  };
  sink.face = [&](const MeshFace& face) {
    faces.Put(face.count);
    for (const uint64_t vertex : face.Vertices()) {
      faces.Put(static_cast<int32_t>(vertex));
    }
  };
  ForEachFace(source, options.progress, sink);
  vertices.Flush();
  faces.Flush();
  file.Finish();
  return file.Size();
}

}  // namespace enfilade
