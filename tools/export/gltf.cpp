// glTF 2.0, as one .glb or as .gltf with its .bin.

#include "base/error.h"

#include <limits>
#include <string>
#include <string_view>

#include "tools/export/elements.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using SortedJson = nlohmann::json;

constexpr uint64_t kGltfVertexBytes = 6ULL * 4;  // position, colour
constexpr uint64_t kMostGlbBytes = std::numeric_limits<uint32_t>::max();

// Numbers of the specification.
constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr uint32_t kGlbMagic = 0x46546C67;
constexpr uint32_t kGlbVersion = 2;
constexpr uint32_t kJsonChunk = 0x4E4F534A;
constexpr uint32_t kBinaryChunk = 0x004E4942;
constexpr uint64_t kGlbHeaderBytes = 12;
constexpr uint64_t kChunkHeaderBytes = 8;

uint64_t Indices(const MeshCensus& census) {
  return 6 * census.quads + 3 * census.triangles;
}

uint64_t BinaryBytes(const MeshCensus& census) {
  return kGltfVertexBytes * census.vertices + 4 * Indices(census);
}

SortedJson Accessor(int view, uint64_t offset, int type, uint64_t count) {
  return {{"bufferView", view},
          {"byteOffset", offset},
          {"componentType", type},
          {"count", count},
          {"type", type == kUnsignedInt ? "SCALAR" : "VEC3"}};
}

// A file's name as a relative URI (RFC 3986): bytes beyond letters, digits and
// a few signs are percent-encoded.
std::string UriOf(const std::string& file_name) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
  std::string uri;
  for (const char c : file_name) {
    if (kPlain.find(c) != std::string_view::npos) {
      uri += c;
    } else {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return uri;
}

// Vertices are written relative to this point, which the node moves back:
// single precision is too coarse for a building far from the origin.
Point3 OriginOf(const MeshCensus& census) {
  return census.bounds.Center();
}

// The matrix of the node, by columns. glTF is y up.
SortedJson MatrixOf(Point3 origin, bool z_up) {
  if (z_up) {
    return {
        1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, origin.x, origin.z, -origin.y, 1};
  }
  return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, origin.x, origin.y, origin.z, 1};
}

SortedJson Describe(const MeshCensus& census,
                    bool z_up,
                    const std::string& binary_file) {
  const Point3 origin = OriginOf(census);
  const auto corner = [&](Point3 p) {
    const Vec3 from_origin = p - origin;
    return SortedJson::array({static_cast<float>(from_origin.x),
                              static_cast<float>(from_origin.y),
                              static_cast<float>(from_origin.z)});
  };
  SortedJson positions = Accessor(0, 0, kFloat, census.vertices);
  positions["min"] = corner(census.bounds.low);
  positions["max"] = corner(census.bounds.high);
  SortedJson buffer = {{"byteLength", BinaryBytes(census)}};
  if (!binary_file.empty()) {
    buffer["uri"] = UriOf(binary_file);
  }
  SortedJson node = {
      {"mesh", 0}, {"name", "solution"}, {"matrix", MatrixOf(origin, z_up)}};
  const uint64_t vertex_bytes = kGltfVertexBytes * census.vertices;
  SortedJson vertices = {{"buffer", 0},
                         {"byteOffset", 0},
                         {"byteLength", vertex_bytes},
                         {"byteStride", kGltfVertexBytes},
                         {"target", kArrayBuffer}};
  SortedJson indices = {{"buffer", 0},
                        {"byteOffset", vertex_bytes},
                        {"byteLength", 4 * Indices(census)},
                        {"target", kElementArrayBuffer}};
  SortedJson material = {
      {"name", "radiosity"},
      {"pbrMetallicRoughness", {{"metallicFactor", 0}}},
      {"extensions", {{"KHR_materials_unlit", SortedJson::object()}}}};
  SortedJson primitive = {{"attributes", {{"POSITION", 0}, {"COLOR_0", 1}}},
                          {"indices", 2},
                          {"material", 0},
                          {"mode", 4}};
  SortedJson scene = {{"nodes", SortedJson::array({0})}};
  SortedJson mesh = {{"primitives", SortedJson::array({primitive})}};
  return {{"asset", {{"version", "2.0"}, {"generator", "Enfilade"}}},
          {"extensionsUsed", SortedJson::array({"KHR_materials_unlit"})},
          {"scene", 0},
          {"scenes", SortedJson::array({scene})},
          {"nodes", SortedJson::array({node})},
          {"meshes", SortedJson::array({mesh})},
          {"materials", SortedJson::array({material})},
          {"buffers", SortedJson::array({buffer})},
          {"bufferViews", SortedJson::array({vertices, indices})},
          {"accessors",
           SortedJson::array({positions,
                              Accessor(0, 12, kFloat, census.vertices),
                              Accessor(1, 0, kUnsignedInt, Indices(census))})}};
}

