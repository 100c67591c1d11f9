// VTK XML unstructured grid with raw appended data, for ParaView.

#include <string>
#include <vector>

#include "tools/export/elements.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr uint8_t kVtkTriangle = 5;
constexpr uint8_t kVtkQuad = 9;

// One appended array: its length in bytes as UInt64, then the values.
struct Array {
  std::string element;  // XML up to the offset
  uint64_t bytes = 0;
};

// In the order of the sections in the file.
enum VtuSection : size_t {
  kPoints,
  kConnectivity,
  kOffsets,
  kTypes,
  kRadiosity,
  kIrradiance,
  kCell,
  kPatch,
  kSections
};

std::vector<Array> Arrays(const MeshCensus& census) {
  const uint64_t v = census.vertices;
  const uint64_t n = census.faces;
  const uint64_t corners = 4 * census.quads + 3 * census.triangles;
  const auto array = [](const char* type, const char* name, int components) {
    return fmt::format(
        R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" )"
        R"(format="appended" )",
        type,
        name,
        components);
  };
  return {{array("Float64", "Points", 3), 24 * v},
          {array("Int64", "connectivity", 1), 8 * corners},
          {array("Int64", "offsets", 1), 8 * n},
          {array("UInt8", "types", 1), n},
          {array("Float32", "radiosity", 3), 12 * v},
          {array("Float32", "irradiance", 3), 12 * v},
          {array("UInt32", "cell", 1), 4 * n},
          {array("UInt32", "patch", 1), 4 * n}};
}

std::string Xml(const MeshCensus& census, const std::vector<Array>& arrays) {
  std::vector<std::string> elements;
  uint64_t offset = 0;
  for (const Array& array : arrays) {
    elements.push_back(
        fmt::format("{}offset=\"{}\"/>\n", array.element, offset));
    offset += sizeof(uint64_t) + array.bytes;
  }
  return fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
      "<UnstructuredGrid>\n"
      "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n"
      "<Points>\n{}</Points>\n"
      "<Cells>\n{}{}{}</Cells>\n"
      "<PointData Vectors=\"radiosity\">\n{}{}</PointData>\n"
      "<CellData>\n{}{}</CellData>\n"
      "</Piece>\n</UnstructuredGrid>\n"
      "<AppendedData encoding=\"raw\">\n_",
      census.vertices,
      census.faces,
      elements[kPoints],
      elements[kConnectivity],
      elements[kOffsets],
      elements[kTypes],
      elements[kRadiosity],
      elements[kIrradiance],
      elements[kCell],
      elements[kPatch]);
}

// The sections of one file, open at the same time.
class Sections {
 public:
  Sections(OutputFile& file, const std::vector<Array>& arrays, uint64_t start) {
    for (const Array& array : arrays) {
      writers_.emplace_back(file, start);
      writers_.back().Put(array.bytes);
      start += sizeof(uint64_t) + array.bytes;
    }
    end_ = start;
  }

  void Add(const MeshVertex& vertex) {
    for (size_t k = 0; k < 3; ++k) {
      writers_[kPoints].Put(vertex.position[k]);
      writers_[kRadiosity].Put(static_cast<float>(vertex.radiosity[k]));
      writers_[kIrradiance].Put(static_cast<float>(vertex.irradiance[k]));
    }
  }

  void Add(const MeshFace& face) {
    for (const uint64_t vertex : face.Vertices()) {
      writers_[kConnectivity].Put(static_cast<int64_t>(vertex));
    }
    corners_ += face.count;
    writers_[kOffsets].Put(corners_);
    writers_[kTypes].Put(face.count == 4 ? kVtkQuad : kVtkTriangle);
    writers_[kCell].Put(face.cell.value);
    writers_[kPatch].Put(face.patch.value);
  }

  void Flush() {
    for (SectionWriter& writer : writers_) {
      writer.Flush();
    }
  }

  [[nodiscard]] uint64_t End() const { return end_; }

 private:
  std::vector<SectionWriter> writers_;
  int64_t corners_ = 0;
  uint64_t end_ = 0;
};

}  // namespace

uint64_t WriteVtu(const MeshSource& source,
                  const MeshCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out) {
  OutputFile file(out);
  const std::vector<Array> arrays = Arrays(census);
  SectionWriter head(file, 0);
  head.PutText(Xml(census, arrays));
  head.Flush();
  Sections sections(file, arrays, head.Position());
  MeshSink sink;
  sink.vertex = [&](const MeshVertex& vertex) { sections.Add(vertex); };
  sink.face = [&](const MeshFace& face) { sections.Add(face); };
  ForEachFace(source, options.progress, sink);
  sections.Flush();
  SectionWriter tail(file, sections.End());
  tail.PutText("\n</AppendedData>\n</VTKFile>\n");
  tail.Flush();
  file.Finish();
  return file.Size();
}

}  // namespace enfilade
