// The kinds of form factors that the reference methods compare, and those of
// them that have a formula. Occlusion is not in these.
//
//   paper                      here                (W: Willmott, Heckbert 1997)
//   F_ij (W, eq. 4)            PointToPoint
//   F_ij (W, eq. 5)            CenterToPolygon
//   E_ij (W, eq. 6)            ModifiedEstimate
//   FormFactor (W, 2.1)        SwitchOver
//
// All are of a receiver i to a source j: the share of i's hemisphere that j
// fills.

#pragma once

#include "solver/state/solve_options.h"
#include "solver/transfer/form_factor.h"

#include <cstdint>

namespace enfilade {

enum class FormFactorKind : uint8_t {
  kExact,       // polygons where close, Gauss points elsewhere
  kPoint,       // between the centers
  kPolygon,     // of the receiver's center to the source
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

  // A_i F_ij = A_j F_ji to the last bit.
  [[nodiscard]] bool AreSymmetric() const;

  // Found by rays that stop at what they hit first, a whole row at once.
  [[nodiscard]] bool AreTraced() const;
};

// Throws UsageError if there is no such kind or projection.
FormFactorOptions FormFactorOptionsOf(const MethodOptions& method);

float PointToPoint(const TransferEnd& receiver, const TransferEnd& source);

// Zero where the center lies behind the source.
float CenterToPolygon(const TransferEnd& receiver, const TransferEnd& source);

// PointToPoint where the source is not seen edge-on. There it does not go to
// zero as PointToPoint does, though the source may be close.
float ModifiedEstimate(const TransferEnd& receiver, const TransferEnd& source);

// PointToPoint where the estimate is below a hundredth, else CenterToPolygon.
// On the axis of a disk with estimate E the form factor is E / (1 + E), so that
// the switch costs about a percent; it comes at 5.6 edges of a square source
// that is faced.
float SwitchOver(const TransferEnd& receiver, const TransferEnd& source);

// Of the receiver's center by what `exact` uses: the polygon where the ends are
// close, else the source's Gauss points.
float ExactFromCenter(const TransferEnd& receiver, const TransferEnd& source);

}  // namespace enfilade
