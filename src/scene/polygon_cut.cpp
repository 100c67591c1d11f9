#include "scene/polygon_cut.h"

#include "base/plane.h"
#include "base/stop.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace enfilade {
namespace {

// An axis of a frame this close to a world axis becomes that axis.
constexpr double kAxisTolerance = 1e-7;
// Crossings within one slab. They are found from the bottom or the top, so that
// as many splits may lie within each other.
constexpr int kMostSlabSplits = 1000;

// An edge of the sweep, from bottom to top. `winding` is what crossing the edge
// from left to right adds to the winding number.
struct Leg {
  Point2 bottom, top;
  int winding = 0;

  [[nodiscard]] double XAt(double y) const {
    if (y == bottom.y) {
      return bottom.x;
    }
    if (y == top.y) {
      return top.x;
    }
    return bottom.x +
           (top.x - bottom.x) * ((y - bottom.y) / (top.y - bottom.y));
  }
};

// A piece that may still grow upwards.
struct Trapezoid {
  double y0 = 0, y1 = 0;
  double left0 = 0, right0 = 0;
  double left1 = 0, right1 = 0;
};

double Slope(double x0, double x1, double y0, double y1) {
  return (x1 - x0) / (y1 - y0);
}

// Maps coordinates that are equal within the tolerance to the same number, the
// least of them.
class Snapper {
 public:
  Snapper(std::vector<double> values, double tolerance) {
    std::sort(values.begin(), values.end());
    for (const double value : values) {
      if (kept_.empty() || value - kept_.back() > tolerance) {
        kept_.push_back(value);
      }
    }
  }

  [[nodiscard]] double operator()(double value) const {
    return *(std::upper_bound(kept_.begin(), kept_.end(), value) - 1);
  }

  [[nodiscard]] const std::vector<double>& Kept() const { return kept_; }

 private:
  std::vector<double> kept_;
};

// Sweeps upwards over slabs between consecutive vertex heights.
class Sweep {
 public:
  Sweep(std::span<const Edge2> edges, double tolerance, int threshold)
      : tolerance_(tolerance), threshold_(threshold) {
    for (const Edge2& e : edges) {
      heights_.push_back(e.from.y);
      heights_.push_back(e.to.y);
      if (e.from.y < e.to.y) {
        legs_.push_back({e.from, e.to, -1});
      } else if (e.from.y > e.to.y) {
        legs_.push_back({e.to, e.from, 1});
      }
    }
    std::sort(heights_.begin(), heights_.end());
    heights_.erase(std::unique(heights_.begin(), heights_.end()),
                   heights_.end());
    std::stable_sort(
        legs_.begin(), legs_.end(), [](const Leg& a, const Leg& b) {
          return a.bottom.y < b.bottom.y;
        });
  }

  std::vector<Polygon2> Run() {
    size_t next = 0;
    std::vector<const Leg*> active;
    for (size_t k = 0; k + 1 < heights_.size(); ++k) {
      ThrowIfStopRequested();
      std::erase_if(active,
                    [&](const Leg* leg) { return leg->top.y <= heights_[k]; });
      while (next < legs_.size() && legs_[next].bottom.y <= heights_[k]) {
        active.push_back(&legs_[next++]);
      }
      Slab(active, heights_[k], heights_[k + 1], kMostSlabSplits);
    }
    CloseAll();
    return std::move(pieces_);
  }

 private:
  void Slab(std::vector<const Leg*>& active,
            double y0,
            double y1,
            int splits_left) {
    const double middle = 0.5 * (y0 + y1);
    std::stable_sort(
        active.begin(), active.end(), [&](const Leg* a, const Leg* b) {
          return a->XAt(middle) < b->XAt(middle);
        });
    const double crossing = ACrossing(active, y0, y1);
    if (splits_left > 0 && crossing > y0 && crossing < y1) {
      Slab(active, y0, crossing, splits_left - 1);
      Slab(active, crossing, y1, splits_left - 1);
      return;
    }
    Spans(active, y0, y1);
  }

