// A gbXML file's Spaces and Surfaces as it gives them, in metres.

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
  // inside its walls, which is not where the Surfaces are.
  std::vector<std::vector<Point3>> shell;
};

struct GbxmlModel {
  std::vector<GbxmlSpace> spaces;  // indexed by SpaceId
  std::vector<GbxmlSurface> surfaces;
  MemoryCharge charge;  // of these, as they are read
};

// Bytes that the file takes in memory while it is read: it is held whole.
// Throws InputError if it cannot be opened.
uint64_t BytesToReadGbxml(const std::filesystem::path& path);

// Reads the file, in whatever encoding and unit of length it declares. Throws
// InputError: bad XML with its line, bad content with the Surface's id.
GbxmlModel ReadGbxmlModel(const std::filesystem::path& path,
                          MemoryBudget& budget);

}  // namespace enfilade
