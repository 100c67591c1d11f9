#include "scene/polygon_sink.h"

namespace enfilade {

void PolygonSink::Begin(MaterialId id,
                        const Material& material,
                        ObjectId object) {
  if (id != face_.material || object != face_.object) {
    Flush();
  }
  face_.material = id;
  face_.object = object;
  oriented_ = Emits(material) || material.sides == 1;
}

void PolygonSink::Add(std::span<const Point3> polygon) {
  if (!cleaner_.HasRoomFor(polygon.size())) {
    Flush();
  }
  cleaner_.Add(polygon);
}

void PolygonSink::Flush() {
  CleaningOptions options;
  options.oriented = oriented_;
  options.emit = [this](std::span<const Point3> polygon,
                        const std::optional<ClosedSolid>& solid) {
    face_.solid = solid;
    face_.vertices.assign(polygon.begin(), polygon.end());
    writer_->Add(face_);
  };
  cleaner_.Flush(options);
}

}  // namespace enfilade
