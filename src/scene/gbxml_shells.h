// The shells of a gbXML model's Spaces, made of the Surfaces that bound them.
// The shells tell which Space is in front of a Surface, because the winding in
// a file cannot be trusted.

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

// The tolerance, in metres, with which Surfaces are cut into convex pieces.
inline constexpr double kCutToleranceMetres = 1e-5;

class GbxmlShells {
 public:
  // The model is borrowed.
  explicit GbxmlShells(const GbxmlModel& model);

  [[nodiscard]] Box3 BoundsOf(SpaceId space) const {
    return shells_[space.Index()].Bounds();
  }

  [[nodiscard]] bool IsClosed(SpaceId space) const;

  // The Spaces in front of and behind a Surface of the model, where the winding
  // of its polygon defines the front.
  using SpacePair = std::pair<std::optional<SpaceId>, std::optional<SpaceId>>;
  SpacePair SidesOf(size_t index);

  // Counts over the calls of SidesOf: Surfaces wound against the rule that the
  // normal points out of the first Space (Turned), and Surfaces in shells too
  // broken to tell (Unclear).
  [[nodiscard]] uint64_t Turned() const { return turned_; }

  [[nodiscard]] uint64_t Unclear() const { return unclear_; }

 private:
  void Complete(SpaceShell& shell, const std::vector<size_t>& doubtful);
  void CompleteByBest(SpaceShell& shell, const std::vector<size_t>& doubtful);
  void CompleteByLeavingOut(const SpaceShell& bare,
                            std::vector<size_t> doubtful,
                            SpaceShell* shell);
  [[nodiscard]] int FirstInFront(const GbxmlSurface& surface) const;
  [[nodiscard]] int Vote(const GbxmlSurface& surface,
                         Point3 front,
                         Point3 back) const;

  const GbxmlModel* model_;
  std::vector<SpaceShell> shells_;  // indexed by SpaceId
  // By surface: whether it names one Space twice and is part of its shell.
  std::vector<bool> in_shell_;
  uint64_t turned_ = 0;
  uint64_t unclear_ = 0;
};

// Whether the Surface names one Space, or two different ones.
bool Separates(const GbxmlSurface& surface);

}  // namespace enfilade
