#define TINYOBJLOADER_USE_DOUBLE
#include "scene/obj_reader.h"

#include "base/error.h"
#include "scene/mtl_reader.h"
#include "scene/number_text.h"
#include "scene/spill_vector.h"

#include <algorithm>
#include <array>
#include <istream>
#include <map>
#include <set>

#include <fmt/format.h>
#include <tiny_obj_loader.h>

namespace enfilade {
namespace {

constexpr double kDefaultReflectance = 0.5;
constexpr uint64_t kVertexShare = 4;  // vertices get a quarter of what is free
constexpr uint64_t kVertexScratch = 0;
constexpr uint64_t kProgressPolygons = 4096;

// The names after a mtllib, most likely reading first: the whole rest of the
// line is one name with blanks in it if there is such a file.
std::vector<std::filesystem::path> MaterialPaths(
    const std::filesystem::path& obj, std::string_view names) {
  const std::filesystem::path folder = obj.parent_path();
  if (std::filesystem::exists(folder / names)) {
    return {folder / names};
  }
  std::vector<std::filesystem::path> paths;
  for (const std::string_view name : Words(names)) {
    paths.push_back(folder / name);
  }
  return paths;
}

std::optional<std::string_view> NamesAfterMtllib(std::string_view line) {
  constexpr std::string_view kKey = "mtllib";
  const size_t first = line.find_first_not_of(" \t");
  if (first == std::string_view::npos ||
      line.substr(first, kKey.size()) != kKey) {
    return std::nullopt;
  }
  const size_t name = line.find_first_not_of(" \t", first + kKey.size());
  return name == std::string_view::npos ? std::string_view()
                                        : line.substr(name);
}

// One OBJ file on its way through tinyobjloader's callbacks.
class ObjReading {
 public:
  ObjReading(const ObjInput& input,
             MaterialTable& materials,
             MemoryBudget& budget,
             BlockStorage& store,
             PolygonSink& sink)
      : input_(input),
        file_(input.path),
        lines_(file_, [this](std::string_view line) { CheckLine(line); }),
        materials_(materials),
        sink_(sink),
        vertices_(
            store, budget, budget.FreeBytes() / kVertexShare, kVertexScratch) {}

  ObjCounts Run() {
    tinyobj::callback_t callbacks;
    callbacks.vertex_cb =
        [](void* self, double x, double y, double z, double /*w*/) {
          Self(self).Vertex({x, y, z});
        };
    callbacks.index_cb = [](void* self, tinyobj::index_t* indices, int count) {
      Self(self).Polygon(
          std::span(indices, static_cast<size_t>(std::max(count, 0))));
    };
    callbacks.usemtl_cb = [](void* self, const char* name, int /*id*/) {
      Self(self).UseMaterial(name);
    };
    callbacks.object_cb = [](void* self, const char* name) {
      Self(self).StartObject(name);
    };
    callbacks.group_cb = [](void* self, const char** names, int count) {
      Self(self).StartObject(count > 0 ? names[0] : "");
    };
    std::istream stream(&lines_);
    stream.exceptions(std::ios::badbit);  // lets errors of the check through
    std::string warnings;
    std::string errors;
    tinyobj::LoadObjWithCallback(
        stream, callbacks, this, nullptr, &warnings, &errors);
    if (!errors.empty()) {
      Fail(errors);
    }
    sink_.Flush();
    vertices_.Clear();
    return counts_;
  }

 private:
  static ObjReading& Self(void* self) {
    return *static_cast<ObjReading*>(self);
  }

  // What the library would take for something else, or pass over in silence.
  void CheckLine(std::string_view line) {
    const size_t first = line.find_first_not_of(" \t");
    if (first == std::string_view::npos) {
      return;
    }
    line.remove_prefix(first);
    const auto starts = [&](std::string_view key) {
      return line.size() > key.size() && line.substr(0, key.size()) == key &&
             (line[key.size()] == ' ' || line[key.size()] == '\t');
    };
    if (starts("v")) {
      CheckVertex(line.substr(1));
    } else if (starts("f")) {
      CheckPolygon(line.substr(1));
    } else if (starts("mtllib")) {
      LoadMaterials(*NamesAfterMtllib(line));
    } else if (line == "f" || line == "v" || line == "usemtl") {
      Fail(fmt::format("'{}' without anything after it", line));
    }
  }

  void CheckVertex(std::string_view rest) const {
    const std::vector<std::string_view> words = Words(rest);
    if (words.size() < 3) {
      Fail("a vertex needs three coordinates");
    }
    for (const std::string_view word : words) {
      if (!IsNumber(word)) {
        Fail(fmt::format("coordinate '{}' is not a finite number", word));
      }
    }
  }

