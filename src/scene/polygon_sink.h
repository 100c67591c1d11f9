// Who takes the polygons that readers read: PolygonSink cleans them in batches
// of one material and object, and writes them to the store.

#pragma once

#include "base/memory.h"
#include "scene/mesh_cleaner.h"
#include "scene/scene_store.h"

#include <optional>
#include <span>

namespace enfilade {

class PolygonReceiver {
 public:
  PolygonReceiver() = default;
  PolygonReceiver(const PolygonReceiver&) = delete;
  PolygonReceiver& operator=(const PolygonReceiver&) = delete;
  PolygonReceiver(PolygonReceiver&&) = delete;
  PolygonReceiver& operator=(PolygonReceiver&&) = delete;
  virtual ~PolygonReceiver() = default;

  // Sets the material and the object of the next polygons. `material` is not
  // kept.
  virtual void Begin(MaterialId id,
                     const Material& material,
                     ObjectId object) = 0;

  // Adds a polygon with the material and the object of the last Begin.
  virtual void Add(std::span<const Point3> polygon) = 0;

  // There is nothing more to come.
  virtual void Flush() = 0;
};

// Not thread-safe. The writer must outlive the sink.
class PolygonSink : public PolygonReceiver {
 public:
  PolygonSink(MemoryBudget& budget, SceneWriter& writer)
      : cleaner_(budget), writer_(&writer) {}

  void Begin(MaterialId id, const Material& material, ObjectId object) override;

  void Add(std::span<const Point3> polygon) override;

  // Cleans and writes what is pending.
  void Flush() override;

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
