// The scene inside a store: faces in chunks (BlockKind::kFaces), everything
// else in one meta entry. Written once by import, streamed by later stages.

#pragma once

#include "base/block_storage.h"
#include "base/vec.h"
#include "scene/face.h"
#include "scene/level_areas.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace enfilade {

// What a gbXML file holds according to its own declarations.
struct GbxmlCounts {
  uint32_t spaces = 0;
  uint32_t surfaces = 0;         // of every type, shades included
  uint32_t interior_doors = 0;   // door Openings between two different Spaces
  uint32_t open_boundaries = 0;  // Air surfaces and Air Openings between two
                                 // different Spaces
  uint32_t closed_shells = 0;    // Spaces whose ShellGeometry closes: its area
                                 // vectors add up to zero
  uint32_t closed_spaces = 0;    // Spaces whose Surfaces leave no gap
};

// All of a scene but its faces.
struct SceneInfo {
  std::string source_path;   // as import got it: the program makes it absolute
  uint64_t source_hash = 0;  // HashSceneFiles
  bool lacks_files = false;  // SceneHash::is_whole was false
  bool photometric = false;
  std::vector<Material> materials;   // indexed by MaterialId
  std::vector<Space> spaces;         // indexed by SpaceId; empty unless gbXML
  std::vector<Opening> openings;     // likewise
  std::optional<GbxmlCounts> gbxml;  // for gbXML, spaces stripped or not
  Box3 bounds;
  bool y_is_up = false;            // z is, if not
  double greatest_move_m = 0;      // of a vertex, to close cracks or rounding
  double coordinate_step_m = 0;    // if oblique walls are rounded to it, else 0
  uint64_t input_polygons = 0;     // as read, before cleaning
  uint64_t faces = 0;              // after cleaning
  std::vector<std::string> notes;  // what cleaning changed, in sentences
};

// For charges of BytesOf a SceneInfo: what reads a solution holds one of its
// own.
inline constexpr const char* kScenePurpose = "the materials of the scene";
inline constexpr uint64_t kSceneCopies = 2;

// The bytes that a scene takes in memory, apart from its faces.
uint64_t BytesOf(const SceneInfo& info);

// Appends faces to a store in chunks of at most 4,096; call Finish() once.
class SceneWriter {
 public:
  explicit SceneWriter(BlockStorage& store);

  // Checks the face's invariants.
  void Add(const Face& face);

  // Writes what is pending, so that ForEachFace sees every face added so far.
  void Flush();

  // The bounds of all faces added so far.
  [[nodiscard]] const Box3& Bounds() const { return bounds_; }

  // Whether y is up, by the faces added so far. In gbXML z is, whatever the
  // faces.
  [[nodiscard]] bool IsYUp() const { return level_areas_.IsYUp(); }

  // Flushes the last chunk, completes info.bounds, info.y_is_up and info.faces,
  // saves it, and returns what was saved.
  SceneInfo Finish(SceneInfo info);

 private:
  BlockStorage* store_;
  std::vector<Face> pending_;
  Box3 bounds_;
  LevelAreas level_areas_;
  uint64_t faces_ = 0;
  uint32_t chunks_ = 0;
};

SceneInfo LoadSceneInfo(const BlockStorage& store);

// Visits the faces in FaceId order, one chunk in memory at a time.
void ForEachFace(const BlockStorage& store,
                 const std::function<void(FaceId, const Face&)>& visit);

}  // namespace enfilade
