#include "partition/segment_cut.h"

#include "base/stop.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

// A part with this length over its width, or more, is a strip if it is narrower
// than kStripM.
constexpr double kStripRatio = 8;
constexpr double kStripM = 0.1;
// A line makes a strip in vain if its run is shorter than this share of the
// strip.
constexpr double kUsedShare = 0.95;

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

// Whether the part is a strip of which something that is `run` long needs only
// a piece.
bool IsStripInVain(const Polygon& part, double run) {
  const double length = DiameterOf(part);
  const double width = PolygonArea(part) / length;
  return width < kStripM && kStripRatio * width < length &&
         run < kUsedShare * length;
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
    const Plane side = EdgePlane(corner, next, normal);
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

// A segment that runs through the inside of a part.
struct Run {
  double length = 0;  // m
  Segment segment;
};

struct Part {
  Polygon polygon;
  std::vector<Run> runs;
  std::vector<Spared> spared;  // inside the part
};

bool IsInside(Point3 p, const Polygon& polygon, Vec3 normal) {
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point3 corner = polygon[i];
    const Point3 next = polygon[(i + 1) % polygon.size()];
    if (Length(next - corner) > kRoundingM &&
        EdgePlane(corner, next, normal).Distance(p) < 0) {
      return false;
    }
  }
  return true;
}

// Makes a part of a whole. Each part keeps only the runs and feet inside it, so
// that all parts that wait to be cut hold no more together than the whole.
Part MakePart(Polygon polygon, const Part& whole, Vec3 normal) {
  Part part;
  for (const Run& run : whole.runs) {
    const double length = RunOf(run.segment, polygon, normal);
    if (length >= run.segment.least_run) {
      part.runs.push_back({length, run.segment});
    }
  }
  std::copy_if(whole.spared.begin(),
               whole.spared.end(),
               std::back_inserter(part.spared),
               [&](const Spared& spared) {
                 return IsInside(spared.middle, polygon, normal);
               });
  part.polygon = std::move(polygon);
  return part;
}

// How many spared feet a line of the foot `foot` goes through, not counting
// that foot itself.
size_t Through(const std::vector<Spared>& spared,
               const Plane& line,
               uint32_t foot) {
  return static_cast<size_t>(
      std::count_if(spared.begin(), spared.end(), [&](const Spared& s) {
        return s.foot != foot && std::abs(line.Distance(s.middle)) < s.radius;
      }));
}

// A cut of a part, and the two sides of its line.
struct Cut {
  std::optional<size_t> run;  // along which the part is cut
  SplitPolygons sides;
};

// The sides of a line through a part; nullopt if it does not cut the part, or
// leaves something narrow.
std::optional<SplitPolygons> SidesOf(const Part& part, const Plane& line) {
  if (Classify(part.polygon, line, kRoundingM) != PlaneSide::kCut) {
    return std::nullopt;
  }
  SplitPolygons sides = Split(part.polygon, line, kRoundingM);
  if (IsNarrow(sides.front) || IsNarrow(sides.back)) {
    return std::nullopt;
  }
  return sides;
}

// Whether a cut along something that is `run` long makes a strip in vain.
bool MakesStripInVain(const SplitPolygons& sides, double run) {
  return IsStripInVain(sides.front, run) || IsStripInVain(sides.back, run);
}

// A cut of the part across the segment, at one of its ends; nullopt if the part
// does not go on there or would become a strip.
std::optional<Cut> CutAcross(const Part& part,
                             const Segment& segment,
                             Vec3 normal) {
  const Vec3 along = segment.b - segment.a;
  const Vec3 across = Cross(normal, along);
  for (const Point3 end : {segment.a, segment.b}) {
    const Plane line = EdgePlane(end, end + across, normal);
    if (Through(part.spared, line, 0) > 0) {
      continue;
    }
    auto sides = SidesOf(part, line);
    if (sides && !MakesStripInVain(*sides, 0)) {
      return Cut{std::nullopt, std::move(*sides)};
    }
  }
  return std::nullopt;
}

// The next cut of a part; nullopt if no segment cuts it.
std::optional<Cut> BestCut(const Part& part, Vec3 normal) {
  std::vector<size_t> longest_first(part.runs.size());
  std::iota(longest_first.begin(), longest_first.end(), size_t{0});
  std::stable_sort(
      longest_first.begin(), longest_first.end(), [&](size_t i, size_t k) {
        return part.runs[i].length > part.runs[k].length;
      });
  std::optional<Cut> best;
  std::pair least{SIZE_MAX, true};  // feet that are gone through, a vain strip
  for (const size_t i : longest_first) {
    ThrowIfStopRequested();
    const Segment& segment = part.runs[i].segment;
    const Plane line = EdgePlane(segment.a, segment.b, normal);
    const size_t through = Through(part.spared, line, segment.foot);
    if (std::pair(through, false) >= least) {
      continue;
    }
    auto sides = SidesOf(part, line);
    if (!sides) {
      continue;
    }
    const std::pair costs{through,
                          MakesStripInVain(*sides, part.runs[i].length)};
    if (!best || costs < least) {
      best = {i, std::move(*sides)};
      least = costs;
    }
    if (least == std::pair(size_t{0}, false)) {
      break;
    }
  }
  if (best && least.second) {
    if (auto across = CutAcross(part, part.runs[*best->run].segment, normal)) {
      return across;
    }
  }
  return best;
}

}  // namespace

std::vector<Polygon> CutAlongSegments(const Polygon& polygon,
                                      Vec3 normal,
                                      const CutLines& lines,
                                      size_t most_parts) {
  Part whole;
  for (const Segment& segment : lines.segments) {
    whole.runs.push_back({0, segment});
  }
  whole.spared = lines.spared;
  std::vector<Part> open{MakePart(polygon, whole, normal)};
  std::vector<Polygon> done;
  while (!open.empty()) {
    Part part = std::move(open.back());
    open.pop_back();
    auto cut = open.size() + done.size() + 2 <= most_parts
                   ? BestCut(part, normal)
                   : std::nullopt;
    if (!cut) {
      done.push_back(std::move(part.polygon));
      continue;
    }
    if (cut->run) {
      part.runs.erase(part.runs.begin() +
                      static_cast<std::ptrdiff_t>(*cut->run));
    }
    open.push_back(MakePart(std::move(cut->sides.back), part, normal));
    open.push_back(MakePart(std::move(cut->sides.front), part, normal));
  }
  return done;
}

}  // namespace enfilade
