// Reads back what ObjWriter wrote, for the tests of the scene generators.

#pragma once

#include "base/photometry.h"
#include "base/vec.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include "tools/scenes/obj_writer.h"
#include <gtest/gtest.h>

namespace enfilade::testing {

struct ReadPolygon {
  std::string object;
  std::string material;
  std::vector<Point3> vertices;
};

struct ReadScene {
  std::vector<ReadPolygon> polygons;
  std::map<std::string, Rgb> reflectance;
  std::map<std::string, Rgb> exitance;  // emitting materials only
};

ReadScene ReadObj(const std::filesystem::path& obj);

// The room that an object of a floorplan stands in:
// storey1_wing2_office12_desk3 -> storey1_wing2_office12
inline std::string RoomOf(const std::string& object) {
  return object.substr(0, object.rfind('_'));
}

// Runs a generator and reads its scene back.
template <typename Options>
ReadScene Generate(void (*write)(const Options&, ObjWriter&),
                   const Options& options) {
  const TemporaryFolder dir;
  ObjWriter writer(dir.Path() / "scene.obj");
  write(options, writer);
  writer.Finish();
  return ReadObj(dir.Path() / "scene.obj");
}

// True if every polygon is planar to within a micrometre, strictly convex, of
// some area, and no two have the same vertices.
::testing::AssertionResult AllFacesAreSound(const ReadScene& scene);

// True if along every line the oriented edges cancel: the polygons bound a
// solid without gaps, T-junctions allowed. For axis-parallel edges only.
::testing::AssertionResult EdgesCancel(const std::vector<ReadPolygon>& faces);

// The volume of the solid on the polygons' backs.
double EnclosedVolume(const std::vector<ReadPolygon>& polygons);

}  // namespace enfilade::testing
