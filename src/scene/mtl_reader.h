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

using MaterialTaker = std::function<void(MtlMaterial&&, double share)>;

// Calls take(material, share) for one after the other, in the order of the
// file, of which that share was read then. Throws InputError with file and line
// for a number that is none. Colours out of range are let through: what no face
// uses is no error.
void ReadMtl(const std::filesystem::path& path, const MaterialTaker& take);

}  // namespace enfilade
