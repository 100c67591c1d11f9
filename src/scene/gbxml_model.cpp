#include "scene/gbxml_model.h"

#include "base/error.h"
#include "scene/input_file.h"
#include "scene/number_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <pugixml.hpp>

namespace enfilade {
namespace {

constexpr uint64_t kMostXmlBytes = 4ULL << 30;
// Bytes of the document, its tree and the model, per byte of the file:
// measured, see the test of the memory of import. Short tags make more nodes of
// the tree: one or two for two '<', and an attribute for each '='.
constexpr uint64_t kTreePerByte = 3;
constexpr uint64_t kTreePerTag = 96;
constexpr uint64_t kTreePerAttribute = 40;
// The longest site with its buildings, and the shortest building.
constexpr double kLargestMetres = 5000;
constexpr double kSmallestMetres = 0.1;
// Coordinates of maps are millions of metres.
constexpr double kFarthestMetres = 1e8;

double MetresPerUnit(const std::string& unit, const std::string& file) {
  const std::pair<std::string_view, double> known[] = {{"Meters", 1.0},
                                                       {"Kilometers", 1000.0},
                                                       {"Centimeters", 0.01},
                                                       {"Millimeters", 0.001},
                                                       {"Feet", 0.3048},
                                                       {"Inches", 0.0254},
                                                       {"Yards", 0.9144},
                                                       {"Miles", 1609.344}};
  for (const auto& [name, metres] : known) {
    if (unit == name) {
      return metres;
    }
  }
  throw InputError(fmt::format(
      "{}: lengthUnit '{}' is unknown; give Meters, Centimeters, Millimeters, "
      "Kilometers, Feet, Inches, Yards or Miles",
      file,
      unit));
}

// Whether the node has this name, its namespace prefix aside.
bool Is(const pugi::xml_node& node, std::string_view name) {
  std::string_view full = node.name();
  const size_t colon = full.find(':');
  if (colon != std::string_view::npos) {
    full.remove_prefix(colon + 1);
  }
  return full == name;
}

// All of the text that stands directly in a node, whatever divides it.
std::string TextOf(const pugi::xml_node& node) {
  std::string text;
  for (const pugi::xml_node& child : node.children()) {
    if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) {
      text += child.value();
    }
  }
  return text;
}

pugi::xml_node ChildOf(const pugi::xml_node& node, std::string_view name) {
  return node.find_child(
      [&](const pugi::xml_node& child) { return Is(child, name); });
}

// The name that a node gives itself, or else its id.
std::string NameOf(const pugi::xml_node& node, const std::string& id) {
  const std::string name = TextOf(ChildOf(node, "Name"));
  return name.empty() ? id : name;
}

class ModelReader {
 public:
  ModelReader(const std::filesystem::path& path, bool strip_spaces)
      : file_(path.string()), strip_spaces_(strip_spaces) {}

  GbxmlModel Read(const pugi::xml_document& document) {
    const pugi::xml_node root = ChildOf(document, "gbXML");
    if (!ChildOf(root, "Campus")) {
      Fail("no gbXML element with a Campus in it: not a gbXML scene");
    }
    model_.has_unit = !root.attribute("lengthUnit").empty();
    unit_name_ = root.attribute("lengthUnit").as_string("Meters");
    unit_ = MetresPerUnit(unit_name_, file_);
    ForEachInCampus(root, "Building", [this](const pugi::xml_node& building) {
      ReadSpaces(building);
    });
    ForEachInCampus(root, "Surface", [this](const pugi::xml_node& surface) {
      ReadSurface(surface);
    });
    if (model_.surfaces.empty()) {
      Fail("the Campus has no Surface");
    }
    at_.clear();
    CheckSize();
    return std::move(model_);
  }

 private:
  // Most files have one Campus; the format allows several.
  template <typename Visit>
  static void ForEachInCampus(const pugi::xml_node& root,
                              std::string_view name,
                              const Visit& visit) {
    for (const pugi::xml_node& campus : root.children()) {
      if (!Is(campus, "Campus")) {
        continue;
      }
      for (const pugi::xml_node& node : campus.children()) {
        if (Is(node, name)) {
          visit(node);
        }
      }
    }
  }

  void ReadSpaces(const pugi::xml_node& building) {
    for (const pugi::xml_node& node : building.children()) {
      if (!Is(node, "Space")) {
        continue;
      }
      GbxmlSpace space;
      space.id = node.attribute("id").as_string();
      space.name = NameOf(node, space.id);
      at_ = fmt::format("Space '{}'", space.id);
      space.shell = ReadShell(node);
      at_.clear();
      if (!space_by_id_.emplace(space.id, SpaceId(model_.spaces.size()))
               .second) {
        Fail(fmt::format("two Spaces have the id '{}'", space.id));
      }
      model_.spaces.push_back(std::move(space));
    }
  }

