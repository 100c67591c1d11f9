// Streams polygons to a Wavefront OBJ file and the materials they use to an
// MTL file beside it. Memory does not grow with the number of polygons.
//
// Both files get their final names only when Finish() succeeds. Until then they
// have the suffix ".part", and the destructor of the writer removes them.
// Coordinates are metres, Z up, with ten significant digits. Kd is the diffuse
// reflectance, Ke the exitance (W/m2). A material that reflects only on its
// front has the line `sides 1`, which programs other than Enfilade ignore.

#pragma once

#include "base/ids.h"
#include "base/photometry.h"
#include "base/vec.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/file_pointer.h"
#include "tools/pending_file.h"
#include <fmt/format.h>

namespace enfilade {

struct ObjMaterial {
  std::string name;   // no blanks
  Rgb reflectance{};  // in [0, 1)
  Rgb exitance{};     // W/m2
  int sides = 2;      // 1: the back is black
};

// A placement of a piece (docs/instances.md).
struct ObjInstance {
  std::filesystem::path piece;  // relative to the folder of the OBJ; no blanks
  Point3 origin;
  double angle_degrees = 0;  // about z, counter-clockwise
  uint64_t polygons = 0;     // of the piece
};

// All members throw DiskError when a file cannot be written. AddPolygon and
// AddInstance throw InterruptedError if a stop was requested; they check when
// they flush their text.
class ObjWriter {
 public:
  // Throws UsageError unless the path ends in ".obj". The materials go to the
  // same path with ".mtl".
  explicit ObjWriter(const std::filesystem::path& obj_path);

  MaterialId DefineMaterial(const ObjMaterial& material);

  // The polygons that follow belong to this object or have this material.
  void BeginObject(std::string_view name);
  void UseMaterial(MaterialId material);

  // Counter-clockwise seen from the front. Requires three vertices or more.
  void AddPolygon(std::span<const Point3> vertices);

  void AddPolygon(std::initializer_list<Point3> vertices) {
    AddPolygon(std::span<const Point3>(vertices.begin(), vertices.size()));
  }

  // The instance belongs to the object begun last.
  void AddInstance(const ObjInstance& instance);

  // Completes both files and gives them their names.
  void Finish();

  [[nodiscard]] const std::filesystem::path& Path() const { return obj_path_; }

  [[nodiscard]] const std::filesystem::path& MaterialPath() const {
    return mtl_path_;
  }

  // Includes the polygons of instances.
  [[nodiscard]] uint64_t Polygons() const { return polygons_; }

  [[nodiscard]] uint64_t Instances() const { return instances_; }

  [[nodiscard]] uint64_t Objects() const { return objects_; }

  [[nodiscard]] uint64_t Materials() const { return material_names_.size(); }

 private:
  struct RecentVertex {
    Point3 point;
    uint64_t index = 0;  // 1-based as in OBJ; 0: none
  };

  static FilePointer Open(const std::filesystem::path& path);
  static void Close(FilePointer file, const std::filesystem::path& path);
  void FlushTo(const FilePointer& file,
               const std::filesystem::path& path,
               fmt::memory_buffer& text);
  void FlushIfLong();
  uint64_t VertexIndex(Point3 point);

  std::filesystem::path obj_path_;
  std::filesystem::path mtl_path_;
  PendingFile obj_file_;
  PendingFile mtl_file_;
  FilePointer obj_;
  FilePointer mtl_;
  fmt::memory_buffer obj_text_;
  fmt::memory_buffer mtl_text_;
  std::vector<std::string> material_names_;
  std::optional<MaterialId> current_material_;
  // The vertices written most recently; neighbouring polygons share them.
  std::array<RecentVertex, 32> recent_{};
  size_t next_recent_ = 0;
  uint64_t vertices_ = 0;
  uint64_t polygons_ = 0;
  uint64_t objects_ = 0;
  uint64_t instances_ = 0;
};

}  // namespace enfilade
