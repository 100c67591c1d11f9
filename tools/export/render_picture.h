// Pictures of a solution: what a camera sees, as linear radiosity.

#pragma once

#include "base/memory.h"

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tools/building_view.h"
#include "tools/export/camera.h"
#include "tools/export/spool.h"

namespace enfilade {

struct Pixel {
  // Mean radiosity over the pixel's samples that see the front of a patch.
  std::array<float, 3> radiosity{};
  // Shares of the samples that see a front, and a back (solid cut open, or the
  // black back of a one-sided face). The rest sees nothing.
  float front = 0;
  float back = 0;
};

// A rendered picture, kept on disk.
class Picture {
 public:
  Picture(uint32_t width, uint32_t height);

  [[nodiscard]] uint32_t Width() const { return width_; }

  [[nodiscard]] uint32_t Height() const { return height_; }

  // From the `first`th pixel on, row by row.
  void SetPixels(uint64_t first, std::span<const Pixel> pixels);

  // Row 0 is the top.
  [[nodiscard]] std::vector<Pixel> Row(uint32_t row) const;

 private:
  uint32_t width_;
  uint32_t height_;
  Spool spool_;
};

struct RenderOptions {
  uint32_t width = 1280;
  uint32_t height = 720;
  uint32_t samples = 2;  // per pixel and direction
  bool smooth = true;    // the display mesh; else the leaves as they are
  std::function<void(double fraction)> progress;
};

// Needs the view's tracer and its radiosity, or display_radiosity if `smooth`.
// Traces all rays before it evaluates any radiosity, so that the tracer and the
// solution need no memory at the same time. Evaluates radiosity cell by cell,
// with all calls for a cell in a row.
Picture RenderPicture(const BuildingView& view,
                      const Camera& camera,
                      const RenderOptions& options,
                      MemoryBudget& budget);

}  // namespace enfilade