  [[nodiscard]] std::vector<std::vector<Point3>> ReadShell(
      const pugi::xml_node& space) const {
    std::vector<std::vector<Point3>> shell;
    const pugi::xml_node closed =
        ChildOf(ChildOf(space, "ShellGeometry"), "ClosedShell");
    for (const pugi::xml_node& loop : closed.children()) {
      if (Is(loop, "PolyLoop")) {
        shell.push_back(ReadLoop(loop));
      }
    }
    return shell;
  }

  void ReadSurface(const pugi::xml_node& node) {
    GbxmlSurface surface;
    surface.id = node.attribute("id").as_string("without id");
    at_ = fmt::format("Surface '{}'", surface.id);
    surface.name = NameOf(node, surface.id);
    surface.type = node.attribute("surfaceType").as_string("Surface");
    surface.polygon = ReadPolygon(node);
    size_t neighbours = 0;
    for (const pugi::xml_node& child : node.children()) {
      if (Is(child, "AdjacentSpaceId")) {
        if (++neighbours > 2) {
          Fail("more than two AdjacentSpaceId");
        }
        (neighbours == 1 ? surface.first : surface.second) =
            FindSpace(child.attribute("spaceIdRef").as_string());
      } else if (Is(child, "Opening")) {
        GbxmlOpening opening;
        opening.type = child.attribute("openingType").as_string("Opening");
        opening.polygon = ReadPolygon(child);
        surface.openings.push_back(std::move(opening));
      }
    }
    model_.surfaces.push_back(std::move(surface));
  }

  [[nodiscard]] std::optional<SpaceId> FindSpace(const std::string& id) const {
    const auto it = space_by_id_.find(id);
    if (it != space_by_id_.end()) {
      return it->second;
    }
    if (!strip_spaces_) {
      Fail(
          fmt::format("AdjacentSpaceId '{}' names no Space; correct it, or "
                      "give --strip-spaces",
                      id));
    }
    return std::nullopt;
  }

  [[nodiscard]] std::vector<Point3> ReadPolygon(
      const pugi::xml_node& node) const {
    const pugi::xml_node loop =
        ChildOf(ChildOf(node, "PlanarGeometry"), "PolyLoop");
    if (!loop) {
      Fail(fmt::format("{} without PlanarGeometry/PolyLoop", node.name()));
    }
    return ReadLoop(loop);
  }

  [[nodiscard]] std::vector<Point3> ReadLoop(const pugi::xml_node& loop) const {
    std::vector<Point3> polygon;
    for (const pugi::xml_node& point : loop.children()) {
      if (Is(point, "CartesianPoint")) {
        polygon.push_back(ReadPoint(point));
      }
    }
    return polygon;
  }

  [[nodiscard]] Point3 ReadPoint(const pugi::xml_node& node) const {
    double xyz[3] = {0, 0, 0};
    size_t count = 0;
    for (const pugi::xml_node& coordinate : node.children()) {
      if (!Is(coordinate, "Coordinate")) {
        continue;
      }
      const std::string text = TextOf(coordinate);
      const std::vector<std::string_view> words = Words(text);
      if (count == 3 || words.size() != 1 || !IsNumber(words[0])) {
        Fail(
            fmt::format("a CartesianPoint with coordinate '{}': give three "
                        "finite numbers",
                        text));
      }
      xyz[count++] = *ToNumber(words[0]);
    }
    if (count != 3) {
      Fail("a CartesianPoint needs three coordinates");
    }
    const Point3 p{xyz[0] * unit_, xyz[1] * unit_, xyz[2] * unit_};
    if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) >
        kFarthestMetres) {
      Fail(fmt::format(
          "a CartesianPoint {:.4g}, {:.4g}, {:.4g} in {}: farther "
          "from the origin than a map is wide; correct it, or the lengthUnit",
          xyz[0],
          xyz[1],
          xyz[2],
          unit_name_));
    }
    return p;
  }

  // Rejects a model with a stray point or a wrong unit: tolerances in metres
  // would not fit it, and indexing it in plan would take too long.
  void CheckSize() const {
    Box3 bounds;
    for (const GbxmlSurface& surface : model_.surfaces) {
      Box3 own;
      for (const Point3 p : surface.polygon) {
        own.Include(p);
        bounds.Include(p);
      }
      CheckExtent(own, fmt::format("Surface '{}' is", surface.id));
      CheckExtent(bounds,
                  fmt::format("the model up to Surface '{}' is", surface.id));
    }
    const Vec3 extent = bounds.Extent();
    const double size = std::max({extent.x, extent.y, extent.z});
    if (size >= 0 && size < kSmallestMetres) {
      Fail(
          fmt::format("the model is {:.4g} m long by its lengthUnit '{}', "
                      "which is no building's size; correct the lengthUnit",
                      size,
                      unit_name_));
    }
  }

  void CheckExtent(const Box3& box, const std::string& what) const {
    const Vec3 extent = box.Extent();
    const double size = std::max({extent.x, extent.y, extent.z});
    if (size > kLargestMetres) {
      Fail(
          fmt::format("{} {:.4g} m long by the lengthUnit '{}', which is no "
                      "building's size; correct its points, or the lengthUnit",
                      what,
                      size,
                      unit_name_));
    }
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(at_.empty() ? fmt::format("{}: {}", file_, what)
                                 : fmt::format("{}: {}: {}", file_, at_, what));
  }

  std::string file_;
  bool strip_spaces_;
  std::string at_;
  std::string unit_name_;
  double unit_ = 1.0;
  std::map<std::string, SpaceId> space_by_id_;
  GbxmlModel model_;
};

