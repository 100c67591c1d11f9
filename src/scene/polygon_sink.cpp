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
  options.emit = [this](const CleanFace& face) {
    face_.solid = face.solid;
    face_.surface_m2 = face.surface_m2;
    face_.vertices.assign(face.polygon.begin(), face.polygon.end());
    writer_->Add(face_);
  };
  cleaner_.Flush(options);
}

}  // namespace enfilade
