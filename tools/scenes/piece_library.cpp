#include "tools/scenes/piece_library.h"

#include "base/error.h"
#include "base/hash.h"
#include "base/lower_case.h"
#include "scene/material_table.h"
#include "scene/obj_reader.h"
#include "scene/polygon_sink.h"
#include "scene/scene_store.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <span>
#include <system_error>

#include "tools/scenes/obj_writer.h"

namespace enfilade {

namespace {

constexpr uint64_t kReadingBytes = uint64_t{256} << 20;
constexpr double kLongestInMetres = 10;
constexpr double kCentimetre = 0.01;
constexpr double kMostReflectance = 0.9;

// The reflectances of materials that no MTL file describes: woods, metals,
// fabrics, whites.
constexpr std::array<Rgb, 8> kColours = {{{0.55, 0.40, 0.25},
                                          {0.70, 0.68, 0.64},
                                          {0.35, 0.22, 0.12},
                                          {0.50, 0.50, 0.52},
                                          {0.45, 0.14, 0.12},
                                          {0.14, 0.22, 0.42},
                                          {0.20, 0.20, 0.20},
                                          {0.62, 0.55, 0.40}}};

Material ColourByName(const std::string& name) {
  const uint64_t hash = HashBytes(std::as_bytes(std::span(name)));
  Material material;
  material.name = name;
  material.reflectance = kColours[hash % kColours.size()];
  return material;
}

// The faces of one file, their vertices mapped by `place`, and its materials.
class PieceReading {
 public:
  PieceReading(const std::filesystem::path& path,
               std::function<Point3(Point3)> place)
      : store_(CreateStoreInMemory()),
        budget_(kReadingBytes),
        materials_(Overrides(), std::nullopt, budget_) {
    SceneWriter writer(*store_);
    PolygonSink sink(budget_, writer);
    ObjInput input;
    input.path = path;
    input.place = std::move(place);
    input.unknown_material = &ColourByName;
    ReadObj(input, materials_, budget_, *store_, sink);
    writer.Flush();
  }

  void ForEach(const std::function<void(const Face&)>& visit) const {
    ForEachFace(*store_, [&](FaceId, const Face& face) { visit(face); });
  }

  [[nodiscard]] Box3 Bounds() const {
    Box3 box;
    ForEach([&](const Face& face) { box.Include(BoundsOf(face.vertices)); });
    return box;
  }

  [[nodiscard]] const std::vector<Material>& Materials() const {
    return materials_.Materials();
  }

 private:
  std::unique_ptr<BlockStorage> store_;
  MemoryBudget budget_;
  MaterialTable materials_;
};

// Converts a point to Z up. The rear of a piece with Y up is at -Z and comes to
// lie at -y.
Point3 Upright(Point3 p, bool z_is_up) {
  return z_is_up ? p : Point3{-p.x, p.z, p.y};
}

bool IsObj(const std::filesystem::path& path) {
  const std::string name = LowerCase(path.filename().string());
  return name.ends_with(".obj") || name.ends_with(".obj.gz");
}

std::vector<std::filesystem::path> ObjFilesIn(
    const std::filesystem::path& folder) {
  std::error_code code;
  if (!std::filesystem::is_directory(folder, code)) {
    throw InputError(fmt::format(
        "{}: is not a folder; give one that holds OBJ files", folder.string()));
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_regular_file() && IsObj(entry.path())) {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) {
    throw InputError(fmt::format(
        "{}: holds no OBJ file; pieces are files that end in .obj or .obj.gz",
        folder.string()));
  }
  std::sort(files.begin(), files.end());
  return files;
}

// The name of a piece, from that of its file: only letters, digits and '-',
// which are safe in a path. The name must not hold an underscore, because the
// last underscore of an object's name ends the name of its room.
std::string PlainName(const std::filesystem::path& path) {
  std::string name = path.filename().string();
  name.resize(name.find('.'));
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) {
      c = '-';
    }
  }
  return name.empty() ? "piece" : name;
}

double Longest(const Box3& box) {
  const Vec3 extent = box.Extent();
  return std::max({extent.x, extent.y, extent.z});
}

// Names of instances' files and of materials end at a blank.
std::string WithoutBlanks(std::string name) {
  std::replace_if(
      name.begin(),
      name.end(),
      [](unsigned char c) { return std::isspace(c) != 0; },
      '_');
  return name;
}

// Names that have been given, each once.
class UniqueNames {
 public:
  // `name`, with a number behind it if it is taken.
  std::string Give(const std::string& name) {
    std::string unique = name;
    for (int n = 2; !given_.insert(unique).second; ++n) {
      unique = fmt::format("{}-{}", name, n);
    }
    return unique;
  }

