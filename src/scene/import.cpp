#include "scene/import.h"

#include "base/check.h"
#include "base/error.h"
#include "base/hash.h"
#include "base/lower_case.h"
#include "scene/default_luminaires.h"
#include "scene/gbxml_model.h"
#include "scene/gbxml_reader.h"
#include "scene/input_file.h"
#include "scene/material_table.h"
#include "scene/obj_files.h"
#include "scene/obj_import.h"
#include "scene/overrides.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace enfilade {
namespace {

enum class SceneFormat { kObj, kGbxml };

// The format by the name's extension, a trailing .gz aside.
std::optional<SceneFormat> FormatByName(const std::filesystem::path& scene) {
  std::string name = LowerCase(scene.filename().string());
  if (name.ends_with(".gz")) {
    name.resize(name.size() - 3);
  }
  if (name.ends_with(".obj")) {
    return SceneFormat::kObj;
  }
  if (name.ends_with(".xml") || name.ends_with(".gbxml")) {
    return SceneFormat::kGbxml;
  }
  return std::nullopt;
}

SceneFormat FormatOf(const std::filesystem::path& scene) {
  if (const auto format = FormatByName(scene)) {
    return *format;
  }
  throw InputError(fmt::format(
      "{}: unknown kind of scene; known are .obj, .xml and .gbxml, each also "
      "with .gz; to go on with a store, use 'enfilade resume'",
      scene.string()));
}

// A hash of files that takes its input in pieces. The borders of the files
// change the hash; the borders of the pieces do not.
class RunningHash {
 public:
  void Add(std::span<const char> text) {
    bytes_ += text.size();
    pending_.insert(pending_.end(), text.begin(), text.end());
    while (pending_.size() - begin_ >= kChunkBytes) {
      hash_ = HashBytes(
          std::as_bytes(std::span(pending_).subspan(begin_, kChunkBytes)),
          hash_);
      begin_ += kChunkBytes;
    }
    pending_.erase(pending_.begin(),
                   pending_.begin() + static_cast<std::ptrdiff_t>(begin_));
    begin_ = 0;
  }

  void AddFile(const std::filesystem::path& path) {
    InputFile file(path);
    std::vector<char> chunk(kChunkBytes);
    while (const size_t got = file.Read(chunk)) {
      Add(std::span(chunk).first(got));
    }
    EndFile();
  }

  void EndFile() { Add(fmt::format("|{}|", bytes_)); }

  [[nodiscard]] uint64_t Value() const {
    return HashBytes(std::as_bytes(std::span(pending_)), hash_);
  }

 private:
  static constexpr size_t kChunkBytes = size_t{1} << 16;

  std::vector<char> pending_;
  size_t begin_ = 0;
  uint64_t bytes_ = 0;
  uint64_t hash_ = 0;
};

void CheckOptions(const ImportOptions& options, SceneFormat format) {
  if (options.sides && *options.sides != 1 && *options.sides != 2) {
    throw UsageError(
        fmt::format("--sides {} is neither 1 nor 2", *options.sides));
  }
  if (options.unit && format != SceneFormat::kObj) {
    throw UsageError("--unit is for OBJ files; a gbXML file says its own");
  }
}

void CheckHasFaces(const std::filesystem::path& scene,
                   const SceneInfo& info,
                   const Box3& bounds) {
  if (bounds.low.x <= bounds.high.x) {
    return;
  }
  throw InputError(fmt::format(
      "{}: no surface is left of {} polygons ({}); materials with a d below "
      "one half are clear unless an override file says {{\"clear\": false}}",
      scene.string(),
      info.input_polygons,
      fmt::join(info.notes, ", ")));
}

// Rejects sizes that no building has: the unit is then a wrong one, and the
// tolerances in metres would not fit the scene.
// Returns a note if the size is unlikely.
std::string CheckSize(const std::filesystem::path& scene,
                      const Box3& bounds,
                      bool is_told) {
  constexpr double kLargestM = 2000;
  constexpr double kSmallestM = 0.5;
  constexpr double kSmallestToldM = 1e-3;
  constexpr double kLargestToldM = 1e5;
  const Vec3 extent = bounds.Extent();
  const double size = std::max({extent.x, extent.y, extent.z});
  if (is_told && !(size >= kSmallestToldM && size <= kLargestToldM)) {
    throw InputError(fmt::format(
        "{}: the scene is {:.4g} m long by the --unit that was given; what is "
        "less than {} m or more than {:.0f} m long cannot be solved",
        scene.string(),
        size,
        kSmallestToldM,
        kLargestToldM));
  }
  if (!is_told && (size > kLargestM || size < kSmallestM)) {
    throw InputError(fmt::format(
        "{}: the scene is {:.4g} units long, which is no building's size in "
        "metres; say what the unit is with --unit mm, cm, m (if it is), km, in "
        "or ft",
        scene.string(),
        size));
  }
  return size > kLargestM || size < kSmallestM
             ? fmt::format(
                   "the scene is {:.4g} m long by the --unit that was given; "
                   "if it is not, solve it anew with the right one",
                   size)
             : std::string();
}

void CheckHasLight(const std::filesystem::path& scene,
                   const std::vector<Material>& used) {
  if (std::none_of(used.begin(), used.end(), Emits)) {
    throw InputError(fmt::format(
        "{}: nothing emits light; add --default-luminaires, or give a material "
        "an exitance (Ke in the MTL file, or an override file: "
        "{{\"materials\": {{\"GLOB\": {{\"exitance\": 100}}}}}})",
        scene.string()));
  }
}

// Adds the panels of --default-luminaires if nothing emits yet.
void AddDefaultLuminaires(const std::filesystem::path& scene,
                          const BlockStorage& store,
                          MemoryBudget& budget,
                          SceneWriter& writer,
                          SceneInfo& info) {
  if (std::any_of(info.materials.begin(), info.materials.end(), Emits)) {
    info.notes.emplace_back(
        "no default luminaires were laid: the scene has lights of its own");
    return;
  }
  LuminaireInput input;
  input.has_spaces = !info.spaces.empty();
  input.y_is_up = !info.gbxml && writer.IsYUp();
  input.openings = info.openings;
  input.material = MaterialId(info.materials.size());
  const uint64_t laid = LayDefaultLuminaires(
      store, input, budget, [&](const Face& panel) { writer.Add(panel); });
  const char up_axis = input.y_is_up ? 'y' : 'z';
  if (laid == 0) {
    throw InputError(fmt::format(
        "{}: no ceiling was found to lay default luminaires on (taking {} as "
        "up and the unit as a metre); give a material an exitance instead{}",
        scene.string(),
        up_axis,
        input.has_spaces
            ? ", or add --strip-spaces if the surfaces do not say which Spaces "
              "they bound"
            : ""));
  }
  info.materials.push_back(DefaultLuminaireMaterial(info.photometric));
  info.notes.push_back(
      fmt::format("{} default luminaires were laid below ceilings; {} is up",
                  laid,
                  up_axis));
}

// What reading the override file takes, by its size: its text, the library's
// tree of values, and the rules.
MemoryCharge ChargeOverrides(const ImportOptions& options,
                             MemoryBudget& budget) {
  constexpr uint64_t kCopies = 20;
  std::error_code unreadable;  // reported when it is read
  const uintmax_t bytes =
      options.overrides
          ? std::filesystem::file_size(*options.overrides, unreadable)
          : 0;
  return {budget, unreadable ? 0 : kCopies * bytes, "the override file"};
}

}  // namespace

