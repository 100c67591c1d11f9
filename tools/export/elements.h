// A solution as a mesh: PLY, glTF and VTU, streamed in two passes.

#pragma once

#include "base/memory.h"
#include "base/vec.h"
#include "solver/solution/display_mesh.h"
#include "solver/solution/solution.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "tools/export/file.h"
#include "tools/export/render_tone.h"

namespace enfilade {

// The leaves of a solution, cell by cell, in the same order at every pass.
struct ElementSource {
  size_t cells = 0;
  std::function<void(CellId, const std::function<void(const LeafElement&)>&)>
      for_each_leaf;
};

struct MeshVertex {
  Point3 position;
  Rgb radiosity{};     // W/m2
  Rgb irradiance{};    // W/m2
  double area_m2 = 0;  // its share of the faces around it
};

struct MeshFace {
  CellId cell;
  PatchId patch;
  uint8_t count = 0;                   // 3 or 4 vertices
  std::array<uint64_t, 4> vertices{};  // counter-clockwise from the front

  [[nodiscard]] std::span<const uint64_t> Vertices() const {
    return std::span(vertices).first(count);
  }
};

// Receives a mesh. Vertices are numbered from 0 in the order of arrival, and
// arrive before the faces that use them.
struct MeshSink {
  std::function<void(const MeshVertex&)> vertex;
  std::function<void(const MeshFace&)> face;
};

// A mesh, cell by cell, in the same order at every pass. Each cell's vertices
// are numbered from 0.
struct MeshSource {
  size_t cells = 0;
  std::function<void(CellId, const MeshSink&)> for_each;
};

// The leaves as they are: vertices are not shared between elements, so that
// steps between them stay visible. `source` is copied.
MeshSource LeavesOf(const ElementSource& source);

// The display meshes (solver/solution/display_mesh.h) of a solution, which must
// outlive the source.
MeshSource DisplayMeshOf(const Solution& solution,
                         const DisplayOptions& options);

// What the first pass finds.
struct MeshCensus {
  uint64_t faces = 0;
  uint64_t quads = 0;
  uint64_t triangles = 0;
  uint64_t vertices = 0;
  Box3 bounds;
  ExposureMeter meter;
};

using ExportProgress = std::function<void(double fraction)>;

// `progress` gets the fraction of the pass; may be empty.
MeshCensus TakeCensus(const MeshSource& source, const ExportProgress& progress);

struct MeshOptions {
  double exposure_stops = 0;
  bool z_up = true;  // glTF is Y up, so such a mesh is turned
  ExportProgress progress;
};

// The .bin file that holds the numbers of a .gltf.
std::filesystem::path BinaryBeside(const std::filesystem::path& gltf);

// Each function writes one file (WriteGltf also its .bin) and returns the bytes
// written. All throw DiskError, and UsageError if the mesh exceeds the limits
// of the format.
uint64_t WritePly(const MeshSource& source,
                  const MeshCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out);
uint64_t WriteGlb(const MeshSource& source,
                  const MeshCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out);
uint64_t WriteGltf(const MeshSource& source,
                   const MeshCensus& census,
                   const MeshOptions& options,
                   const std::filesystem::path& out);
uint64_t WriteVtu(const MeshSource& source,
                  const MeshCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out);

// Passes the mesh of all cells to `sink`, with vertices numbered consecutively
// over all cells.
void ForEachFace(const MeshSource& source,
                 const ExportProgress& progress,
                 const MeshSink& sink);

}  // namespace enfilade
