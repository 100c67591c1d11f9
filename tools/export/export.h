// Export: a solution as a file that other programs read, by extension.
//
//   .ply        a mesh with vertex colours, radiosity and irradiance
//   .glb .gltf  a mesh for viewers: tone-mapped COLOR_0 alone, unlit (.gltf
//               embeds nothing: it writes its .bin beside itself)
//   .vtu        a mesh for ParaView: radiosity, irradiance, cell, patch
//   .csv        one line per patch: corners, mean radiosity and irradiance
//   .png        a picture, tone-mapped
//   .exr        the same picture, linear
//
// docs/export.md describes them for users.
//
// The mesh consists of the leaves or is one made for display
// (solver/solution/display_mesh.h). Pictures show either of the two.
//
// Exports are streamed, so memory does not grow with the solution. A file
// appears under its name only when it is complete.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "tools/export/camera.h"

namespace enfilade {

// What is shown of a solution.
enum class MeshKind {
  kLeaves,    // the elements that were solved for, as they are
  kAnchored,  // balanced, no T-vertices; each element keeps its values
  kSmooth,    // the same mesh, values averaged at vertices
};

struct ExportOptions {
  // If unset, leaves in .vtu and smooth in all other meshes and pictures.
  // Pictures allow leaves and smooth. For .csv, which has means over patches
  // only, it must be unset.
  std::optional<MeshKind> mesh;

  // Pictures only (.png, .exr).
  CameraOptions camera;
  uint32_t width = 1280;  // pixels
  uint32_t height = 720;
  uint32_t samples = 2;  // per pixel and direction: 2 means 2 x 2

  // Stops of brightness added to the automatic exposure (.png and colours).
  double exposure_stops = 0;

  // Called with the fraction done; may be empty; may throw to stop.
  std::function<void(double fraction)> progress;

  // Throws UsageError with what is wrong.
  void Validate() const;
};

// Throws UsageError if the name is that of no format.
void RequireFormat(const std::filesystem::path& out);

// Whether the name is that of a picture.
bool IsPicture(const std::filesystem::path& out);

// All files that an export writes.
std::vector<std::filesystem::path> OutputsOf(const std::filesystem::path& out);

struct ExportSummary {
  uint64_t elements = 0;  // faces or patches written; 0 for pictures
  uint64_t rays = 0;      // pictures only
  uint64_t bytes = 0;     // of the file(s)
  double seconds = 0;
};

// Throws UsageError for an unknown extension (the message lists those known),
// InputError if the store holds no solution, DiskError if writing fails; files
// that were there before are then left as they were. Only between the renaming
// of the two files of a .gltf can a failure leave an old one beside a new one.
ExportSummary Export(const BlockStorage& store,
                     const std::filesystem::path& out,
                     const ExportOptions& options,
                     MemoryBudget& budget);

}  // namespace enfilade
