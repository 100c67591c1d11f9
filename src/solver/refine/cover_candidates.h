// Finds what may cover a part of a patch: the other patches that stand before
// it within reach, projected onto it.

#pragma once

#include "solver/refine/cover.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace enfilade {

// A blocker covers a surface if it is within this distance of the surface.
inline constexpr float kCoverReach = 0.35F;  // m

// A part of a patch, in the coordinates of the patch.
struct PatchRect {
  float low_a, high_a, low_b, high_b;

  [[nodiscard]] bool Has(float a, float b) const {
    return a >= low_a && a <= high_a && b >= low_b && b <= high_b;
  }

  // Requires an overlap.
  [[nodiscard]] PatchRect ClippedTo(const PatchRect& other) const {
    return {std::max(low_a, other.low_a),
            std::min(high_a, other.high_a),
            std::max(low_b, other.low_b),
            std::min(high_b, other.high_b)};
  }

  [[nodiscard]] float Area() const {
    return (high_a - low_a) * (high_b - low_b);
  }
};

// The rectangle of an element; for a triangle, of the parallelogram around it.
inline PatchRect PatchRectOf(ElementFrame frame) {
  const float end_a = frame.a + frame.scale;
  const float end_b = frame.b + frame.scale;
  return {std::min(frame.a, end_a),
          std::max(frame.a, end_a),
          std::min(frame.b, end_b),
          std::max(frame.b, end_b)};
}

// Where on a patch other patches can cover it: their projections, widened. The
// rectangles may overlap and reach beyond the patch.
std::vector<PatchRect> CoverCandidates(const CoverSide& cell, size_t patch);

}  // namespace enfilade
