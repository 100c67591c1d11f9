#include "solver/reference/panel_index.h"

#include <algorithm>

namespace enfilade {

void PanelIndex::Add(const Panel& panel, size_t number) {
  numbers_[{panel.patch, panel.strip, panel.path}] = number;
  strip_levels_[panel.patch] = StripLevel(panel.strip);
  end_ = std::max(end_, number + 1);
}

std::optional<size_t> PanelIndex::Find(uint32_t patch, UnitPoint p) const {
  const auto strips = strip_levels_.find(patch);
  if (strips == strip_levels_.end()) {
    return std::nullopt;
  }
  const uint32_t strip = scene_->StripAt(patch, strips->second, &p);
  const PatchShape shape = scene_->ShapeOf(patch);
  ElementPath path = kRootPath;
  for (size_t level = 0; level <= kMaxLevel; ++level) {
    const auto found = numbers_.find({patch, strip, path});
    if (found != numbers_.end()) {
      return found->second;
    }
    path = ChildPath(path, ChildAt(shape, &p));
  }
  return std::nullopt;
}

}  // namespace enfilade
