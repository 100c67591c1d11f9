#include "solver/refine/reflected_light.h"

#include "solver/refine/refine_receiver.h"

namespace enfilade {

ReflectedElement ReflectedLight::Of(ElementId element) const {
  const uint32_t patch = tree_->At(element).patch;
  const float care = CareOf(care_, patch);
  return {element,
          care * MeanReflected(patches_[patch],
                               tree_->Sent()[element],
                               tree_->Shape(),
                               *surfaces_),
          care * tree_->Detail(element)};
}

ReflectedElement ReflectedLight::OfPatch(uint32_t patch) const {
  return Of(ElementId(size_t{patch}));
}

ReflectedElement ReflectedLight::OfChild(const ReflectedElement& parent,
                                         size_t child) const {
  return parent.detail > 0
             ? Of(ElementId(tree_->At(parent.element).first_child + child))
             : parent;
}

}  // namespace enfilade
