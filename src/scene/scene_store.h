// The scene inside a store: faces in chunks (BlockKind::kFaces), everything
// else in one meta entry. Written once by import, streamed by later stages.

#pragma once

#include "base/block_storage.h"
#include "base/vec.h"
#include "scene/face.h"

#include <cstdint>
#include <string>
#include <vector>

namespace enfilade {

// All of a scene but its faces.
struct SceneInfo {
  std::string source_path;   // as given by the user
  uint64_t source_hash = 0;  // XXH3 of all input files' bytes and the options
  bool photometric = false;
  std::vector<Material> materials;  // indexed by MaterialId
  std::vector<Space> spaces;        // indexed by SpaceId; empty unless gbXML
  std::vector<Opening> openings;    // likewise
  Box3 bounds;
  uint64_t input_polygons = 0;     // as read, before cleaning
  uint64_t faces = 0;              // after cleaning
  std::vector<std::string> notes;  // what cleaning changed, in sentences
};

// Appends faces to a store in chunks of about 4,096; call Finish() once.
class SceneWriter {
 public:
  explicit SceneWriter(BlockStorage& store);

  // Checks the face's invariants.
  void Add(const Face& face);

  // Flushes the last chunk, completes info.bounds and info.faces, saves it.
  void Finish(SceneInfo info);

 private:
  void Flush();

  BlockStorage* store_;
  std::vector<Face> pending_;
  Box3 bounds_;
  uint64_t faces_ = 0;
  uint32_t chunks_ = 0;
};

SceneInfo LoadSceneInfo(const BlockStorage& store);

// Visits the faces in FaceId order, one chunk in memory at a time.
void ForEachFace(const BlockStorage& store,
                 const std::function<void(FaceId, const Face&)>& visit);

}  // namespace enfilade
