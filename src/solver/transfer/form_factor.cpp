#include "solver/transfer/form_factor.h"

#include "base/check.h"
#include "solver/transfer/arc_tangent.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// Random points keep this distance from the rim, m, but at most this share of
// the element: if surfaces touch, a ray from their common edge would start
// beyond the surface that the ray should hit.
constexpr float kRimM = 1e-3F;
constexpr float kMostRimShare = 0.02F;

// The corners of a polygon relative to a point, as a structure of arrays, so
// that edges are processed side by side. Entries from `count` on are
// uninitialised: clearing them took a fifth of the time.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init)
struct Outline {
  static constexpr size_t kMost = 8;

  std::array<double, kMost + 1> x, y, z;
  size_t count = 0;

  [[nodiscard]] Vec3 At(size_t i) const { return {x[i], y[i], z[i]}; }

  void Add(Vec3 p) {
    x[count] = p.x;
    y[count] = p.y;
    z[count] = p.z;
    ++count;
  }

  // Fills the corners from `count` to `lanes` with the first corner: the last
  // edge ends there, and the edges after it have no length.
  void Close(size_t lanes) {
    for (size_t i = count; i <= lanes; ++i) {
      x[i] = x[0];
      y[i] = y[0];
      z[i] = z[0];
    }
  }
};

Outline RelativeTo(Vec3f x, std::span<const Vec3f> polygon) {
  Outline out;
  for (const Vec3f p : polygon) {
    out.Add({static_cast<double>(p.x) - static_cast<double>(x.x),
             static_cast<double>(p.y) - static_cast<double>(x.y),
             static_cast<double>(p.z) - static_cast<double>(x.z)});
  }
  return out;
}

// The part of an outline above the horizon; `heights` are negative below it.
Outline Clipped(const Outline& outline,
                const std::array<double, Outline::kMost>& heights) {
  Outline out;
  for (size_t i = 0; i < outline.count; ++i) {
    const size_t next = i + 1 < outline.count ? i + 1 : 0;
    const Vec3 a = outline.At(i);
    const double above_a = heights[i];
    const double above_b = heights[next];
    if (above_a >= 0) {
      out.Add(a);
    }
    if ((above_a > 0 && above_b < 0) || (above_a < 0 && above_b > 0)) {
      out.Add(a + (outline.At(next) - a) * (above_a / (above_a - above_b)));
    }
  }
  return out;
}

// The sum of Lambert's formula over the edges, of which there are at most
// `lanes`.
template <size_t lanes>
double SumOfEdges(Outline* v, Vec3 n) {
  v->Close(lanes);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): filled below
  std::array<double, lanes> terms;
  for (size_t i = 0; i < lanes; ++i) {
    const double ax = v->x[i];
    const double ay = v->y[i];
    const double az = v->z[i];
    const double bx = v->x[i + 1];
    const double by = v->y[i + 1];
    const double bz = v->z[i + 1];
    const double cx = ay * bz - az * by;
    const double cy = az * bx - ax * bz;
    const double cz = ax * by - ay * bx;
    const double sine = std::sqrt(cx * cx + cy * cy + cz * cz);
    const double cosine = ax * bx + ay * by + az * bz;
    const double slope = n.x * cx + n.y * cy + n.z * cz;
    const double term = AngleOf(sine, cosine) * slope / std::max(sine, 1e-14);
    terms[i] = sine > 1e-14 ? term : 0;
  }
  double sum = 0;
  for (size_t i = 0; i < v->count; ++i) {
    sum += terms[i];
  }
  return sum;
}

}  // namespace

