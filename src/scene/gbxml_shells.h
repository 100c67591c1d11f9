// The shells of a gbXML model's Spaces, of the Surfaces that bound them, and
// what they tell: which Space is in front of a Surface. A file's winding is not
// believed.

#pragma once

#include "base/ids.h"
#include "scene/gbxml_model.h"
#include "scene/space_shell.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace enfilade {

// How fine Surfaces with several outlines are cut, in metres.
inline constexpr double kCutToleranceMetres = 1e-5;

class GbxmlShells {
 public:
  // The model is borrowed.
  explicit GbxmlShells(const GbxmlModel& model);

  [[nodiscard]] Box3 BoundsOf(SpaceId space) const {
    return shells_[space.Index()].Bounds();
  }

  [[nodiscard]] bool IsClosed(SpaceId space) const;

  // The Spaces in front of and behind the polygon of a Surface of the model, as
  // it is wound.
  using SpacePair = std::pair<std::optional<SpaceId>, std::optional<SpaceId>>;
  SpacePair SidesOf(size_t index);

  // Of the Surfaces whose sides were asked for: those wound against the rule
  // that their normal points out of their first Space, and those whose shells
  // are too broken to tell.
  [[nodiscard]] uint64_t Turned() const { return turned_; }

  [[nodiscard]] uint64_t Unclear() const { return unclear_; }

 private:
  void Complete(SpaceShell& shell, const std::vector<size_t>& doubtful);
  [[nodiscard]] int FirstInFront(const GbxmlSurface& surface) const;
  [[nodiscard]] int Vote(const GbxmlSurface& surface,
                         Point3 front,
                         Point3 back) const;

  const GbxmlModel* model_;
  std::vector<SpaceShell> shells_;  // indexed by SpaceId
  // Indexed as the surfaces: names one Space twice and is part of its shell.
  std::vector<bool> in_shell_;
  uint64_t turned_ = 0;
  uint64_t unclear_ = 0;
};

// Names one Space, or two different ones.
bool Separates(const GbxmlSurface& surface);

}  // namespace enfilade
