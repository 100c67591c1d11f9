#include "scene/gbxml_reader.h"

#include "base/planar_polygon.h"
#include "scene/figure_cut.h"
#include "scene/gbxml_model.h"
#include "scene/gbxml_repair.h"
#include "scene/gbxml_shells.h"

#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Reflectances of common finishes by surface type (floors 0.2, walls 0.5,
// ceilings 0.7). A face between two storeys is both floor and ceiling.
double DefaultReflectance(std::string_view type) {
  const std::pair<std::string_view, double> known[] = {
      {"Roof", 0.7},
      {"Ceiling", 0.7},
      {"UndergroundCeiling", 0.7},
      {"InteriorFloor", 0.4},
      {"RaisedFloor", 0.2},
      {"SlabOnGrade", 0.2},
      {"UndergroundSlab", 0.2},
      {"ExposedFloor", 0.2},
      {"Shade", 0.3},
      {"FixedWindow", 0.1},
      {"OperableWindow", 0.1},
      {"FixedSkylight", 0.1},
      {"OperableSkylight", 0.1}};
  for (const auto& [name, reflectance] : known) {
    if (type == name) {
      return reflectance;
    }
  }
  return 0.5;
}

bool IsDoor(std::string_view opening_type) {
  return opening_type.ends_with("Door");
}

bool IsAir(std::string_view type) {
  return type == "Air";
}

// The area vectors of a closed, consistently wound surface add up to zero.
bool HasClosedShell(const GbxmlSpace& space) {
  constexpr double kTolerance = 1e-3;
  Vec3 sum;
  double area = 0;
  for (const std::vector<Point3>& polygon : space.shell) {
    sum = sum + AreaVector(polygon);
    area += PolygonArea(polygon);
  }
  return area > 0 && Length(sum) < kTolerance * area;
}

// Turns one model into faces.
class GbxmlImport {
 public:
  GbxmlImport(GbxmlModel model,
              const GbxmlInput& input,
              MaterialTable& materials,
              MemoryBudget& budget,
              SceneWriter& writer,
              SceneInfo& info)
      : model_(std::move(model)),
        file_(input.path.string()),
        strip_spaces_(input.strip_spaces),
        materials_(materials),
        budget_(budget),
        writer_(writer),
        info_(info) {}

  void Run() {
    CountPolygons();
    repair_ = RepairGbxmlModel(budget_, model_);
    info_.greatest_move_m = repair_.cracks.greatest_move_m;
    GbxmlShells shells(model_);
    AddSpaces(shells);
    Count();
    for (size_t i = 0; i < model_.surfaces.size(); ++i) {
      face_.object = ObjectId(i);
      std::tie(face_.front_space, face_.back_space) = shells.SidesOf(i);
      Import(model_.surfaces[i]);
    }
    Notes(shells);
  }

 private:
  void CountPolygons() {
    info_.gbxml.emplace();
    info_.gbxml->surfaces = static_cast<uint32_t>(model_.surfaces.size());
    info_.input_polygons = model_.surfaces.size();
    for (const GbxmlSurface& s : model_.surfaces) {
      info_.input_polygons += s.openings.size();
    }
  }

  void AddSpaces(const GbxmlShells& shells) {
    for (size_t i = 0; i < model_.spaces.size(); ++i) {
      Space space;
      space.name = model_.spaces[i].name;
      space.bounds = shells.BoundsOf(SpaceId(i));
      space.closed = shells.IsClosed(SpaceId(i));
      info_.spaces.push_back(std::move(space));
    }
  }

  void Count() {
    GbxmlCounts& counts = *info_.gbxml;
    counts.spaces = static_cast<uint32_t>(model_.spaces.size());
    for (const Space& space : info_.spaces) {
      counts.closed_spaces += space.closed ? 1U : 0U;
    }
    for (const GbxmlSpace& space : model_.spaces) {
      counts.closed_shells += HasClosedShell(space) ? 1U : 0U;
    }
    for (const GbxmlSurface& s : model_.surfaces) {
      if (!s.second || !Separates(s)) {
        continue;
      }
      counts.open_boundaries += IsAir(s.type) ? 1U : 0U;
      for (const GbxmlOpening& o : s.openings) {
        counts.interior_doors += IsDoor(o.type) ? 1U : 0U;
        counts.open_boundaries += IsAir(o.type) && !IsAir(s.type) ? 1U : 0U;
      }
    }
  }

  // Imports a Surface and its Openings, with the Spaces that face_ has.
  void Import(const GbxmlSurface& surface) {
    const Vec3 normal = AreaVector(surface.polygon);
    std::vector<Edge3> edges;
    AppendEdges(surface.polygon, false, edges);
    const std::vector<Edge3> outline = edges;
    const std::optional<MaterialId> material =
        MaterialOf(surface.type, surface.name, IsAir(surface.type));
    if (!material) {
      AddOpening(CutOutline(outline, normal));
      return;
    }
    for (const GbxmlOpening& opening : surface.openings) {
      const bool reversed = Dot(AreaVector(opening.polygon), normal) < 0;
      AppendEdges(opening.polygon, !reversed, edges);
      ImportOpening(opening, surface, outline, reversed);
    }
    AddFaces(*material,
             surface.openings.empty()
                 ? CutOutline(outline, normal)
                 : CutFigure(edges, normal, kCutToleranceMetres));
  }

