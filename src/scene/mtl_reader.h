// Wavefront MTL: what light needs of it.

#pragma once

#include "scene/face.h"

#include <filesystem>
#include <string>
#include <vector>

namespace enfilade {

// A material and the line that gives its colour ("file:12").
struct MtlMaterial {
  Material material;
  std::string place;
};

// Throws InputError with file and line for a number that is none. Colours out
// of range are let through: what no face uses is no error.
std::vector<MtlMaterial> ReadMtl(const std::filesystem::path& path);

}  // namespace enfilade
