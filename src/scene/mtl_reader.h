// Reads from a Wavefront MTL file what light needs.

#pragma once

#include "scene/face.h"

#include <filesystem>
#include <functional>
#include <string>

namespace enfilade {

// The reflectance of what no file says the colour of.
inline constexpr double kAssumedReflectance = 0.5;

// A material and the line that gives its colour ("file:12").
struct MtlMaterial {
  Material material;
  std::string place;
  bool is_assumed = false;  // it has no Kd: the reflectance is a guess
};

using MaterialTaker = std::function<void(MtlMaterial&&, double share)>;

// Calls take(material, share) for each material in the order of the file;
// `share` is the fraction of the file read by then. Throws InputError with file
// and line for a malformed number. Colours out of range pass, because a
// material that no face uses is no error. A material that neither has a Kd nor
// emits is taken for grey.
void ReadMtl(const std::filesystem::path& path, const MaterialTaker& take);

}  // namespace enfilade
