// Guides paths to spots that reflect far more light than most, such as the
// inside of a lamp's shade. By the cosine alone, a path from the wall beside a
// shade finds such a spot once in a hundred times, and then counts it a
// hundredfold. Sampling the lamps does not help, because the surfaces that they
// light from nearby are no lamps.
//
// Therefore a part alpha(x) of the directions at a vertex x with normal n aims
// at spheres around the bright spots, uniform in the cone of directions to one
// of them (a direction below the surface is mirrored at it). The rest follow
// the cosine. The density of all directions over that of the cosine is the
// excess
//
//   e(w) = 1 - alpha + alpha pi / cos_w sum over j of
//          p_j (number of w and its mirror image within cone j) / Omega_j
//
// A path that divides by the excess stays unbiased, whatever the spots are
// (Vorba et al. 2014 learn such mixtures; here the solution tells them). With
// I_j the estimated light that spot j sends to x,
//
//   I_j = share_j flux_j max(0, cos_j + R_j / d_j) / (pi d_j^2)
//   p_j = I_j / sum I,   alpha = sum I / (2 sum I + 2 M) max(0, 1 - F / 0.3)
//
// Here d_j is the distance from x to the centre of spot j, and R_j the radius
// of the spot. share_j is the part of the rays from the cell of x towards the
// spot that reached it, but at least (4 R_j / d_j)^2 and at most 1. A spot that
// x is close to needs no guide and has I_j = 0. M is the mean radiosity of the
// building or, if larger, that of the brightest spot that x is close to. F is
// the share of the hemisphere, weighted by cosines, that the brightest spots
// fill. Where they fill much of it, as inside a shade, the cosine finds them,
// and dividing by the excess at each of a dozen bounces would let a few paths
// dominate.

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
    // A direction, from two numbers uniform in [0, 1).
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

  // Starts without spots: all directions follow the cosine.
  PathGuide() = default;

  // Finds the spots that each cell sees, by a fixed number of rays per cell and
  // spot. The result is a pure function of the arguments other than the budget.
  // Keeps at most `max_bytes`, charged to the budget; cells beyond that go
  // unguided. `mean_radiosity` is M. Returns the number of rays traced.
  uint64_t Learn(const BuildingView& view,
                 std::vector<BrightPart> parts,
                 double mean_radiosity,
                 MemoryBudget& budget,
                 uint64_t max_bytes,
                 uint64_t key);

  // The directions at a point x of a cell, if the cell is known.
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