void WriteBinary(const MeshSource& source,
                 const MeshCensus& census,
                 const MeshOptions& options,
                 OutputFile& file,
                 uint64_t offset) {
  const ToneMap tone(census.meter.Key(), options.exposure_stops);
  SectionWriter vertices(file, offset);
  SectionWriter indices(file, offset + kGltfVertexBytes * census.vertices);
  const Point3 origin = OriginOf(census);
  MeshSink sink;
  sink.vertex = [&](const MeshVertex& vertex) {
    const Vec3 from_origin = vertex.position - origin;
    for (size_t k = 0; k < 3; ++k) {
      vertices.Put(static_cast<float>(from_origin[k]));
    }
    for (const double value : tone.Linear(vertex.radiosity)) {
      vertices.Put(static_cast<float>(value));
    }
  };
  sink.face = [&](const MeshFace& face) {
    const std::span<const uint64_t> corners = face.Vertices();
    for (size_t i = 2; i < corners.size(); ++i) {
      for (const size_t k : {size_t{0}, i - 1, i}) {
        indices.Put(static_cast<uint32_t>(corners[k]));
      }
    }
  };
  ForEachFace(source, options.progress, sink);
  vertices.Flush();
  indices.Flush();
}

void RequireFits(const MeshCensus& census) {
  constexpr uint64_t kHeadroom = 64 << 10;
  if (census.faces == 0) {
    throw UsageError("the solution has no elements to export");
  }
  if (BinaryBytes(census) + kHeadroom > kMostGlbBytes) {
    throw UsageError(fmt::format(
        "the solution takes {} MiB as glTF, which can hold 4 GiB; export it as "
        ".ply or .vtu",
        BinaryBytes(census) >> 20));
  }
}

}  // namespace

uint64_t WriteGlb(const MeshSource& source,
                  const MeshCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out) {
  RequireFits(census);
  OutputFile file(out);
  std::string json = Describe(census, options.z_up, "").dump();
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const uint64_t binary = BinaryBytes(census);
  const uint64_t all =
      kGlbHeaderBytes + 2 * kChunkHeaderBytes + json.size() + binary;
  SectionWriter header(file, 0);
  header.Put(kGlbMagic);
  header.Put(kGlbVersion);
  header.Put(static_cast<uint32_t>(all));
  header.Put(static_cast<uint32_t>(json.size()));
  header.Put(kJsonChunk);
  header.PutText(json);
  header.Put(static_cast<uint32_t>(binary));
  header.Put(kBinaryChunk);
  header.Flush();
  WriteBinary(source, census, options, file, header.Position());
  file.Finish();
  return file.Size();
}

std::filesystem::path BinaryBeside(const std::filesystem::path& gltf) {
  return std::filesystem::path(gltf).replace_extension(".bin");
}

uint64_t WriteGltf(const MeshSource& source,
                   const MeshCensus& census,
                   const MeshOptions& options,
                   const std::filesystem::path& out) {
  RequireFits(census);
  const std::filesystem::path binary_path = BinaryBeside(out);
  OutputFile binary(binary_path);
  OutputFile file(out);
  SectionWriter text(file, 0);
  text.PutText(
      Describe(census, options.z_up, binary_path.filename().string()).dump(1));
  text.Flush();
  WriteBinary(source, census, options, binary, 0);
  // The disk may be full: neither gets its name before both are complete.
  binary.Close();
  file.Close();
  binary.Finish();
  file.Finish();
  return file.Size() + binary.Size();
}

}  // namespace enfilade
