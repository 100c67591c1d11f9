// Reads from a Wavefront MTL file what light needs.

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

// Calls take(material, share) for each material in the order of the file;
// `share` is the fraction of the file read by then. Throws InputError with file
// and line for a malformed number. Colours out of range pass, because a
// material that no face uses is no error.
void ReadMtl(const std::filesystem::path& path, const MaterialTaker& take);

}  // namespace enfilade
