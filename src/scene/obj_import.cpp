#include "scene/obj_import.h"

#include "base/error.h"
#include "scene/obj_reader.h"
#include "scene/polygon_sink.h"
#include "scene/rounded_walls.h"
#include "scene/rounding_survey.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Says what became of the polygons of an OBJ. Throws if there were none.
void AddCounts(const std::filesystem::path& scene,
               const ObjCounts& counts,
               const CleaningCounts& cleaning,
               SceneInfo& info) {
  info.input_polygons = counts.polygons;
  if (counts.polygons == 0) {
    throw InputError(fmt::format(
        "{}: there is no polygon in it; is it a Wavefront OBJ file?",
        scene.string()));
  }
  if (!counts.absent.empty()) {
    info.notes.push_back(
        fmt::format("material file {} does not exist", counts.absent));
  }
  if (counts.described > 0) {
    info.notes.push_back(
        fmt::format("{} materials are in no material file; the override file "
                    "says what they are",
                    counts.described));
  }
  if (counts.clear > 0) {
    info.notes.push_back(fmt::format(
        "{} polygons of clear materials were ignored", counts.clear));
  }
  if (counts.lines > 0) {
    info.notes.push_back(fmt::format(
        "{} faces of fewer than three vertices were dropped", counts.lines));
  }
  if (counts.unknown > 0) {
    info.notes.push_back(
        fmt::format("{} lines of unknown kinds were passed over (first: {})",
                    counts.unknown,
                    counts.first_unknown));
  }
  for (std::string& note : cleaning.Notes()) {
    info.notes.push_back(std::move(note));
  }
}

// The share of the time of reading that the first look at an OBJ takes.
constexpr double kSurveyShare = 0.4;

// What progress says of the part of reading from one share to another.
std::function<void(double)> PartOfProgress(
    const std::function<void(double)>& whole, double from, double to) {
  if (!whole) {
    return {};
  }
  return [&whole, from, to](double fraction) {
    whole(from + fraction * (to - from));
  };
}

Point3 Scaled(Point3 p, double unit) {
  return {unit * p.x, unit * p.y, unit * p.z};
}

// Looks at the walls of an OBJ before it is read.
std::optional<RoundedWalls> SurveyRounding(const std::filesystem::path& scene,
                                           const ImportOptions& options,
                                           const ObjTarget& to) {
  const double unit = options.unit.value_or(1);
  RoundingSurvey survey(unit, to.budget);
  ObjInput input;
  input.path = scene;
  input.progress = PartOfProgress(options.progress, 0, kSurveyShare);
  input.place = [&](Point3 p) {
    survey.See(p);
    return Scaled(p, unit);
  };
  input.without_instances = true;
  input.is_enough = [&] { return survey.IsFine(); };
  MaterialTable materials(to.overrides, options.sides, to.budget);
  ReadObj(input, materials, to.budget, to.store, survey);
  return survey.Finish();
}

}  // namespace

void ImportObj(const std::filesystem::path& scene,
               const ImportOptions& options,
               const ObjTarget& to,
               SceneInfo& info) {
  const std::optional<RoundedWalls> walls = SurveyRounding(scene, options, to);
  uint64_t moved = 0;
  ObjInput input;
  input.path = scene;
  input.progress = PartOfProgress(options.progress, kSurveyShare, 1);
  if (options.unit) {
    input.place = [unit = *options.unit](Point3 p) { return Scaled(p, unit); };
  }
  if (walls) {
    info.coordinate_step_m = walls->StepM();
    input.mend = [&](Point3 p) {
      const Point3 restored = walls->Restored(p);
      moved += restored != p ? 1U : 0U;
      info.greatest_move_m =
          std::max(info.greatest_move_m, Length(restored - p));
      return restored;
    };
  }
  PolygonSink sink(to.budget, to.writer);
  const ObjCounts counts =
      ReadObj(input, to.materials, to.budget, to.store, sink);
  AddCounts(scene, counts, sink.Counts(), info);
  if (std::string note = to.materials.NoteOnAssumed(); !note.empty()) {
    info.notes.push_back(std::move(note));
  }
  if (moved > 0) {
    info.notes.push_back(fmt::format(
        "coordinates are rounded to {:.3g} mm: {} vertices were moved, by at "
        "most {:.3g} mm, so that oblique walls are plane again",
        1e3 * walls->StepM(),
        moved,
        1e3 * info.greatest_move_m));
  }
}

}  // namespace enfilade
