#include "tools/verify/points.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

constexpr int kDigits = 22;  // to base 4: 22 halvings, to 2.4e-7 of a side

// A part of a patch: the points (a + scale s, b + scale t) for all (s, t) of
// the patch. A negative scale turns the middle quarter of a triangle.
struct Quarter {
  double a = 0;
  double b = 0;
  double scale = 1;

  void Enter(PatchShape shape, int digit) {
    const bool triangle = shape == PatchShape::kTriangle;
    if (triangle && digit == 0) {
      a += scale / 2;
      b += scale / 2;
      scale = -scale / 2;
      return;
    }
    scale /= 2;
    a += digit == 1 || (digit == 3 && !triangle) ? scale : 0;
    b += digit == 2 || (digit == 3 && !triangle) ? scale : 0;
  }

  // The digit of the quarter that a point lies in.
  [[nodiscard]] int DigitOf(PatchShape shape, double at_a, double at_b) const {
    const double s = (at_a - a) / scale;
    const double t = (at_b - b) / scale;
    if (shape == PatchShape::kTriangle) {
      return s > 0.5 ? 1 : t > 0.5 ? 2 : s + t < 0.5 ? 3 : 0;
    }
    return (s >= 0.5 ? 1 : 0) + (t >= 0.5 ? 2 : 0);
  }
};

SidePoint MakePoint(CellId cell,
                    PatchId id,
                    const Patch& patch,
                    double fraction) {
  SidePoint p;
  p.point = PlaceOnPatch(patch.shape, fraction);
  p.point.cell = cell;
  p.point.patch = id;
  p.receiver = {PointOn(patch, p.point.a, p.point.b), PatchNormal(patch), cell};
  p.material = patch.material;
  p.emits = patch.emits;
  return p;
}

}  // namespace

PatchPoint PlaceOnPatch(PatchShape shape, double fraction) {
  Quarter q;
  for (int i = 0; i < kDigits; ++i) {
    fraction *= 4;
    const int digit = std::clamp(static_cast<int>(fraction), 0, 3);
    fraction -= digit;
    q.Enter(shape, digit);
  }
  const double middle = CentroidCoordinate(shape);
  PatchPoint p;
  p.a = q.a + q.scale * middle;
  p.b = q.b + q.scale * middle;
  return p;
}

LineStretch StretchOnPatch(PatchShape shape, const ElementFrame& part) {
  const auto scale = static_cast<double>(part.scale);
  const double middle = CentroidCoordinate(shape);
  const double a = static_cast<double>(part.a) + scale * middle;
  const double b = static_cast<double>(part.b) + scale * middle;
  Quarter q;
  double begin = 0;
  double length = 1;
  for (int i = 0; i < kDigits && std::abs(q.scale) > 1.5 * std::abs(scale);
       ++i) {
    const int digit = q.DigitOf(shape, a, b);
    q.Enter(shape, digit);
    length /= 4;
    begin += digit * length;
  }
  return {begin, begin + length};
}

SidePoints::SidePoints(const BuildingView& view) : view_(&view) {
  const size_t cells = view.partition->cells.size();
  cell_areas_.resize(cells);
  for (size_t c = 0; c < cells; ++c) {
    for (const Patch& patch : view.load_cell(CellId(c)).patches) {
      if (Reflects(patch, view.scene->materials)) {
        cell_areas_[c] += PatchArea(patch);
      }
    }
    area_ += cell_areas_[c];
  }
}

std::vector<SidePoint> SidePoints::At(std::span<const double> places) const {
  ENFILADE_CHECK(area_ > 0, "no reflecting side");
  std::vector<SidePoint> points;
  points.reserve(places.size());
  double passed = 0;  // area up to the end of the cell at hand
  for (size_t c = 0; c < cell_areas_.size() && points.size() < places.size();
       ++c) {
    const double cell_begin = passed;
    passed += cell_areas_[c];
    if (cell_areas_[c] <= 0 || places[points.size()] >= passed) {
      continue;
    }
    const CellPatches cell = view_->load_cell(CellId(c));
    double begin = cell_begin;
    for (size_t p = 0; p < cell.patches.size(); ++p) {
      const Patch& patch = cell.patches[p];
      if (!Reflects(patch, view_->scene->materials)) {
        continue;
      }
      const double area = PatchArea(patch);
      while (points.size() < places.size() &&
             places[points.size()] < begin + area) {
        const double fraction = (places[points.size()] - begin) / area;
        points.push_back(
            MakePoint(CellId(c), PatchId(p), patch, std::max(0.0, fraction)));
      }
      begin += area;
    }
  }
  // Rounding may leave the last places a hair beyond the last patch.
  ENFILADE_CHECK(!points.empty(), "no point of {}", places.size());
  while (points.size() < places.size()) {
    points.push_back(points.back());
  }
  return points;
}

}  // namespace enfilade
