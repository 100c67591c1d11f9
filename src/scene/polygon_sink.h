// Where readers put the polygons they read: cleaned in batches of one material
// and object, and written to the store.

#pragma once

#include "base/memory.h"
#include "scene/mesh_cleaner.h"
#include "scene/scene_store.h"

#include <optional>
#include <span>

namespace enfilade {

// Not thread-safe. Borrows the writer, which outlives it.
class PolygonSink {
 public:
  PolygonSink(MemoryBudget& budget, SceneWriter& writer)
      : cleaner_(budget), writer_(&writer) {}

  // What the next polygons are. `material` stays with the caller.
  void Begin(MaterialId id, const Material& material, ObjectId object);

  // A polygon of the last Begin.
  void Add(std::span<const Point3> polygon);

  // Cleans and writes what is pending.
  void Flush();

  [[nodiscard]] const CleaningCounts& Counts() const {
    return cleaner_.Counts();
  }

 private:
  MeshCleaner cleaner_;
  SceneWriter* writer_;
  Face face_;  // material and object of the pending polygons
  bool oriented_ = false;
};

}  // namespace enfilade