float PointToPolygon(Vec3f x, Vec3f n, std::span<const Vec3f> polygon) {
  // Rounding may put the corners of a polygon in the horizon plane above and
  // below it in turn, so that nearly every edge is cut.
  ENFILADE_CHECK(
      polygon.size() <= 5, "a polygon of {} corners", polygon.size());
  Outline outline = RelativeTo(x, polygon);
  const Vec3 normal{n.x, n.y, n.z};
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): likewise
  std::array<double, Outline::kMost> heights;
  size_t above = 0;
  for (size_t i = 0; i < outline.count; ++i) {
    heights[i] = Dot(outline.At(i), normal);
    above += heights[i] >= 0 ? 1U : 0U;
  }
  if (above == 0) {
    return 0;
  }
  if (above < outline.count) {
    outline = Clipped(outline, heights);
  }
  const double sum = outline.count <= 4 ? SumOfEdges<4>(&outline, normal)
                                        : SumOfEdges<8>(&outline, normal);
  return static_cast<float>(std::clamp(std::abs(sum) / (2 * kPi), 0.0, 1.0));
}

namespace {

// The nodes of a shape in its unit coordinates, and their weights.
struct NodePlaces {
  std::array<float, kTransferNodes> s, t, weight;
};

// The Gauss points of the unit square and of the unit triangle.
constexpr float kLow = 0.21132487F;
constexpr float kHigh = 0.78867513F;
constexpr float kSixth = 1.0F / 6;
constexpr float kThird = 1.0F / 3;
constexpr NodePlaces kSquare = {{kLow, kHigh, kLow, kHigh},
                                {kLow, kLow, kHigh, kHigh},
                                {0.25F, 0.25F, 0.25F, 0.25F}};
constexpr NodePlaces kTriangle = {{kSixth, 4 * kSixth, kSixth, 2 * kSixth},
                                  {kSixth, kSixth, 4 * kSixth, 2 * kSixth},
                                  {kThird, kThird, kThird, 0}};

void SetRow(size_t g,
            const std::array<float, kTransferNodes>& row,
            Kernel* kernel) {
  for (size_t q = 0; q < kTransferNodes; ++q) {
    (*kernel)[g * kTransferNodes + q] = row[q];
  }
}

}  // namespace

TransferNodes NodesOf(const PatchGeometry& patch, ElementFrame frame) {
  const NodePlaces& places =
      patch.shape == PatchShape::kTriangle ? kTriangle : kSquare;
  TransferNodes nodes;
  for (size_t i = 0; i < kTransferNodes; ++i) {
    const float a = frame.a + frame.scale * places.s[i];
    const float b = frame.b + frame.scale * places.t[i];
    nodes.x[i] = patch.origin.x + patch.u.x * a + patch.v.x * b;
    nodes.y[i] = patch.origin.y + patch.u.y * a + patch.v.y * b;
    nodes.z[i] = patch.origin.z + patch.u.z * a + patch.v.z * b;
  }
  nodes.weight = places.weight;
  return nodes;
}

TransferEnd MakeTransferEnd(const PatchGeometry& patch, ElementFrame frame) {
  const bool triangle = patch.shape == PatchShape::kTriangle;
  TransferEnd end;
  end.patch = &patch;
  end.frame = frame;
  end.area = AreaOf(patch, frame);
  end.diameter = DiameterOf(patch, frame);
  end.radius = RadiusOf(patch, frame);
  end.rim = std::min(kMostRimShare, kRimM * end.diameter / end.area);
  end.node_count = triangle ? 3 : 4;
  const float middle = triangle ? kThird : 0.5F;
  end.center = PointOn(patch, frame, middle, middle);
  end.nodes = NodesOf(patch, frame);
  return end;
}

bool ReachesInto(const TransferEnd& end, const Box& box) {
  const PatchGeometry& patch = *end.patch;
  const Vec3f corner = PointOn(patch, end.frame, 0, 0);
  const bool triangle = patch.shape == PatchShape::kTriangle;
  const auto reaches =
      [&](float from, float u, float v, float low, float high) {
        const float a = end.frame.scale * u;
        const float b = end.frame.scale * v;
        const float least = triangle ? std::min({0.0F, a, b})
                                     : std::min(a, 0.0F) + std::min(b, 0.0F);
        const float most = triangle ? std::max({0.0F, a, b})
                                    : std::max(a, 0.0F) + std::max(b, 0.0F);
        return from + least <= high && from + most >= low;
      };
  return reaches(corner.x, patch.u.x, patch.v.x, box.low.x, box.high.x) &&
         reaches(corner.y, patch.u.y, patch.v.y, box.low.y, box.high.y) &&
         reaches(corner.z, patch.u.z, patch.v.z, box.low.z, box.high.z);
}

