// The kernel of radiosity between two points, unoccluded, and rows of it: the
// one place of its formula. It is written for single numbers and for vectors of
// them alike.
//
//   paper          here
//   G without V    PlainKernel: cos_x cos_y / (pi r^2)
//   K_gq           PlainRow, for a node g: irradiance per radiosity at node q

#pragma once

#include "solver/elements/geometry.h"

#include <array>
#include <cstddef>

namespace enfilade {

// A point with a unit normal, at which irradiance is computed.
struct SurfacePoint {
  Vec3f at;
  Vec3f normal;
};

// Points of an element at which light is sampled, and quadrature weights that
// sum to 1.
template <size_t count>
struct NodeSet {
  std::array<float, count> x{};  // m
  std::array<float, count> y{};
  std::array<float, count> z{};
  std::array<float, count> weight{};

  [[nodiscard]] Vec3f At(size_t i) const { return {x[i], y[i], z[i]}; }
};

// share cos_x cos_y / r^2, zero where either point lies behind the other's
// plane. (dx, dy, dz) leads from x with normal n to y with normal m. `share` is
// the area at y over pi.
template <typename Number>
Number PlainKernel(
    Number share, Number dx, Number dy, Number dz, Vec3f n, Vec3f m) {
  const auto positive = [](Number v) { return v > Number{} ? v : Number{}; };
  const Number r2 = dx * dx + dy * dy + dz * dz + 1e-12F;  // finite at r = 0
  const Number cos_x = positive(dx * n.x + dy * n.y + dz * n.z);
  const Number cos_y = positive(-(dx * m.x + dy * m.y + dz * m.z));
  return share * cos_x * cos_y / (r2 * r2);
}

// What a point gets from each node of an element with this area, m2, and
// normal. Sums to the form factor up to the error of the quadrature.
template <size_t count>
std::array<float, count> PlainRow(const SurfacePoint& x,
                                  const NodeSet<count>& nodes,
                                  float area,
                                  Vec3f normal) {
  const float scale = area * kInversePi;
  std::array<float, count> row{};
  for (size_t q = 0; q < count; ++q) {
    row[q] = PlainKernel(scale * nodes.weight[q],
                         nodes.x[q] - x.at.x,
                         nodes.y[q] - x.at.y,
                         nodes.z[q] - x.at.z,
                         x.normal,
                         normal);
  }
  return row;
}

// Scales a plain row to the exact form factor. A small even part is blended in,
// so that a row never lacks a node to carry it.
template <size_t count>
void ScaleToFormFactor(float exact,
                       const std::array<float, count>& weight,
                       std::array<float, count>* row) {
  float sum = 0;
  for (const float k : *row) {
    sum += k;
  }
  const float even = 0.02F * sum + 1e-9F;
  const float scale = exact / (sum + even);
  for (size_t q = 0; q < count; ++q) {
    (*row)[q] = scale * ((*row)[q] + even * weight[q]);
  }
}

}  // namespace enfilade
