// Wavefront MTL: what light needs of it.

#pragma once

#include "scene/face.h"

#include <filesystem>
#include <functional>
#include <string>

namespace enfilade {

// A material and the line that gives its colour ("file:12").
struct MtlMaterial {
  Material material;
  std::string place;
};

// Calls take(material) for one after the other, in the order of the file.
// Throws InputError with file and line for a number that is none. Colours out
// of range are let through: what no face uses is no error.
void ReadMtl(const std::filesystem::path& path,
             const std::function<void(MtlMaterial&&)>& take);

}  // namespace enfilade