 private:
  std::set<std::string> given_;
};

class PieceCopier {
 public:
  PieceCopier(const PieceOptions& options,
              const std::filesystem::path& scene_obj,
              const NoteSink& note)
      : options_(options),
        note_(note),
        scene_folder_(scene_obj.parent_path()),
        folder_(WithoutBlanks(scene_obj.stem().string()) + "_pieces") {}

  std::vector<Piece> Copy() {
    const auto files = ObjFilesIn(options_.folder);
    std::vector<Box3> boxes;
    boxes.reserve(files.size());
    for (const auto& file : files) {
      boxes.push_back(PieceReading(file, {}).Bounds());
    }
    ChooseUnit(boxes);
    MakeFolder();
    std::vector<Piece> pieces;
    for (size_t i = 0; i < files.size(); ++i) {
      if (boxes[i].IsEmpty()) {
        Note(
            fmt::format("{} has no faces and was left out", files[i].string()));
      } else {
        pieces.push_back(CopyOne(files[i], boxes[i]));
      }
    }
    if (pieces.empty()) {
      throw InputError(fmt::format("{}: none of its {} OBJ files has a face",
                                   options_.folder.string(),
                                   files.size()));
    }
    return pieces;
  }

 private:
  void Note(const std::string& text) const {
    if (note_) {
      note_(text);
    }
  }

  void ChooseUnit(const std::vector<Box3>& boxes) {
    unit_ = options_.metres_per_unit;
    if (unit_ > 0) {
      return;
    }
    const bool long_ones =
        std::any_of(boxes.begin(), boxes.end(), [](const Box3& box) {
          return !box.IsEmpty() && Longest(box) > kLongestInMetres;
        });
    unit_ = long_ones ? kCentimetre : 1.0;
    Note(fmt::format("the unit of the pieces is taken as {}",
                     long_ones ? "a centimetre" : "a metre"));
  }

  void MakeFolder() const {
    std::error_code code;
    std::filesystem::create_directories(scene_folder_ / folder_, code);
    if (code) {
      throw DiskError(fmt::format("{}: cannot be created: {}",
                                  (scene_folder_ / folder_).string(),
                                  code.message()));
    }
  }

  // `box` bounds the faces of the file before they are moved and scaled.
  Piece CopyOne(const std::filesystem::path& file, const Box3& box) {
    const Point3 a = Upright(box.low, options_.z_is_up);
    const Point3 b = Upright(box.high, options_.z_is_up);
    const Point3 foot = {(a.x + b.x) / 2, (a.y + b.y) / 2, std::min(a.z, b.z)};
    const PieceReading reading(file, [&](Point3 p) {
      const Vec3 q = Upright(p, options_.z_is_up) - foot;
      return Point3{unit_ * q.x, unit_ * q.y, unit_ * q.z};
    });
    Piece piece;
    piece.name = names_.Give(PlainName(file));
    piece.file = folder_ / (piece.name + ".obj");
    const Vec3 size = reading.Bounds().Extent();
    piece.width = size.x;
    piece.depth = size.y;
    piece.height = size.z;
    ObjWriter out(scene_folder_ / piece.file);
    const std::vector<MaterialId> ids = Define(reading.Materials(), out);
    reading.ForEach([&](const Face& face) {
      out.UseMaterial(ids[face.material.Index()]);
      out.AddPolygon(face.vertices);
    });
    out.Finish();
    piece.polygons = out.Polygons();
    return piece;
  }

  static std::vector<MaterialId> Define(const std::vector<Material>& materials,
                                        ObjWriter& out) {
    std::vector<MaterialId> ids;
    UniqueNames names;
    for (const Material& m : materials) {
      ObjMaterial copy = {names.Give(WithoutBlanks(m.name)),
                          m.reflectance,
                          m.exitance,
                          m.sides};
      for (double& rho : copy.reflectance) {
        rho = std::clamp(rho, 0.0, kMostReflectance);
      }
      ids.push_back(out.DefineMaterial(copy));
    }
    return ids;
  }

  const PieceOptions& options_;
  const NoteSink& note_;
  std::filesystem::path scene_folder_;
  std::filesystem::path folder_;
  double unit_ = 1;
  UniqueNames names_;
};

}  // namespace

std::vector<Piece> CopyPieces(const PieceOptions& options,
                              const std::filesystem::path& scene_obj,
                              const NoteSink& note) {
  if (!(options.metres_per_unit >= 0 &&
        std::isfinite(options.metres_per_unit))) {
    throw UsageError(fmt::format("--piece-unit {}: must be above 0",
                                 options.metres_per_unit));
  }
  return PieceCopier(options, scene_obj, note).Copy();
}

}  // namespace enfilade