bool IsSceneName(const std::filesystem::path& path) {
  return FormatByName(path).has_value();
}

uint64_t BytesToImport(const std::filesystem::path& scene) {
  return FormatOf(scene) == SceneFormat::kGbxml ? BytesToReadGbxml(scene) : 0;
}

SceneHash HashSceneFiles(const std::filesystem::path& scene,
                         const ImportOptions& options) {
  if (!Exists(scene) || (options.overrides && !Exists(*options.overrides))) {
    return {.is_there = false, .is_whole = false};
  }
  RunningHash hash;
  bool is_whole = true;
  if (FormatOf(scene) == SceneFormat::kObj) {
    const ObjFiles files = FilesBehindObj(
        scene, [&](std::span<const char> text) { hash.Add(text); });
    hash.EndFile();
    for (const auto& path : files.existing) {
      hash.AddFile(path);
    }
    is_whole = !files.some_missing;
  } else {
    hash.AddFile(scene);
  }
  if (options.overrides) {
    hash.AddFile(*options.overrides);
  }
  hash.Add(fmt::format("|{} {} {} {} {}",
                       options.overrides.has_value(),
                       options.default_luminaires,
                       options.photometric,
                       options.sides.value_or(0),
                       options.strip_spaces));
  if (options.unit) {
    hash.Add(fmt::format(" {}", *options.unit));
  }
  return {.value = hash.Value(), .is_whole = is_whole};
}

SceneInfo ImportScene(const std::filesystem::path& scene,
                      const ImportOptions& options,
                      MemoryBudget& budget,
                      BlockStorage& store) {
  ENFILADE_CHECK(store.Count(BlockKind::kFaces) == 0,
                 "the store holds a scene already");
  const SceneFormat format = FormatOf(scene);
  CheckOptions(options, format);
  SceneInfo info;
  info.source_path = scene.string();
  // Reading the scene says which file is missing, if it is needed.
  const SceneHash hash = HashSceneFiles(scene, options);
  info.source_hash = hash.value;
  info.lacks_files = !hash.is_whole;
  info.photometric = options.photometric;
  const MemoryCharge overrides_charge = ChargeOverrides(options, budget);
  const Overrides overrides =
      options.overrides ? Overrides::Load(*options.overrides) : Overrides();
  MaterialTable materials(overrides, options.sides, budget);
  SceneWriter writer(store);
  if (format == SceneFormat::kObj) {
    ImportObj(
        scene, options, {overrides, materials, budget, store, writer}, info);
  } else {
    ReadGbxml({scene, options.strip_spaces}, materials, budget, writer, info);
  }
  writer.Flush();
  materials.ThrowIfRefused();
  if (format == SceneFormat::kObj) {
    CheckHasFaces(scene, info, writer.Bounds());
    std::string note =
        CheckSize(scene, writer.Bounds(), options.unit.has_value());
    if (!note.empty()) {
      info.notes.push_back(std::move(note));
    }
  }
  for (std::string& note : materials.NotesOnUnusedRules()) {
    info.notes.push_back(std::move(note));
  }
  info.materials = materials.Materials();
  if (options.default_luminaires) {
    AddDefaultLuminaires(scene, store, budget, writer, info);
  }
  CheckHasLight(scene, info.materials);
  return writer.Finish(std::move(info));
}

}  // namespace enfilade
