#include "partition/segment_cut.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

double DiameterOf(const Polygon& polygon) {
  double diameter = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    for (size_t k = i + 1; k < polygon.size(); ++k) {
      diameter = std::max(diameter, Length(polygon[k] - polygon[i]));
    }
  }
  return diameter;
}

bool IsNarrow(const Polygon& polygon) {
  return polygon.size() < 3 ||
         PolygonArea(polygon) < kNarrowPartM * DiameterOf(polygon);
}

// The plane through a line of a plane with this normal, in front on its left.
Plane PlaneThrough(Point3 a, Point3 b, Vec3 normal) {
  const Vec3 left = Normalize(Cross(normal, b - a));
  return {left, Dot(left, a - Point3{})};
}

// How far a segment runs through the inside of a polygon, m.
double RunOf(const Segment& segment, const Polygon& polygon, Vec3 normal) {
  double begin = 0;
  double end = 1;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point3 corner = polygon[i];
    const Point3 next = polygon[(i + 1) % polygon.size()];
    if (Length(next - corner) <= kRoundingM) {
      continue;
    }
    const Plane side = PlaneThrough(corner, next, normal);
    const double at_a = side.Distance(segment.a) - kNarrowPartM;
    const double at_b = side.Distance(segment.b) - kNarrowPartM;
    if (at_a < 0 && at_b < 0) {
      return 0;
    }
    if (at_a < 0) {
      begin = std::max(begin, at_a / (at_a - at_b));
    } else if (at_b < 0) {
      end = std::min(end, at_a / (at_a - at_b));
    }
  }
  return std::max(0.0, end - begin) * Length(segment.b - segment.a);
}

struct Part {
  Polygon polygon;
  std::vector<Segment> segments;  // that may run through it
};

// The two sides of a part; nothing if no segment cuts it.
std::optional<std::pair<Part, Part>> Halve(Part* part, Vec3 normal) {
  std::vector<std::pair<double, size_t>> runs;
  std::vector<Segment> inside;
  for (const Segment& segment : part->segments) {
    const double run = RunOf(segment, part->polygon, normal);
    if (run >= segment.least_run) {
      runs.emplace_back(-run, inside.size());
      inside.push_back(segment);
    }
  }
  std::sort(runs.begin(), runs.end());
  for (const auto& [run, i] : runs) {
    const Plane line = PlaneThrough(inside[i].a, inside[i].b, normal);
    if (Classify(part->polygon, line, kRoundingM) != PlaneSide::kCut) {
      continue;
    }
    SplitPolygons sides = Split(part->polygon, line, kRoundingM);
    if (IsNarrow(sides.front) || IsNarrow(sides.back)) {
      continue;
    }
    inside.erase(inside.begin() + static_cast<std::ptrdiff_t>(i));
    return std::pair(Part{std::move(sides.front), inside},
                     Part{std::move(sides.back), inside});
  }
  return std::nullopt;
}

}  // namespace

std::vector<Polygon> CutAlongSegments(const Polygon& polygon,
                                      Vec3 normal,
                                      const std::vector<Segment>& segments,
                                      size_t most_parts) {
  std::vector<Part> open{{polygon, segments}};
  std::vector<Polygon> done;
  while (!open.empty()) {
    Part part = std::move(open.back());
    open.pop_back();
    auto halves = open.size() + done.size() + 2 <= most_parts
                      ? Halve(&part, normal)
                      : std::nullopt;
    if (halves) {
      open.push_back(std::move(halves->second));
      open.push_back(std::move(halves->first));
    } else {
      done.push_back(std::move(part.polygon));
    }
  }
  return done;
}

}  // namespace enfilade
