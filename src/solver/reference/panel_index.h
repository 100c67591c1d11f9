// Which panel a point of a patch lies on.

#pragma once

#include "solver/reference/reference_scene.h"

#include <map>
#include <optional>
#include <tuple>
#include <vector>

namespace enfilade {

class PanelIndex {
 public:
  // The scene is borrowed.
  explicit PanelIndex(const ReferenceScene& scene) : scene_(&scene) {}

  // Adds a panel. All panels of one patch must be cut into the same number of
  // strips and must not overlap; each strip may be cut further in any way.
  void Add(const Panel& panel, size_t number);

  // One more than the largest number.
  [[nodiscard]] size_t End() const { return end_; }

  // The number of the panel at a point in patch coordinates; none if no panel
  // was added there.
  [[nodiscard]] std::optional<size_t> Find(uint32_t patch, UnitPoint p) const;

 private:
  using Key = std::tuple<uint32_t, uint32_t, ElementPath>;  // patch, strip

  const ReferenceScene* scene_;
  std::map<Key, size_t> numbers_;
  std::map<uint32_t, size_t> strip_levels_;  // by patch
  size_t end_ = 0;
};

}  // namespace enfilade
