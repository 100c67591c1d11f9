// The kinds of form factors that the reference methods compare, and the
// formulas of the kinds that have one. The formulas leave out occlusion.
//
//   paper                      here                (W: Willmott, Heckbert 1997)
//   F_ij (W, eq. 4)            PointToPoint
//   F_ij (W, eq. 5)            CenterToPolygon
//   E_ij (W, eq. 6)            ModifiedEstimate
//   FormFactor (W, 2.1)        SwitchOver
//
// Each is the form factor from a receiver i to a source j: the share of i's
// hemisphere that j fills.

#pragma once

#include "solver/state/solve_options.h"
#include "solver/transfer/form_factor.h"

#include <cstdint>

namespace enfilade {

enum class FormFactorKind : uint8_t {
  kExact,       // polygons where close, Gauss points elsewhere
  kPoint,       // between the centers
  kPolygon,     // from the receiver's center to the source
  kSwitch,      // point, and polygon where the source looks large
  kHemicube,    // pixels about the center (panel_rays.h)
  kMonteCarlo,  // random rays (panel_rays.h)
};

enum class Projection : uint8_t {
  kGalerkin,     // averaged over the receiver as well as the kind can
  kCollocation,  // at the receiver's center
};

struct FormFactorOptions {
  FormFactorKind kind = FormFactorKind::kExact;
  Projection projection = Projection::kGalerkin;

  // Whether A_i F_ij = A_j F_ji to the last bit.
  [[nodiscard]] bool AreSymmetric() const;

  // Whether rays that stop at their first hit find a whole row at once.
  [[nodiscard]] bool AreTraced() const;
};

// Throws UsageError if there is no such kind or projection.
FormFactorOptions FormFactorOptionsOf(const MethodOptions& method);

float PointToPoint(const TransferEnd& receiver, const TransferEnd& source);

// Zero where the center lies behind the source.
float CenterToPolygon(const TransferEnd& receiver, const TransferEnd& source);

// Like PointToPoint unless the source is seen edge-on. Seen edge-on, a source
// may be close although PointToPoint goes to zero; this estimate does not go to
// zero there.
float ModifiedEstimate(const TransferEnd& receiver, const TransferEnd& source);

// PointToPoint if ModifiedEstimate is below a hundredth, else CenterToPolygon.
// On the axis of a disk with estimate E the form factor is E / (1 + E), so the
// switch costs about a percent. For a square source that is faced, the switch
// is at a distance of 5.6 edges.
float SwitchOver(const TransferEnd& receiver, const TransferEnd& source);

// The form factor from the receiver's center, computed as `exact` does: by the
// polygon if the ends are close, else by the source's Gauss points.
float ExactFromCenter(const TransferEnd& receiver, const TransferEnd& source);

}  // namespace enfilade
