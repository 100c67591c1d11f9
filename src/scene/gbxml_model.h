// The Spaces and Surfaces of a gbXML file as the file gives them, in metres.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace enfilade {

struct GbxmlOpening {
  std::string type;
  std::vector<Point3> polygon;
};

struct GbxmlSurface {
  std::string id;
  std::string name;  // the Name element, or the id
  std::string type;
  std::vector<Point3> polygon;
  std::optional<SpaceId> first, second;  // AdjacentSpaceId, in file order
  std::vector<GbxmlOpening> openings;
};

struct GbxmlSpace {
  std::string id;
  std::string name;
  // ShellGeometry/ClosedShell, if the file gives one: the room as measured
  // inside its walls. The Surfaces lie elsewhere.
  std::vector<std::vector<Point3>> shell;
};

struct GbxmlModel {
  std::vector<GbxmlSpace> spaces;  // indexed by SpaceId
  std::vector<GbxmlSurface> surfaces;
  bool has_unit = true;  // if not, it is metres
  MemoryCharge charge;   // for the spaces and surfaces as read
};

// Bytes that the file takes in memory while it is read, which is done as a
// whole. Throws InputError if the file cannot be opened.
uint64_t BytesToReadGbxml(const std::filesystem::path& path);

// Reads the file in the encoding and the unit of length that it declares.
// `strip_spaces`: a Surface may name Spaces that the file does not have. Throws
// InputError, which names the line of bad XML or the Surface or Space with bad
// content.
GbxmlModel ReadGbxmlModel(const std::filesystem::path& path,
                          bool strip_spaces,
                          MemoryBudget& budget);

}  // namespace enfilade
