// Instances in OBJ files: a piece is written once and placed many times
// (docs/instances.md). A placement is a line that other readers take for a
// comment:
//
//   #instance PIECE.obj TX TY TZ ANGLE [SCALE]
//
// A vertex p of the piece stands at T + SCALE * Rz(ANGLE) p: scaled, turned
// counter-clockwise about z by ANGLE degrees, moved.

#pragma once

#include "base/vec.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace enfilade {

// Where a piece stands. Multiples of 90 degrees turn exactly.
class InstancePlacement {
 public:
  InstancePlacement(Point3 origin, double angle_degrees, double scale);

  [[nodiscard]] Point3 At(Point3 p) const {
    return {origin_.x + (cos_ * p.x - sin_ * p.y),
            origin_.y + (sin_ * p.x + cos_ * p.y),
            origin_.z + scale_ * p.z};
  }

 private:
  Point3 origin_;
  double cos_;  // cos_ and sin_ include the scale
  double sin_;
  double scale_;
};

struct Instance {
  std::filesystem::path piece;  // relative to the folder of the OBJ
  InstancePlacement placement;
};

// The text after the keyword '#instance'; nullopt for any other line. Leading
// blanks are skipped.
std::optional<std::string_view> WordsAfterInstance(std::string_view line);

// The instance, or nullopt and a message that says what is wrong.
struct InstanceReading {
  std::optional<Instance> instance;
  std::string error;
};

InstanceReading ReadInstance(std::string_view words);

}  // namespace enfilade
