// The materials of an OBJ file, by the names that its usemtl lines give.

#pragma once

#include "scene/material_table.h"
#include "scene/mtl_reader.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace enfilade {

// Makes the material of a name that no material file has.
using MaterialMaker = std::function<Material(const std::string& name)>;

// Name to input material: the number that MaterialTable::AddInput returned.
using MaterialNames = std::map<std::string, size_t>;

// What an OBJ and its pieces share: each material file is read once, and grey
// is one material.
class ObjMaterialFiles {
 public:
  explicit ObjMaterialFiles(MaterialTable& materials) : materials_(materials) {}

  // The materials of a file; nullptr if it does not exist. Throws InputError.
  const MaterialNames* Read(const std::filesystem::path& path);
  // The material of a name, or nothing if the override file does not describe
  // that name. `place` is the file in which the name was first used.
  std::optional<size_t> Described(const std::string& name,
                                  const std::string& place);
  // The material of polygons that name none, first met in the file `place`.
  size_t Grey(const std::string& place);
  size_t Add(Material material, const std::string& place);

  // The first file that did not exist, and the number of materials that only
  // the override file describes.
  [[nodiscard]] const std::string& Absent() const { return absent_; }

  [[nodiscard]] size_t DescribedCount() const { return described_.size(); }

 private:
  void Charge(const MtlMaterial& m, double share);
  size_t AddGrey(const std::string& name, const std::string& place);

  MaterialTable& materials_;
  std::map<std::filesystem::path, MaterialNames> files_;  // those that exist
  MaterialNames described_;
  std::optional<size_t> grey_;
  std::string absent_;
};

// The materials of one OBJ file, or of one instance of a piece.
class ObjMaterials {
 public:
  // `make` may be empty. Otherwise it makes what no material file has, and
  // material files may be missing.
  ObjMaterials(ObjMaterialFiles& files,
               const std::filesystem::path& obj,
               const MaterialMaker& make)
      : files_(files), obj_(obj), make_(make) {}

  // Takes the materials of the files that a mtllib line names.
  void Load(std::string_view names);
  // The material of a name; nothing if nobody knows it.
  std::optional<size_t> Find(const std::string& name);
  // Tells why Find found nothing, and what to do.
  [[nodiscard]] std::string WhyUnknown(const std::string& name) const;

  // The material of polygons before any usemtl.
  size_t Grey() { return files_.Grey(obj_.string()); }

 private:
  ObjMaterialFiles& files_;
  const std::filesystem::path& obj_;
  const MaterialMaker& make_;
  MaterialNames by_name_;
  std::string absent_;  // the first material file that it names and lacks
};

}  // namespace enfilade