uint64_t BytesOf(const std::string& text) {
  constexpr size_t kInPlace = 15;
  return text.capacity() > kInPlace ? AllocatedBytes(text.capacity() + 1) : 0;
}

uint64_t BytesOf(const std::vector<Point3>& polygon) {
  return AllocatedBytes(polygon.capacity() * sizeof(Point3));
}

uint64_t BytesOf(const GbxmlModel& model) {
  uint64_t bytes = model.surfaces.capacity() * sizeof(GbxmlSurface) +
                   model.spaces.capacity() * sizeof(GbxmlSpace);
  for (const GbxmlSurface& surface : model.surfaces) {
    bytes += BytesOf(surface.id) + BytesOf(surface.name) +
             BytesOf(surface.type) + BytesOf(surface.polygon) +
             surface.openings.capacity() * sizeof(GbxmlOpening);
    for (const GbxmlOpening& opening : surface.openings) {
      bytes += BytesOf(opening.type) + BytesOf(opening.polygon);
    }
  }
  for (const GbxmlSpace& space : model.spaces) {
    bytes += BytesOf(space.id) + BytesOf(space.name) +
             space.shell.capacity() * sizeof(std::vector<Point3>);
    for (const std::vector<Point3>& polygon : space.shell) {
      bytes += BytesOf(polygon);
    }
  }
  return bytes;
}

}  // namespace

uint64_t BytesToReadGbxml(const std::filesystem::path& path) {
  uint64_t bytes = 0;
  uint64_t tags = 0;
  uint64_t attributes = 0;
  VisitFile(path, kMostXmlBytes, [&](std::span<const char> text) {
    bytes += text.size();
    tags += static_cast<uint64_t>(std::count(text.begin(), text.end(), '<'));
    attributes +=
        static_cast<uint64_t>(std::count(text.begin(), text.end(), '='));
  });
  return std::max(kTreePerByte * bytes,
                  bytes + kTreePerTag * tags + kTreePerAttribute * attributes);
}

namespace {

// The line on which parsing ended. The parser counts bytes of UTF-8, to which
// it converts a UTF-16 file first.
std::ptrdiff_t LineOfEnd(const std::string& text,
                         const pugi::xml_parse_result& result) {
  const bool is_big = result.encoding == pugi::encoding_utf16_be;
  if (!is_big && result.encoding != pugi::encoding_utf16_le) {
    const auto bytes = std::clamp<std::ptrdiff_t>(
        result.offset, 0, static_cast<std::ptrdiff_t>(text.size()));
    return 1 + std::count(text.begin(), text.begin() + bytes, '\n');
  }
  std::ptrdiff_t line = 1;
  std::ptrdiff_t bytes = 0;
  for (size_t i = 0; i + 1 < text.size() && bytes < result.offset; i += 2) {
    const auto low = static_cast<uint8_t>(text[is_big ? i + 1 : i]);
    const auto high = static_cast<uint8_t>(text[is_big ? i : i + 1]);
    const uint32_t unit = uint32_t{high} << 8 | low;
    line += unit == '\n' ? 1 : 0;
    // Both halves of a pair of surrogates together have 4.
    const bool is_surrogate = unit >= 0xD800 && unit < 0xE000;
    bytes += unit < 0x80 ? 1 : unit < 0x800 || is_surrogate ? 2 : 3;
  }
  return line;
}

}  // namespace

GbxmlModel ReadGbxmlModel(const std::filesystem::path& path,
                          bool strip_spaces,
                          MemoryBudget& budget) {
  MemoryCharge charge(budget, BytesToReadGbxml(path), "reading the gbXML file");
  std::string text = ReadWholeFile(path, kMostXmlBytes);
  pugi::xml_document document;
  const pugi::xml_parse_result result =
      document.load_buffer_inplace(text.data(), text.size());
  if (!result) {
    text = ReadWholeFile(path, kMostXmlBytes);  // parsing has changed the text
    throw InputError(fmt::format("{}:{}: not valid XML: {}",
                                 path.string(),
                                 LineOfEnd(text, result),
                                 result.description()));
  }
  GbxmlModel model = ModelReader(path, strip_spaces).Read(document);
  charge.ShrinkTo(BytesOf(model));
  model.charge = std::move(charge);
  return model;
}

}  // namespace enfilade
