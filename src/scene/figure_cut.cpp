#include "scene/figure_cut.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

Vec3 DominantDirection(std::span<const Edge3> edges, Vec3 normal) {
  constexpr size_t kBins = 180;  // of half a degree, over a right angle
  const PlaneFrame frame = MakePlaneFrame({}, normal, {1, 0, 0});
  std::vector<double> length(kBins, 0);
  std::vector<Vec3> longest(kBins);
  for (const Edge3& e : edges) {
    const Vec3 d = e.to - e.from;
    const double angle = std::atan2(Dot(d, frame.v), Dot(d, frame.u));
    const double quarter = angle / std::acos(0.0);
    const double turn = quarter - std::floor(quarter);
    const size_t bin =
        static_cast<size_t>(std::lround(turn * static_cast<double>(kBins))) %
        kBins;
    length[bin] += Length(d);
    if (Length(d) > Length(longest[bin])) {
      longest[bin] = d;
    }
  }
  const auto best = std::max_element(length.begin(), length.end());
  const Vec3 along = longest[static_cast<size_t>(best - length.begin())];
  return Length(along) > 0 ? along : frame.u;
}

std::vector<Polygon3> CutFigure(std::span<const Edge3> edges,
                                Vec3 normal,
                                double tolerance,
                                int threshold) {
  const PlaneFrame frame = MakePlaneFrame(
      edges.front().from, normal, DominantDirection(edges, normal));
  std::vector<Edge2> flat;
  std::vector<std::pair<Point2, Point3>> known;
  for (const Edge3& e : edges) {
    flat.push_back({frame.To2(e.from), frame.To2(e.to)});
    known.emplace_back(flat.back().from, e.from);
  }
  const auto by_place = [](const auto& a, const auto& b) {
    return std::pair(a.first.x, a.first.y) < std::pair(b.first.x, b.first.y);
  };
  std::stable_sort(known.begin(), known.end(), by_place);
  const auto lift = [&](Point2 p) {
    const auto it = std::lower_bound(
        known.begin(), known.end(), std::pair(p, Point3{}), by_place);
    const Point3 lifted = frame.To3(p);
    const bool is_known = it != known.end() && it->first == p &&
                          Length(it->second - lifted) <= tolerance;
    return is_known ? it->second : lifted;
  };
  std::vector<Polygon3> pieces;
  for (const Polygon2& piece : CutRegion(flat, tolerance, threshold)) {
    Polygon3 points;
    for (const Point2 p : piece) {
      points.push_back(lift(p));
    }
    pieces.push_back(std::move(points));
  }
  return pieces;
}

std::optional<Polygon3> AsConvex(std::span<const Edge3> edges, Vec3 normal) {
  constexpr size_t kMostCorners = 8;
  if (edges.size() < 3 || edges.size() > kMostCorners) {
    return std::nullopt;
  }
  const PlaneFrame frame =
      MakePlaneFrame(edges[0].from, normal, edges[0].to - edges[0].from);
  Polygon2 flat;
  Polygon3 points;
  for (size_t i = 0; i < edges.size(); ++i) {
    if (edges[i].to != edges[(i + 1) % edges.size()].from) {
      return std::nullopt;
    }
    flat.push_back(frame.To2(edges[i].from));
    points.push_back(edges[i].from);
  }
  return IsConvex(flat, 0) ? std::optional(std::move(points)) : std::nullopt;
}

Polygon3 Straightened(std::span<const Point3> loop, double tolerance) {
  Polygon3 kept;
  // Each vertex that is dropped moves the outline by its distance from the line
  // that takes its place: along an arc of many short edges these add up. What
  // is dropped before the first vertex that is kept belongs to the last run.
  double moved = 0;
  double moved_at_first = 0;
  const size_t n = loop.size();
  for (size_t i = 0; i < n; ++i) {
    const Point3 before = kept.empty() ? loop[n - 1] : kept.back();
    const Vec3 through = loop[(i + 1) % n] - before;
    const Vec3 here = loop[i] - before;
    const double length = Length(through);
    const double aside = length > 0 ? Length(Cross(through, here)) / length : 0;
    const bool straight =
        length > 0 && moved_at_first + moved + aside <= tolerance &&
        Dot(through, here) >= 0 && Dot(through, here) <= length * length;
    if (straight) {
      moved += aside;
      continue;
    }
    if (kept.empty()) {
      moved_at_first = moved;
    }
    moved = 0;
    kept.push_back(loop[i]);
  }
  return kept;
}

}  // namespace enfilade
