// Takes the polygons that readers read, cleans them in batches of one material
// and object, and writes them to the store.

#pragma once

#include "base/memory.h"
#include "scene/mesh_cleaner.h"
#include "scene/scene_store.h"

#include <optional>
#include <span>

namespace enfilade {

// Not thread-safe. The writer must outlive the sink.
class PolygonSink {
 public:
  PolygonSink(MemoryBudget& budget, SceneWriter& writer)
      : cleaner_(budget), writer_(&writer) {}

  // Sets the material and the object of the next polygons. `material` is not
  // kept.
  void Begin(MaterialId id, const Material& material, ObjectId object);

  // Adds a polygon with the material and the object of the last Begin.
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