  void CheckPolygon(std::string_view rest) const {
    for (const std::string_view word : Words(rest)) {
      if (!IsInteger(word.substr(0, word.find('/')))) {
        Fail(fmt::format("'{}' is not a vertex number", word));
      }
    }
  }

  void Vertex(Point3 p) { vertices_.Append(p); }

  void Polygon(std::span<const tinyobj::index_t> indices) {
    if (indices.size() < 3) {
      Fail(fmt::format("a face needs at least three vertices and has {}",
                       indices.size()));
    }
    if (!material_chosen_) {
      ChooseMaterial();
    }
    if (++counts_.polygons % kProgressPolygons == 0 && input_.progress) {
      input_.progress(file_.Fraction());
    }
    corners_.clear();
    for (const tinyobj::index_t& index : indices) {
      corners_.push_back(VertexAt(index.vertex_index));
    }
    if (material_) {
      sink_.Add(corners_);
    } else {
      ++counts_.clear;
    }
  }

  Point3 VertexAt(int64_t number) {
    const auto count = static_cast<int64_t>(vertices_.Size());
    const int64_t index = number > 0 ? number - 1 : count + number;
    if (number == 0 || index < 0 || index >= count) {
      Fail(
          fmt::format("vertex {} does not exist: {} vertices were given so far",
                      number,
                      count));
    }
    return vertices_.At(static_cast<uint64_t>(index));
  }

  void StartObject(const std::string& name) {
    object_name_ = name;
    object_ = ObjectId(++objects_);
    material_chosen_ = false;
  }

  void UseMaterial(const std::string& name) {
    const auto it = input_by_name_.find(name);
    if (it == input_by_name_.end()) {
      Fail(fmt::format(
          "material '{}' is in no material file; name its file with mtllib "
          "before, or add it there",
          name));
    }
    input_material_ = it->second;
    material_chosen_ = false;
  }

  // The material of the polygons to come; none if it is clear.
  void ChooseMaterial() {
    if (!input_material_) {
      Material grey;
      grey.name = "default grey";
      grey.reflectance.fill(kDefaultReflectance);
      input_material_ = materials_.AddInput(grey, input_.path.string());
    }
    material_ = materials_.Resolve(*input_material_, object_name_, "");
    if (material_) {
      sink_.Begin(
          *material_, materials_.Materials()[material_->Index()], object_);
    }
    material_chosen_ = true;
  }

  void LoadMaterials(std::string_view names) {
    for (const auto& path : MaterialPaths(input_.path, names)) {
      if (!loaded_.insert(path).second) {
        continue;
      }
      if (!std::filesystem::exists(path)) {
        Fail(fmt::format("material file {} does not exist", path.string()));
      }
      for (MtlMaterial& m : ReadMtl(path)) {
        const std::string name = m.material.name;
        input_by_name_[name] =
            materials_.AddInput(std::move(m.material), std::move(m.place));
      }
    }
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(
        fmt::format("{}:{}: {}", input_.path.string(), lines_.Line(), what));
  }

  const ObjInput& input_;
  InputFile file_;
  LineStream lines_;
  MaterialTable& materials_;
  PolygonSink& sink_;
  SpillVector vertices_;
  std::vector<Point3> corners_;
  std::map<std::string, size_t> input_by_name_;
  std::set<std::filesystem::path> loaded_;
  std::optional<size_t> input_material_;  // the last usemtl
  std::optional<MaterialId> material_;
  bool material_chosen_ = false;
  std::string object_name_;
  ObjectId object_;
  uint32_t objects_ = 0;
  ObjCounts counts_;
};

}  // namespace

ObjCounts ReadObj(const ObjInput& input,
                  MaterialTable& materials,
                  MemoryBudget& budget,
                  BlockStorage& store,
                  PolygonSink& sink) {
  return ObjReading(input, materials, budget, store, sink).Run();
}

std::vector<std::filesystem::path> MaterialFilesOf(
    const std::filesystem::path& obj,
    const std::function<void(std::span<const char>)>& visit) {
  InputFile file(obj);
  std::vector<std::filesystem::path> paths;
  LineStream lines(file, [&](std::string_view line) {
    visit(line);
    const auto names = NamesAfterMtllib(line);
    if (!names) {
      return;
    }
    for (const auto& path : MaterialPaths(obj, *names)) {
      if (std::find(paths.begin(), paths.end(), path) == paths.end()) {
        paths.push_back(path);
      }
    }
  });
  std::istream stream(&lines);
  stream.exceptions(std::ios::badbit);
  while (stream.ignore(std::numeric_limits<std::streamsize>::max()) &&
         !stream.eof()) {
  }
  return paths;
}

}  // namespace enfilade