  // A height at which two legs that are neighbours at the middle of the slab
  // cross, or y0 if none cross by more than the tolerance.
  [[nodiscard]] double ACrossing(const std::vector<const Leg*>& active,
                                 double y0,
                                 double y1) const {
    for (size_t i = 0; i + 1 < active.size(); ++i) {
      const double below = active[i + 1]->XAt(y0) - active[i]->XAt(y0);
      const double above = active[i + 1]->XAt(y1) - active[i]->XAt(y1);
      if (std::min(below, above) < -tolerance_) {
        const double y = y0 + (y1 - y0) * (below / (below - above));
        if (y - y0 > tolerance_ && y1 - y > tolerance_) {
          return y;
        }
      }
    }
    return y0;
  }

  void Spans(const std::vector<const Leg*>& active, double y0, double y1) {
    std::vector<Trapezoid> spans;
    int winding = 0;
    const Leg* left = nullptr;
    for (const Leg* leg : active) {
      const bool was_inside = winding >= threshold_;
      winding += leg->winding;
      const bool is_inside = winding >= threshold_;
      if (!was_inside && is_inside) {
        left = leg;
      } else if (was_inside && !is_inside) {
        spans.push_back(
            {y0, y1, left->XAt(y0), leg->XAt(y0), left->XAt(y1), leg->XAt(y1)});
      }
    }
    JoinTouching(spans);
    Grow(spans);
  }

  // Joins spans of one slab that share a whole leg (two edges that cancel), and
  // drops thin spans.
  void JoinTouching(std::vector<Trapezoid>& spans) const {
    std::vector<Trapezoid> joined;
    for (const Trapezoid& span : spans) {
      const bool thin = span.right0 - span.left0 <= tolerance_ &&
                        span.right1 - span.left1 <= tolerance_;
      if (thin) {
        continue;
      }
      if (!joined.empty() && joined.back().right0 == span.left0 &&
          joined.back().right1 == span.left1) {
        joined.back().right0 = span.right0;
        joined.back().right1 = span.right1;
      } else {
        joined.push_back(span);
      }
    }
    spans = std::move(joined);
  }

  [[nodiscard]] bool Continues(const Trapezoid& below,
                               const Trapezoid& above) const {
    const auto same_line = [&](double b0, double b1, double a0, double a1) {
      const double height = std::max(below.y1 - below.y0, above.y1 - above.y0);
      return b1 == a0 && std::abs(Slope(b0, b1, below.y0, below.y1) -
                                  Slope(a0, a1, above.y0, above.y1)) *
                                 height <=
                             tolerance_;
    };
    return below.y1 == above.y0 &&
           same_line(below.left0, below.left1, above.left0, above.left1) &&
           same_line(below.right0, below.right1, above.right0, above.right1);
  }

  // Extends each open piece that a span continues; closes the other pieces.
  void Grow(std::vector<Trapezoid>& spans) {
    size_t at = 0;
    for (Trapezoid& span : spans) {
      while (at < open_.size() && open_[at].left1 < span.left0) {
        Close(open_[at++]);
      }
      if (at < open_.size() && Continues(open_[at], span)) {
        span.y0 = open_[at].y0;
        span.left0 = open_[at].left0;
        span.right0 = open_[at].right0;
        ++at;
      }
    }
    while (at < open_.size()) {
      Close(open_[at++]);
    }
    open_ = std::move(spans);
  }

  void CloseAll() {
    for (const Trapezoid& t : open_) {
      Close(t);
    }
    open_.clear();
  }

  void Close(const Trapezoid& t) {
    Polygon2 piece;
    piece.push_back({t.left0, t.y0});
    if (t.right0 - t.left0 > tolerance_) {
      piece.push_back({t.right0, t.y0});
    }
    if (t.right1 - t.left1 > tolerance_) {
      piece.push_back({t.right1, t.y1});
    }
    piece.push_back({t.left1, t.y1});
    if (piece.size() >= 3 && SignedArea(piece) > 0) {
      pieces_.push_back(std::move(piece));
    }
  }

