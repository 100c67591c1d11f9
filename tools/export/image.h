// Rendered pictures as PNG (tone-mapped, 8 bits) and OpenEXR (linear, float).

#pragma once

#include <cstdint>
#include <filesystem>

#include "tools/export/render_picture.h"

namespace enfilade {

struct ImageOptions {
  double exposure_stops = 0;
  // White (for a plan) rather than black where nothing is seen.
  bool white_background = false;
};

// Both return the bytes written, throw DiskError, and stream row by row.
uint64_t WritePng(const Picture& picture,
                  const ImageOptions& options,
                  const std::filesystem::path& out);
// Channels R, G, B: radiosity; A: the share of a pixel that sees a patch.
uint64_t WriteExr(const Picture& picture, const std::filesystem::path& out);

}  // namespace enfilade
