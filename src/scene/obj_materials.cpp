#include "scene/obj_materials.h"

#include "base/memory.h"
#include "scene/input_file.h"
#include "scene/obj_files.h"

#include <utility>

#include <fmt/format.h>

namespace enfilade {

const MaterialNames* ObjMaterialFiles::Read(const std::filesystem::path& path) {
  const auto known = files_.find(path);
  if (known != files_.end()) {
    return &known->second;
  }
  if (!Exists(path)) {
    // Not kept by name: they may be many.
    absent_ = absent_.empty() ? path.string() : absent_;
    return nullptr;
  }
  MaterialNames names;
  ReadMtl(path, [&](MtlMaterial&& m, double share) {
    const std::string name = m.material.name;
    Charge(m, share);
    names[name] = materials_.AddInput(
        std::move(m.material), std::move(m.place), m.is_assumed);
  });
  return &(files_[path] = std::move(names));
}

std::optional<size_t> ObjMaterialFiles::Described(const std::string& name,
                                                  const std::string& place) {
  const auto known = described_.find(name);
  if (known != described_.end()) {
    return known->second;
  }
  if (!materials_.IsDescribed(name)) {
    return std::nullopt;
  }
  return described_[name] = AddGrey(name, place);
}

size_t ObjMaterialFiles::Grey(const std::string& place) {
  if (!grey_) {
    grey_ = AddGrey("default grey", place);
  }
  return *grey_;
}

size_t ObjMaterialFiles::Add(Material material, const std::string& place) {
  MtlMaterial added{std::move(material), place};
  Charge(added, 1);
  return materials_.AddInput(std::move(added.material), std::move(added.place));
}

size_t ObjMaterialFiles::AddGrey(const std::string& name,
                                 const std::string& place) {
  Material grey;
  grey.name = name;
  grey.reflectance.fill(kAssumedReflectance);
  return Add(std::move(grey), place);
}

// Charges a material before it is kept in the table, a growing vector, and by
// name in the maps of its MTL file and of the OBJ that names that file.
// `share` of the MTL file has been read with this material.
void ObjMaterialFiles::Charge(const MtlMaterial& m, double share) {
  constexpr uint64_t kGrowth = 3;
  constexpr uint64_t kNames = 2;
  constexpr uint64_t kBytesPerName = 128;  // of a map
  materials_.Charge(
      kGrowth * sizeof(MtlMaterial) + kNames * kBytesPerName +
          (kNames + 1) * AllocatedBytes(m.material.name.size() + 1) +
          AllocatedBytes(m.place.size() + 1) +
          MaterialTable::BytesToResolve(m.material),
      share);
}

void ObjMaterials::Load(std::string_view names) {
  for (const auto& path : MaterialPaths(obj_, names)) {
    if (const MaterialNames* found = files_.Read(path)) {
      for (const auto& [name, material] : *found) {
        by_name_[name] = material;
      }
    } else {
      absent_ = absent_.empty() ? path.string() : absent_;
    }
  }
}

std::optional<size_t> ObjMaterials::Find(const std::string& name) {
  const auto known = by_name_.find(name);
  if (known != by_name_.end()) {
    return known->second;
  }
  if (make_) {
    return by_name_[name] = files_.Add(make_(name), obj_.string());
  }
  return files_.Described(name, obj_.string());
}

std::string ObjMaterials::WhyUnknown(const std::string& name) const {
  const char* otherwise =
      "give it a reflectance in an override file (--overrides)";
  return absent_.empty()
             ? fmt::format(
                   "material '{}' is in no material file; name its file with "
                   "mtllib before, add it there, or {}",
                   name,
                   otherwise)
             : fmt::format(
                   "material '{}' is in no material file, and {} does not "
                   "exist; put that file there, or {}",
                   name,
                   absent_,
                   otherwise);
}

}  // namespace enfilade
