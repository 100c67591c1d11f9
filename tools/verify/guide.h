// Where paths had better go: spots that reflect far more light than most, such
// as the inside of a lamp's shade. A path from the wall beside it finds such a
// spot once in a hundred times by the cosine alone, and then counts it a
// hundredfold; lamps are sampled, but what they light from near is no lamp.
//
// So a part alpha(x) of the directions at a vertex x with normal n goes to
// spheres about the bright spots, uniform in the cone of directions to one of
// them (what would lie below the surface is mirrored at it), the rest by the
// cosine. Their density over the cosine's is the excess
//
//   e(w) = 1 - alpha + alpha pi / cos_w sum over j of
//          p_j (number of w and its mirror image within cone j) / Omega_j
//
// and a path that divides by it is as unbiased as before, whatever the spots
// are (Vorba et al. 2014 learn such mixtures; here the solution tells them).
// With I_j what spot j sends to x if nothing is between,
//
//   I_j = share_j flux_j max(0, cos_j + R_j / d_j) / (pi d_j^2)
//   p_j = I_j / sum I,   alpha = sum I / (2 sum I + 2 M) max(0, 1 - F / 0.3)
//
// for d_j from x to the centre, of radius R_j, and share_j the part of the rays
// from the cell of x towards the spot that came there, or what distance says. A
// spot that x is close to needs no guide and has I_j = 0. M is the mean
// radiosity of the building, or that of the brightest spot that x is close to;
// F the share of the hemisphere, by cosines, that the brightest spots fill:
// where they fill it, as inside of a shade, the cosine finds them, and dividing
// at each of a dozen bounces would make few paths count for all.

#pragma once

#include "base/memory.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tools/building_view.h"
#include "tools/verify/cell_lists.h"
#include "tools/verify/geometry.h"
#include "tools/verify/survey.h"

namespace enfilade {

// A small part of the reflecting sides that is bright.
struct BrightPart {
  Point3 position;
  double radius = 0;  // m, of a sphere that holds it
  double flux = 0;    // reflected, W; mean of the channels
  CellId cell{0U};
};

class PathGuide {
 public:
  static constexpr size_t kMostAims = 48;  // of a cell

  // The directions at one vertex.
  class Aims {
   public:
    // From two numbers uniform in [0, 1).
    [[nodiscard]] Vec3 Direction(double u, double v) const;

    // e(w) for a unit vector above the surface.
    [[nodiscard]] double Excess(Vec3 direction) const;

    // alpha(x)
    [[nodiscard]] double Share() const { return share_; }

   private:
    friend class PathGuide;

    struct Cone {
      Vec3 axis;
      double height = 0;       // 1 less the cosine of its half angle
      double probability = 0;  // p_j
    };

    Vec3 normal_;
    double share_ = 0;
    size_t count_ = 0;
    std::array<Cone, kMostAims> cones_;
  };

  // Guides nowhere.
  PathGuide() = default;

  // Traces a fixed number of rays per cell, a pure function of the arguments
  // but the budget. Keeps at most what `max_bytes` hold, charged to the budget:
  // cells beyond that go unguided. `mean_radiosity`: M. Returns the rays
  // traced.
  uint64_t Learn(const BuildingView& view,
                 std::vector<BrightPart> parts,
                 double mean_radiosity,
                 MemoryBudget& budget,
                 uint64_t max_bytes,
                 uint64_t key);

  // At a point of a cell, if that is known.
  [[nodiscard]] Aims At(std::optional<CellId> cell,
                        Point3 x,
                        Vec3 normal) const;

 private:
  struct Aim {
    uint32_t spot = 0;
    float share = 0;
  };

  uint64_t LearnCells(const BuildingView& view, uint64_t key);
  [[nodiscard]] std::vector<Aim> SpotsOfCells(const CellSurvey& survey) const;
  void Test(const BuildingView& view,
            const CellSurvey& survey,
            std::vector<Aim>& aims) const;
  void KeepTheStrongest(std::vector<Aim>& aims) const;

  MemoryCharge charge_;  // of the spots
  double mean_radiosity_ = 0;
  std::vector<BrightPart> spots_;
  CellLists<Aim> lists_;
};

}  // namespace enfilade
