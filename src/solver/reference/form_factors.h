// Form factors of the kind that was asked for between the panels of a scene,
// occlusion included.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/reference/form_factor_kinds.h"
#include "solver/reference/panel_index.h"
#include "solver/reference/panel_rays.h"
#include "solver/reference/reference_scene.h"
#include "visibility/ray_tracer.h"

#include <memory>
#include <vector>

namespace enfilade {

class FormFactors {
 public:
  // The scene is borrowed. Kinds that are traced read the trace chunks of the
  // store and hold up to half of what the budget has left.
  FormFactors(const ReferenceScene& scene,
              FormFactorOptions options,
              const BlockStorage& store,
              MemoryBudget& budget);

  [[nodiscard]] const FormFactorOptions& Options() const { return options_; }

  // A_i F_ij, m2, as i sees j. Requires a kind that is not traced. Thread-safe.
  [[nodiscard]] float Exchange(const Panel& i, const Panel& j) const;

  // A_i F_ij, m2, from one panel to all panels of the index, by their numbers.
  // Requires a kind that is traced. Not thread-safe.
  [[nodiscard]] std::vector<float> TraceRow(const Panel& i,
                                            const PanelIndex& panels);

  // Rays that TraceRow has traced.
  [[nodiscard]] uint64_t Rays() const { return rays_; }

 private:
  [[nodiscard]] float Unoccluded(const Panel& i, const Panel& j) const;
  [[nodiscard]] std::vector<PanelRay> RaysOf(const Panel& panel) const;

  const ReferenceScene& scene_;
  FormFactorOptions options_;
  std::unique_ptr<RayTracer> tracer_;  // of kinds that are traced
  MemoryCharge charge_;                // likewise: rays, a row and an index
  uint64_t rays_ = 0;
};

}  // namespace enfilade
