// Leaf elements as meshes: PLY, glTF and VTU, streamed in two passes.

#pragma once

#include "base/memory.h"
#include "base/vec.h"
#include "solver/solution.h"

#include <cstdint>
#include <filesystem>
#include <functional>

#include "tools/export_file.h"
#include "tools/render_tone.h"

namespace enfilade {

// The leaves of a solution, cell by cell, in the same order at every pass.
struct ElementSource {
  size_t cells = 0;
  std::function<void(CellId, const std::function<void(const LeafElement&)>&)>
      for_each_leaf;
};

// What the first pass finds.
struct ElementCensus {
  uint64_t leaves = 0;
  uint64_t quads = 0;
  uint64_t triangles = 0;
  Box3 bounds;
  ExposureMeter meter;

  [[nodiscard]] uint64_t Vertices() const { return 4 * quads + 3 * triangles; }
};

using ExportProgress = std::function<void(double fraction)>;

// `progress` gets the fraction of the pass; may be empty.
ElementCensus TakeCensus(const ElementSource& source,
                         const ExportProgress& progress);

struct MeshOptions {
  double exposure_stops = 0;
  bool z_up = true;  // glTF is Y up and is turned
  ExportProgress progress;
};

// Each writes one file (glTF: and its .bin) and returns its bytes. Vertices are
// not shared between elements, so that steps between them stay visible. Throw
// DiskError, and UsageError where the format's own limits are passed.
uint64_t WritePly(const ElementSource& source,
                  const ElementCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out);
uint64_t WriteGlb(const ElementSource& source,
                  const ElementCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out);
uint64_t WriteGltf(const ElementSource& source,
                   const ElementCensus& census,
                   const MeshOptions& options,
                   const std::filesystem::path& out);
uint64_t WriteVtu(const ElementSource& source,
                  const ElementCensus& census,
                  const MeshOptions& options,
                  const std::filesystem::path& out);

// Visits all leaves of all cells.
void ForEachElement(
    const ElementSource& source,
    const ExportProgress& progress,
    const std::function<void(CellId, const LeafElement&)>& visit);

}  // namespace enfilade
