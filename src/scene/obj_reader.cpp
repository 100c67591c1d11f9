#define TINYOBJLOADER_USE_DOUBLE
#include "scene/obj_reader.h"

#include "base/error.h"
#include "scene/instance_line.h"
#include "scene/number_text.h"
#include "scene/obj_files.h"
#include "scene/obj_materials.h"
#include "scene/spill_vector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <istream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tiny_obj_loader.h>

namespace enfilade {
namespace {

constexpr uint64_t kVertexShare = 4;  // vertices get a quarter of what is free
constexpr uint32_t kVertexScratch = 0;
constexpr uint32_t kPieceScratch = 1;
constexpr uint64_t kProgressPolygons = 4096;
// Farther from the origin, results computed from coordinates are less precise
// than a millimetre, and products of coordinates overflow in the end.
constexpr double kFarthestM = 1e8;

double LargestCoordinate(Point3 p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

// Statements that are read, by the library or here, or that hold no surface of
// polygons by themselves: texture, normals, lines, points, smoothing, display,
// and the parameters of curves.
constexpr std::string_view kStatements[] = {
    "vt",         "vn",        "g",     "o",        "usemtl", "s",
    "l",          "p",         "v",     "f",        "mtllib", "vp",
    "mg",         "cstype",    "deg",   "bmat",     "step",   "curv",
    "curv2",      "parm",      "trim",  "hole",     "scrv",   "sp",
    "end",        "con",       "bevel", "c_interp", "lod",    "d_interp",
    "shadow_obj", "trace_obj", "ctech", "stech",    "maplib", "usemap"};

bool IsStatement(std::string_view word) {
  return std::find(std::begin(kStatements), std::end(kStatements), word) !=
         std::end(kStatements);
}

// The beginning of a word as a message can show it.
std::string Shown(std::string_view word) {
  constexpr size_t kMost = 20;
  std::string shown(word.substr(0, kMost));
  std::replace_if(
      shown.begin(),
      shown.end(),
      [](char c) { return c < ' ' || c > '~'; },
      '?');
  return shown;
}

std::string WithoutBlanksBefore(std::string name) {
  name.erase(0, name.find_first_not_of(" \t"));
  return name;
}

// What an OBJ and its pieces share.
struct ObjContext {
  MaterialTable& materials;
  MemoryBudget& budget;
  BlockStorage& store;
  PolygonReceiver& receiver;
  ObjMaterialFiles files;
};

// Ends the reading of a file of which enough was seen.
struct Enough {};

// The object whose polygons are being read.
struct CurrentObject {
  std::string name;
  ObjectId id;
};

// Reads one OBJ file, or one instance of a piece, through tinyobjloader's
// callbacks.
class ObjReading {
 public:
  ObjReading(const ObjInput& input, ObjContext& context)
      : ObjReading(input, context, {}, kVertexScratch) {}

  ObjCounts Run() {
    Parse();
    context_.receiver.Flush();
    counts_.absent = context_.files.Absent();
    counts_.described = context_.files.DescribedCount();
    return counts_;
  }

 private:
  // An instance belongs to the object in which its line stands.
  ObjReading(const ObjInput& input,
             ObjContext& context,
             CurrentObject object,
             uint32_t scratch_key)
      : input_(input),
        file_(input.path),
        lines_(file_, [this](std::string_view line) { CheckLine(line); }),
        context_(context),
        is_piece_(scratch_key == kPieceScratch),
        materials_(context.files, input.path, input.unknown_material),
        vertices_(context.store,
                  context.budget,
                  context.budget.FreeBytes() / kVertexShare,
                  scratch_key),
        object_(std::move(object)) {}

  void Parse() {
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
      Self(self).StartObject(WithoutBlanksBefore(name));
    };
    // A group may have several names, which are often one with blanks.
    callbacks.group_cb = [](void* self, const char** names, int count) {
      Self(self).StartObject(fmt::format(
          "{}",
          fmt::join(std::span(names, static_cast<size_t>(std::max(count, 0))),
                    " ")));
    };
    std::istream stream(&lines_);
    stream.exceptions(std::ios::badbit);  // lets CheckLine's errors through
    std::string warnings;
    std::string errors;
    try {
      tinyobj::LoadObjWithCallback(
          stream, callbacks, this, nullptr, &warnings, &errors);
    } catch (const Enough&) {
      errors.clear();
    }
    if (!errors.empty()) {
      Fail(errors);
    }
    vertices_.Clear();
  }

  static ObjReading& Self(void* self) {
    return *static_cast<ObjReading*>(self);
  }

  // Handles instances and material files, and rejects what the library would
  // misread or pass over in silence.
  void CheckLine(std::string_view line) {
    const size_t first = line.find_first_not_of(" \t");
    if (first == std::string_view::npos) {
      return;
    }
    line.remove_prefix(first);
    if (const auto words = WordsAfterInstance(line)) {
      if (!input_.without_instances) {
        AddInstance(*words);
      }
      return;
    }
    const auto starts = [&](std::string_view key) {
      return line.size() > key.size() && line.substr(0, key.size()) == key &&
             (line[key.size()] == ' ' || line[key.size()] == '\t');
    };
    if (starts("v")) {
      CheckVertex(line.substr(1));
    } else if (starts("f")) {
      CheckPolygon(line.substr(1));
    } else if (starts("mtllib")) {
      materials_.Load(*NamesAfterMtllib(line));
    } else if (line == "f" || line == "v" || line == "usemtl") {
      Fail(fmt::format("'{}' without anything after it", line));
    } else if (const auto word = line.substr(0, line.find_first_of(" \t"));
               line[0] != '#' && !IsStatement(word)) {
      PassOver(word);
    }
  }

  void PassOver(std::string_view word) {
    if (counts_.unknown++ == 0) {
      counts_.first_unknown = fmt::format(
          "{}:{}: '{}'", input_.path.string(), lines_.Line(), Shown(word));
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

  // Reads the piece of an instance. The parser has handled all earlier lines.
  void AddInstance(std::string_view words) {
    if (is_piece_) {
      Fail("a piece cannot hold instances of other pieces");
    }
    const InstanceReading read = ReadInstance(words);
    if (!read.instance) {
      Fail(read.error);
    }
    const Instance& instance = *read.instance;
    ObjInput input;
    input.path = input_.path.parent_path() / instance.piece;
    input.place = [&](Point3 p) {
      const Point3 here = instance.placement.At(p);
      return input_.place ? input_.place(here) : here;
    };
    input.unknown_material = input_.unknown_material;
    if (!IsFile(input.path)) {
      Fail(fmt::format("piece {} does not exist", input.path.string()));
    }
    ObjReading piece(input, context_, object_, kPieceScratch);
    piece.Parse();
    counts_.polygons += piece.counts_.polygons;
    counts_.clear += piece.counts_.clear;
    counts_.lines += piece.counts_.lines;
    if (counts_.unknown == 0) {
      counts_.first_unknown = piece.counts_.first_unknown;
    }
    counts_.unknown += piece.counts_.unknown;
    material_chosen_ = false;  // the receiver now has the piece's material
    if (input_.progress) {
      input_.progress(file_.Fraction());
    }
  }

  void Vertex(Point3 p) {
    const Point3 placed = input_.place ? input_.place(p) : p;
    const Point3 here = input_.mend ? input_.mend(placed) : placed;
    if (!IsFinite(here)) {
      Fail(
          "a coordinate overflows when it is computed: write it without an "
          "exponent");
    }
    vertices_.Append(here);
    if (input_.is_enough && input_.is_enough()) {
      throw Enough();
    }
  }

  void Polygon(std::span<const tinyobj::index_t> indices) {
    if (indices.size() < 3) {
      ++counts_.lines;
      return;
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
      context_.receiver.Add(corners_);
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
    const Point3 vertex = vertices_.At(static_cast<uint64_t>(index));
    if (LargestCoordinate(vertex) > kFarthestM) {
      Fail(
          fmt::format("vertex {} is more than {:.0e} m from the origin: no "
                      "building is there; correct it, or say what its unit is "
                      "(--unit mm)",
                      number,
                      kFarthestM));
    }
    return vertex;
  }

  void StartObject(const std::string& name) {
    if (is_piece_) {
      return;
    }
    object_ = {name, ObjectId(++objects_)};
    material_chosen_ = false;
  }

  void UseMaterial(const std::string& as_written) {
    const std::string name = WithoutBlanksBefore(as_written);
    input_material_ = materials_.Find(name);
    if (!input_material_) {
      Fail(materials_.WhyUnknown(name));
    }
    material_chosen_ = false;
  }

  // Sets the material of the polygons to come; nullopt if it is clear.
  void ChooseMaterial() {
    MaterialTable& materials = context_.materials;
    material_ = materials.Resolve(
        input_material_ ? *input_material_ : materials_.Grey(),
        object_.name,
        "");
    if (material_) {
      context_.receiver.Begin(
          *material_, materials.Materials()[material_->Index()], object_.id);
    }
    material_chosen_ = true;
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(
        fmt::format("{}:{}: {}", input_.path.string(), lines_.Line(), what));
  }

  const ObjInput& input_;
  InputFile file_;
  LineStream lines_;
  ObjContext& context_;
  bool is_piece_;
  ObjMaterials materials_;
  SpillVector vertices_;
  std::vector<Point3> corners_;
  std::optional<size_t> input_material_;  // the last usemtl
  std::optional<MaterialId> material_;
  bool material_chosen_ = false;
  CurrentObject object_;
  uint32_t objects_ = 0;
  ObjCounts counts_;
};

}  // namespace

ObjCounts ReadObj(const ObjInput& input,
                  MaterialTable& materials,
                  MemoryBudget& budget,
                  BlockStorage& store,
                  PolygonReceiver& receiver) {
  ObjContext context{
      materials, budget, store, receiver, ObjMaterialFiles(materials)};
  return ObjReading(input, context).Run();
}

}  // namespace enfilade