  // Imports the part of the opening that lies in its Surface.
  void ImportOpening(const GbxmlOpening& opening,
                     const GbxmlSurface& surface,
                     std::vector<Edge3> edges,
                     bool reversed) {
    AppendEdges(opening.polygon, reversed, edges);
    const std::vector<Polygon3> pieces =
        CutFigure(edges, AreaVector(surface.polygon), kCutToleranceMetres, 2);
    outside_ += pieces.empty() ? 1U : 0U;
    const std::optional<MaterialId> material =
        MaterialOf(opening.type, surface.name, true);
    if (material) {
      AddFaces(*material, pieces);
    } else {
      AddOpening(pieces);
    }
  }

  static std::vector<Polygon3> CutOutline(const std::vector<Edge3>& outline,
                                          Vec3 normal) {
    std::optional<Polygon3> convex = AsConvex(outline, normal);
    if (convex) {
      Polygon3 corners = Straightened(*convex, kCutToleranceMetres);
      if (corners.size() >= 3) {
        return {std::move(corners)};
      }
    }
    return CutFigure(outline, normal, kCutToleranceMetres);
  }

  void AddFaces(MaterialId material, const std::vector<Polygon3>& pieces) {
    face_.material = material;
    face_.surface_m2 = TotalArea(pieces);
    for (const Polygon3& piece : pieces) {
      face_.vertices = piece;
      Face face = face_;
      if (strip_spaces_) {
        face.front_space.reset();
        face.back_space.reset();
      }
      writer_.Add(face);
    }
  }

  // Adds openings, unless both sides are the same Space or the outside.
  void AddOpening(const std::vector<Polygon3>& pieces) {
    if (face_.front_space == face_.back_space) {
      return;
    }
    for (const Polygon3& piece : pieces) {
      info_.openings.push_back({piece, face_.front_space, face_.back_space});
    }
  }

  std::optional<MaterialId> MaterialOf(const std::string& type,
                                       const std::string& object,
                                       bool clear) {
    const auto [it, is_new] = input_by_type_.try_emplace({type, clear}, 0);
    if (is_new) {
      Material material;
      material.name = type;
      material.reflectance.fill(DefaultReflectance(type));
      material.clear = clear;
      it->second = materials_.AddInput(std::move(material), file_);
    }
    return materials_.Resolve(it->second, object, type);
  }

  void Notes(const GbxmlShells& shells) {
    const auto add = [&](uint64_t count, const char* text) {
      if (count > 0) {
        info_.notes.push_back(fmt::format("{} {}", count, text));
      }
    };
    if (!model_.has_unit) {
      info_.notes.emplace_back(
          "the file says no lengthUnit; its coordinates were taken as metres");
    }
    if (repair_.cracks.moved > 0) {
      info_.notes.push_back(fmt::format(
          "{} vertices were moved by up to {:.1f} mm to where surfaces meet",
          repair_.cracks.moved,
          1e3 * repair_.cracks.greatest_move_m));
    }
    if (repair_.dropped > 0) {
      info_.notes.push_back(fmt::format(
          "{} polygons without area were dropped, the first of Surface '{}'",
          repair_.dropped,
          repair_.first_dropped));
    }
    add(shells.Turned(),
        "surfaces are wound against the rule that their normal points out of "
        "their first Space; their sides were found from the Spaces' shells");
    add(outside_,
        "openings lie outside of their Surface and were left out; correct "
        "their points, or make them Openings of the Surface that they are in");
    add(shells.Unclear(),
        "surfaces lie in shells too broken to tell their sides; the file's "
        "winding was believed");
    add(info_.gbxml->spaces - info_.gbxml->closed_spaces,
        "Spaces have shells that don't close");
  }

  GbxmlModel model_;
  std::string file_;
  bool strip_spaces_;
  MaterialTable& materials_;
  MemoryBudget& budget_;
  SceneWriter& writer_;
  SceneInfo& info_;
  std::map<std::pair<std::string, bool>, size_t> input_by_type_;
  Face face_;
  GbxmlRepair repair_;
  uint64_t outside_ = 0;  // openings
};

}  // namespace

void ReadGbxml(const GbxmlInput& input,
               MaterialTable& materials,
               MemoryBudget& budget,
               SceneWriter& writer,
               SceneInfo& info) {
  GbxmlModel model = ReadGbxmlModel(input.path, input.strip_spaces, budget);
  GbxmlImport(std::move(model), input, materials, budget, writer, info).Run();
  if (input.strip_spaces) {
    info.spaces.clear();
    info.openings.clear();
  }
}

}  // namespace enfilade
