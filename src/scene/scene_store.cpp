#include "scene/scene_store.h"

#include "base/bytes.h"
#include "base/check.h"
#include "base/error.h"
#include "base/memory.h"
#include "base/planar_polygon.h"
#include "base/stop.h"

#include <cmath>
#include <utility>

namespace enfilade {
namespace {

constexpr size_t kFacesPerChunk = 4096;
constexpr const char* kSceneMeta = "scene";
constexpr uint32_t kNoSpace = 0xffffffff;
constexpr uint8_t kSceneFormat = 1;

void PutSpace(ByteWriter& out, std::optional<SpaceId> space) {
  out.Put<uint32_t>(space ? space->value : kNoSpace);
}

std::optional<SpaceId> GetSpace(ByteReader& in) {
  const auto value = in.Get<uint32_t>();
  return value == kNoSpace ? std::nullopt
                           : std::optional<SpaceId>(SpaceId(value));
}

void PutFace(ByteWriter& out, const Face& face) {
  out.PutVarint(face.material.value);
  out.PutVarint(face.object.value);
  PutSpace(out, face.front_space);
  PutSpace(out, face.back_space);
  out.PutArray<Point3>(face.vertices);
  out.Put(face.surface_m2);
  out.Put<uint8_t>(face.solid ? 1 : 0);
  if (face.solid) {
    out.Put(face.solid->bounds);
    out.Put<uint8_t>(face.solid->front_is_inside ? 1 : 0);
  }
}

Face GetFace(ByteReader& in) {
  Face face;
  face.material = MaterialId(static_cast<uint32_t>(in.GetVarint()));
  face.object = ObjectId(static_cast<uint32_t>(in.GetVarint()));
  face.front_space = GetSpace(in);
  face.back_space = GetSpace(in);
  face.vertices = in.GetArray<Point3>();
  face.surface_m2 = in.Get<double>();
  if (in.Get<uint8_t>() != 0) {
    face.solid.emplace();
    face.solid->bounds = in.Get<Box3>();
    face.solid->front_is_inside = in.Get<uint8_t>() != 0;
  }
  return face;
}

void PutMaterial(ByteWriter& out, const Material& material) {
  out.PutString(material.name);
  out.Put(material.reflectance);
  out.Put(material.exitance);
  out.Put<int32_t>(material.sides);
  out.Put<uint8_t>(material.clear ? 1 : 0);
}

Material GetMaterial(ByteReader& in) {
  Material material;
  material.name = in.GetString();
  material.reflectance = in.Get<Rgb>();
  material.exitance = in.Get<Rgb>();
  material.sides = in.Get<int32_t>();
  material.clear = in.Get<uint8_t>() != 0;
  return material;
}

void PutSpacesAndOpenings(ByteWriter& out, const SceneInfo& info) {
  out.PutVarint(info.spaces.size());
  for (const Space& space : info.spaces) {
    out.PutString(space.name);
    out.Put(space.bounds);
    out.Put<uint8_t>(space.closed ? 1 : 0);
  }
  out.PutVarint(info.openings.size());
  for (const Opening& opening : info.openings) {
    out.PutArray<Point3>(opening.vertices);
    PutSpace(out, opening.front_space);
    PutSpace(out, opening.back_space);
  }
  out.Put<uint8_t>(info.gbxml ? 1 : 0);
  out.Put(info.gbxml.value_or(GbxmlCounts{}));
}

void GetSpacesAndOpenings(ByteReader& in, SceneInfo& info) {
  for (uint64_t left = in.GetVarint(); left > 0; --left) {
    Space space;
    space.name = in.GetString();
    space.bounds = in.Get<Box3>();
    space.closed = in.Get<uint8_t>() != 0;
    info.spaces.push_back(std::move(space));
  }
  for (uint64_t left = in.GetVarint(); left > 0; --left) {
    Opening opening;
    opening.vertices = in.GetArray<Point3>();
    opening.front_space = GetSpace(in);
    opening.back_space = GetSpace(in);
    info.openings.push_back(std::move(opening));
  }
  const bool is_gbxml = in.Get<uint8_t>() != 0;
  const auto counts = in.Get<GbxmlCounts>();
  if (is_gbxml) {
    info.gbxml = counts;
  }
}

std::string EncodeInfo(const SceneInfo& info) {
  ByteWriter out;
  out.Put(kSceneFormat);
  out.PutString(info.source_path);
  out.Put(info.source_hash);
  out.Put<uint8_t>(info.lacks_files ? 1 : 0);
  out.Put<uint8_t>(info.photometric ? 1 : 0);
  out.PutVarint(info.materials.size());
  for (const Material& material : info.materials) {
    PutMaterial(out, material);
  }
  PutSpacesAndOpenings(out, info);
  out.Put(info.bounds);
  out.Put<uint8_t>(info.y_is_up ? 1 : 0);
  out.Put(info.greatest_move_m);
  out.Put(info.coordinate_step_m);
  out.Put(info.input_polygons);
  out.Put(info.faces);
  out.PutVarint(info.notes.size());
  for (const std::string& note : info.notes) {
    out.PutString(note);
  }
  const Bytes& bytes = out.View();
  std::string text(bytes.size(), '\0');
  std::memcpy(text.data(), bytes.data(), bytes.size());
  return text;
}

SceneInfo DecodeInfo(ByteReader& in) {
  SceneInfo info;
  if (in.Get<uint8_t>() != kSceneFormat) {
    throw DamagedStoreError("its format is unknown");
  }
  info.source_path = in.GetString();
  info.source_hash = in.Get<uint64_t>();
  info.lacks_files = in.Get<uint8_t>() != 0;
  info.photometric = in.Get<uint8_t>() != 0;
  for (uint64_t left = in.GetVarint(); left > 0; --left) {
    info.materials.push_back(GetMaterial(in));
  }
  GetSpacesAndOpenings(in, info);
  info.bounds = in.Get<Box3>();
  info.y_is_up = in.Get<uint8_t>() != 0;
  info.greatest_move_m = in.Get<double>();
  info.coordinate_step_m = in.Get<double>();
  info.input_polygons = in.Get<uint64_t>();
  info.faces = in.Get<uint64_t>();
  for (uint64_t left = in.GetVarint(); left > 0; --left) {
    info.notes.push_back(in.GetString());
  }
  return info;
}

}  // namespace

SceneWriter::SceneWriter(BlockStorage& store) : store_(&store) {}

void SceneWriter::Add(const Face& face) {
  ENFILADE_CHECK(face.vertices.size() >= 3,
                 "a face has {} vertices",
                 face.vertices.size());
  for (const Point3 p : face.vertices) {
    ENFILADE_CHECK(IsFinite(p), "a face has a vertex {} {} {}", p.x, p.y, p.z);
    bounds_.Include(p);
  }
  const Vec3 area = AreaVector(face.vertices);
  ENFILADE_CHECK(Length(area) > 0, "a face has no area");
  level_areas_.Add(area);
  pending_.push_back(face);
  ++faces_;
  if (pending_.size() == kFacesPerChunk) {
    Flush();
  }
}

void SceneWriter::Flush() {
  if (pending_.empty()) {
    return;
  }
  ByteWriter out;
  out.PutVarint(pending_.size());
  for (const Face& face : pending_) {
    PutFace(out, face);
  }
  store_->Put({BlockKind::kFaces, chunks_, 0, 0}, out.View());
  ++chunks_;
  pending_.clear();
}

SceneInfo SceneWriter::Finish(SceneInfo info) {
  Flush();
  info.bounds = bounds_;
  info.y_is_up = !info.gbxml && IsYUp();
  info.faces = faces_;
  store_->SetMeta(kSceneMeta, EncodeInfo(info));
  return info;
}

uint64_t BytesOf(const SceneInfo& info) {
  uint64_t bytes = info.materials.capacity() * sizeof(Material) +
                   info.spaces.capacity() * sizeof(Space) +
                   info.openings.capacity() * sizeof(Opening) +
                   info.notes.capacity() * sizeof(std::string);
  for (const Material& material : info.materials) {
    bytes += AllocatedBytes(material.name.capacity() + 1);
  }
  for (const Space& space : info.spaces) {
    bytes += AllocatedBytes(space.name.capacity() + 1);
  }
  for (const Opening& opening : info.openings) {
    bytes += AllocatedBytes(opening.vertices.capacity() * sizeof(Point3));
  }
  for (const std::string& note : info.notes) {
    bytes += AllocatedBytes(note.capacity() + 1);
  }
  return bytes;
}

SceneInfo LoadSceneInfo(const BlockStorage& store) {
  auto info = ReadPackedMeta(store, kSceneMeta, DecodeInfo);
  if (!info) {
    ThrowDamaged(store, "holds no scene");
  }
  return *std::move(info);
}

void ForEachFace(const BlockStorage& store,
                 const std::function<void(FaceId, const Face&)>& visit) {
  const uint64_t chunks = store.Count(BlockKind::kFaces);
  uint32_t next_id = 0;
  for (uint32_t chunk = 0; chunk < chunks; ++chunk) {
    ReadBlock(store, {BlockKind::kFaces, chunk, 0, 0}, [&](ByteReader& in) {
      for (uint64_t left = in.GetVarint(); left > 0; --left) {
        ThrowIfStopRequested();
        visit(FaceId(next_id++), GetFace(in));
      }
      return next_id;
    });
  }
}

}  // namespace enfilade
