#include "tools/scenes/obj_writer.h"

#include "base/check.h"
#include "base/error.h"
#include "base/stop.h"

#include <cerrno>
#include <cstring>
#include <iterator>
#include <system_error>
#include <utility>

namespace enfilade {

namespace {

constexpr size_t kFlushBytes = size_t{1} << 16;

[[noreturn]] void ThrowDiskError(const std::filesystem::path& path,
                                 const char* what) {
  throw DiskError(fmt::format("{}: {}: {}; choose another place or free space",
                              path.string(),
                              what,
                              std::strerror(errno)));  // NOLINT(concurrency-*)
}

}  // namespace

ObjWriter::ObjWriter(const std::filesystem::path& obj_path)
    : obj_path_(obj_path),
      mtl_path_(std::filesystem::path(obj_path).replace_extension(".mtl")),
      obj_file_(obj_path_),
      mtl_file_(mtl_path_) {
  if (obj_path.extension() != ".obj") {
    throw UsageError(fmt::format(
        "{}: a generated scene is an OBJ file; give a name that ends in .obj",
        obj_path.string()));
  }
  obj_ = Open(obj_file_.Path());
  mtl_ = Open(mtl_file_.Path());
  fmt::format_to(std::back_inserter(obj_text_),
                 "# metres, Z up\nmtllib {}\n",
                 mtl_path_.filename().string());
}

FilePointer ObjWriter::Open(const std::filesystem::path& path) {
  FilePointer file(std::fopen(path.c_str(), "wb"));
  if (file == nullptr) {
    ThrowDiskError(path, "cannot be created");
  }
  return file;
}

void ObjWriter::Close(FilePointer file, const std::filesystem::path& path) {
  if (std::fclose(file.release()) != 0) {
    ThrowDiskError(path, "cannot be written");
  }
}

void ObjWriter::FlushTo(const FilePointer& file,
                        const std::filesystem::path& path,
                        fmt::memory_buffer& text) {
  if (std::fwrite(text.data(), 1, text.size(), file.get()) != text.size()) {
    ThrowDiskError(path, "cannot be written");
  }
  text.clear();
}

MaterialId ObjWriter::DefineMaterial(const ObjMaterial& m) {
  auto out = std::back_inserter(mtl_text_);
  fmt::format_to(out, "newmtl {}\n", m.name);
  fmt::format_to(out,
                 "Kd {:.10g} {:.10g} {:.10g}\n",
                 m.reflectance[0],
                 m.reflectance[1],
                 m.reflectance[2]);
  if (MaxChannel(m.exitance) > 0) {
    fmt::format_to(out,
                   "Ke {:.10g} {:.10g} {:.10g}\n",
                   m.exitance[0],
                   m.exitance[1],
                   m.exitance[2]);
  }
  if (m.sides == 1) {
    fmt::format_to(out, "sides 1\n");
  }
  material_names_.push_back(m.name);
  return MaterialId(material_names_.size() - 1);
}

void ObjWriter::BeginObject(std::string_view name) {
  fmt::format_to(std::back_inserter(obj_text_), "o {}\n", name);
  ++objects_;
}

void ObjWriter::UseMaterial(MaterialId material) {
  ENFILADE_CHECK(material.Index() < material_names_.size(),
                 "material {} of {}",
                 material.value,
                 material_names_.size());
  if (current_material_ == material) {
    return;
  }
  current_material_ = material;
  fmt::format_to(std::back_inserter(obj_text_),
                 "usemtl {}\n",
                 material_names_[material.Index()]);
}

uint64_t ObjWriter::VertexIndex(Point3 point) {
  for (const RecentVertex& recent : recent_) {
    if (recent.index != 0 && recent.point == point) {
      return recent.index;
    }
  }
  // Adding zero turns -0 into 0, which is printed without a sign.
  fmt::format_to(std::back_inserter(obj_text_),
                 "v {:.10g} {:.10g} {:.10g}\n",
                 point.x + 0.0,
                 point.y + 0.0,
                 point.z + 0.0);
  recent_[next_recent_] = {point, ++vertices_};
  next_recent_ = (next_recent_ + 1) % recent_.size();
  return vertices_;
}

void ObjWriter::AddPolygon(std::span<const Point3> vertices) {
  ENFILADE_CHECK(
      vertices.size() >= 3, "a polygon of {} vertices", vertices.size());
  fmt::memory_buffer face;
  for (const Point3 point : vertices) {
    fmt::format_to(std::back_inserter(face), " {}", VertexIndex(point));
  }
  fmt::format_to(std::back_inserter(obj_text_),
                 "f{}\n",
                 std::string_view(face.data(), face.size()));
  ++polygons_;
  FlushIfLong();
}

void ObjWriter::AddInstance(const ObjInstance& instance) {
  fmt::format_to(std::back_inserter(obj_text_),
                 "#instance {} {:.10g} {:.10g} {:.10g} {:.10g}\n",
                 instance.piece.generic_string(),
                 instance.origin.x + 0.0,
                 instance.origin.y + 0.0,
                 instance.origin.z + 0.0,
                 instance.angle_degrees + 0.0);
  ++instances_;
  polygons_ += instance.polygons;
  FlushIfLong();
}

void ObjWriter::FlushIfLong() {
  if (obj_text_.size() >= kFlushBytes) {
    ThrowIfStopRequested();
    FlushTo(obj_, obj_file_.Path(), obj_text_);
  }
}

void ObjWriter::Finish() {
  ENFILADE_CHECK(obj_ != nullptr, "{} finished twice", obj_path_.string());
  FlushTo(mtl_, mtl_file_.Path(), mtl_text_);
  FlushTo(obj_, obj_file_.Path(), obj_text_);
  Close(std::move(mtl_), mtl_file_.Path());
  Close(std::move(obj_), obj_file_.Path());
  mtl_file_.Keep();
  obj_file_.Keep();
}

}  // namespace enfilade