std::array<float, kTransferNodes> QuadratureRow(const SurfacePoint& x,
                                                const TransferEnd& source) {
  return PlainRow(x, source.nodes, source.area, source.patch->normal);
}

Kernel QuadratureKernel(const TransferEnd& receiver,
                        const TransferEnd& source) {
  Kernel kernel{};
  for (size_t g = 0; g < kTransferNodes; ++g) {
    SetRow(g, QuadratureRow(receiver.NodeAt(g), source), &kernel);
  }
  return kernel;
}

NearSource::NearSource(const TransferEnd& source)
    : source_(&source), corners_(CornersOf(*source.patch, source.frame)) {}

std::array<float, kTransferNodes> NearSource::Row(const SurfacePoint& x) const {
  const PatchGeometry& patch = *source_->patch;
  if (Dot(x.at - patch.origin, patch.normal) <= 0) {
    return {};
  }
  auto row = QuadratureRow(x, *source_);
  ScaleToFormFactor(PointToPolygon(x.at, x.normal, corners_.View()),
                    source_->nodes.weight,
                    &row);
  return row;
}

namespace {

// Exact rows: the form factors from each receiver node to the source.
Kernel KernelByRows(const TransferEnd& receiver, const TransferEnd& source) {
  const NearSource rows(source);
  Kernel kernel{};
  for (size_t g = 0; g < receiver.node_count; ++g) {
    SetRow(g, rows.Row(receiver.NodeAt(g)), &kernel);
  }
  return kernel;
}

// Exact columns: the form factors from each source node to the receiver, by
// reciprocity A_r F_rs = A_s F_sr. A small and close source lights a spot that
// may lie between the receiver's nodes; its flux is right nevertheless.
Kernel KernelByColumns(const TransferEnd& receiver, const TransferEnd& source) {
  const NearSource columns(receiver);
  Kernel kernel{};
  for (size_t q = 0; q < source.node_count; ++q) {
    const auto column = columns.Row(source.NodeAt(q));
    const float scale = source.area * source.nodes.weight[q] / receiver.area;
    for (size_t g = 0; g < receiver.node_count; ++g) {
      kernel[g * kTransferNodes + q] =
          scale * column[g] / receiver.nodes.weight[g];
    }
  }
  return kernel;
}

}  // namespace

void MaskKernel(uint16_t visible, Kernel* kernel) {
  for (size_t i = 0; i < kernel->size(); ++i) {
    (*kernel)[i] = (visible >> i & 1) != 0 ? (*kernel)[i] : 0.0F;
  }
}

bool IsCut(const TransferEnd& end, const PatchGeometry& patch) {
  // Most elements are farther from the plane than their diameter.
  if (std::abs(Dot(end.center - patch.origin, patch.normal)) > end.diameter) {
    return false;
  }
  const float tolerance = PlaneTolerance(patch);
  const Corners corners = CornersOf(*end.patch, end.frame);
  const auto lies = [&](float side) {
    return [&patch, side, tolerance](Vec3f p) {
      return side * Dot(p - patch.origin, patch.normal) > tolerance;
    };
  };
  const auto all = corners.View();
  return std::any_of(all.begin(), all.end(), lies(1)) &&
         std::any_of(all.begin(), all.end(), lies(-1));
}

bool IsByColumns(const TransferEnd& receiver, const TransferEnd& source) {
  return source.diameter < receiver.diameter && !IsCut(source, *receiver.patch);
}

Kernel NearKernel(const TransferEnd& receiver, const TransferEnd& source) {
  return IsByColumns(receiver, source) ? KernelByColumns(receiver, source)
                                       : KernelByRows(receiver, source);
}

}  // namespace enfilade