  double tolerance_;
  int threshold_;
  std::vector<double> heights_;
  std::vector<Leg> legs_;
  std::vector<Trapezoid> open_;
  std::vector<Polygon2> pieces_;
};

std::vector<Edge2> SnapEdges(std::span<const Edge2> edges, double tolerance) {
  std::vector<double> xs;
  std::vector<double> ys;
  for (const Edge2& e : edges) {
    xs.insert(xs.end(), {e.from.x, e.to.x});
    ys.insert(ys.end(), {e.from.y, e.to.y});
  }
  const Snapper snap_x(std::move(xs), tolerance);
  const Snapper snap_y(std::move(ys), tolerance);
  std::vector<Edge2> snapped;
  for (const Edge2& e : edges) {
    snapped.push_back({{snap_x(e.from.x), snap_y(e.from.y)},
                       {snap_x(e.to.x), snap_y(e.to.y)}});
  }
  return snapped;
}

// The number of patches, then the total edge length, to prefer few patches
// first and round pieces second.
std::pair<size_t, double> Cost(const std::vector<Polygon2>& pieces,
                               double tolerance) {
  std::pair<size_t, double> cost{0, 0};
  for (const Polygon2& piece : pieces) {
    cost.first += PatchCost(piece, tolerance);
    for (size_t i = 0; i < piece.size(); ++i) {
      const Point2 a = piece[i];
      const Point2 b = piece[(i + 1) % piece.size()];
      cost.second += std::hypot(b.x - a.x, b.y - a.y);
    }
  }
  return cost;
}

}  // namespace

PlaneFrame MakePlaneFrame(Point3 point, Vec3 normal, Vec3 direction) {
  PlaneFrame frame;
  frame.normal = SnappedToAxis(Normalize(normal), kAxisTolerance);
  Vec3 u = direction - frame.normal * Dot(direction, frame.normal);
  if (Length(u) == 0) {
    u = std::abs(frame.normal.x) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    u = u - frame.normal * Dot(u, frame.normal);
  }
  u = SnappedToAxis(Normalize(u), kAxisTolerance);
  u = SnappedToAxis(Normalize(u - frame.normal * Dot(u, frame.normal)),
                    kAxisTolerance);
  frame.u = u;
  frame.v = SnappedToAxis(Cross(frame.normal, u), kAxisTolerance);
  const double height = Dot(point - Point3{}, frame.normal);
  frame.origin = Point3{} + frame.normal * height;
  return frame;
}

std::vector<Polygon2> CutRegion(std::span<const Edge2> edges,
                                double tolerance,
                                int threshold) {
  const std::vector<Edge2> upright = SnapEdges(edges, tolerance);
  std::vector<Edge2> turned;  // by a quarter turn clockwise
  turned.reserve(upright.size());
  for (const Edge2& e : upright) {
    turned.push_back({{e.from.y, -e.from.x}, {e.to.y, -e.to.x}});
  }
  std::vector<Polygon2> pieces = Sweep(upright, tolerance, threshold).Run();
  std::vector<Polygon2> other = Sweep(turned, tolerance, threshold).Run();
  if (Cost(other, tolerance) < Cost(pieces, tolerance)) {
    pieces = std::move(other);
    for (Polygon2& piece : pieces) {
      for (Point2& p : piece) {
        p = {-p.y, p.x};
      }
    }
  }
  return pieces;
}

double SignedArea(std::span<const Point2> polygon) {
  double twice = 0;
  for (size_t i = 1; i + 1 < polygon.size(); ++i) {
    const Point2 o = polygon[0];
    const Point2 a = polygon[i];
    const Point2 b = polygon[i + 1];
    twice += (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
  }
  return 0.5 * twice;
}

size_t PatchCost(std::span<const Point2> piece, double tolerance) {
  if (piece.size() == 4) {
    const double dx = piece[0].x + piece[2].x - piece[1].x - piece[3].x;
    const double dy = piece[0].y + piece[2].y - piece[1].y - piece[3].y;
    if (std::hypot(dx, dy) <= 2 * tolerance) {
      return 1;
    }
  }
  return piece.size() - 2;
}

bool IsConvex(std::span<const Point2> polygon, double tolerance) {
  const size_t n = polygon.size();
  double turned = 0;
  for (size_t i = 0; i < n; ++i) {
    const Point2 a = polygon[i];
    const Point2 b = polygon[(i + 1) % n];
    const Point2 c = polygon[(i + 2) % n];
    const Point2 d{b.x - a.x, b.y - a.y};
    const Point2 e{c.x - b.x, c.y - b.y};
    const double cross = d.x * e.y - d.y * e.x;
    const double dot = d.x * e.x + d.y * e.y;
    if (cross <
        -tolerance * std::max(std::hypot(d.x, d.y), std::hypot(e.x, e.y))) {
      return false;
    }
    turned += std::atan2(cross, dot);
  }
  constexpr double kMostTurn = 7.0;  // one full turn, with room for rounding
  return turned > 0 && turned < kMostTurn;
}

}  // namespace enfilade
