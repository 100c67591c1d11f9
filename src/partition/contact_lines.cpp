#include "partition/contact_lines.h"

#include "base/disjoint_sets.h"
#include "scene/box_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace enfilade {
namespace {

// Two ends of segments that are nearer than this meet.
constexpr double kMeetM = 1e-3;
// A small foot on a polygon that is at least kFramedFrom times as large gets a
// frame around it, at kFrameMargin times the foot's size, along which it is cut
// out of the polygon. Without the frame, the lines of the foot would cut the
// whole polygon.
constexpr double kFramedFrom = 6;
constexpr double kFrameMargin = 0.4;
// A surface that stands beside a lamp and is no longer than this may be its
// luminaire.
constexpr double kMostLuminaireM = 2;
// Lengths up to this ratio count as equal.
constexpr double kAlike = 1.05;
// A short foot beside a lamp cuts a part even if it runs only this far through
// the part.
constexpr double kShortRunAtLampM = 2e-3;

size_t LongestAxis(Vec3 extent) {
  if (extent.x >= extent.y && extent.x >= extent.z) {
    return 0;
  }
  return extent.y >= extent.z ? 1 : 2;
}

// Groups the segments into chains whose ends meet.
DisjointSets JoinEndToEnd(const std::vector<Segment>& segments) {
  struct End {
    Point3 at;
    uint32_t segment = 0;
  };

  std::vector<End> ends;
  for (uint32_t i = 0; i < segments.size(); ++i) {
    ends.push_back({segments[i].a, i});
    ends.push_back({segments[i].b, i});
  }
  // Along the axis on which they are spread the most, few are beside each
  // other.
  Box3 box;
  for (const End& end : ends) {
    box.Include(end.at);
  }
  const size_t axis = LongestAxis(box.Extent());
  std::sort(ends.begin(), ends.end(), [axis](const End& a, const End& b) {
    return std::pair(a.at[axis], a.segment) < std::pair(b.at[axis], b.segment);
  });
  DisjointSets chains(segments.size());
  for (size_t i = 0; i < ends.size(); ++i) {
    for (size_t k = i + 1;
         k < ends.size() && ends[k].at[axis] - ends[i].at[axis] <= kMeetM;
         ++k) {
      if (Length(ends[k].at - ends[i].at) <= kMeetM) {
        chains.Join(ends[i].segment, ends[k].segment);
      }
    }
  }
  return chains;
}

// The sides of a rectangle in the plane around the points, with a margin.
std::vector<Segment> FrameAround(const Polygon& points, const Plane& plane) {
  const Box3 box = BoundsOf(points);
  const Vec3 extent = box.Extent();
  const Vec3 axis =
      std::abs(plane.normal.z) < kLeastFacing ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
  const Vec3 v =
      Normalize(axis - plane.normal * Dot(axis, plane.normal)) * Length(extent);
  const Vec3 u = Cross(v, plane.normal);
  const Point3 middle = box.Center();
  const double reach = 0.5 + kFrameMargin;
  const Vec3 x = u * reach;
  const Vec3 y = v * reach;
  const std::array<Point3, 4> corners = {
      middle - x - y, middle + x - y, middle + x + y, middle - x + y};
  std::vector<Segment> sides;
  for (size_t i = 0; i < corners.size(); ++i) {
    sides.push_back({corners[i], corners[(i + 1) % corners.size()]});
  }
  return sides;
}

void Append(std::span<const Segment> more, std::vector<Segment>* all) {
  all->insert(all->end(), more.begin(), more.end());
}

// A chain of segments whose ends meet.
struct Chain {
  std::vector<Segment> segments;
  bool is_cover = false;  // contains a rim of a surface that lies on the patch
};

std::vector<Chain> ChainsOf(const Touching& touching) {
  std::vector<Segment> segments = touching.feet;
  Append(touching.rims, &segments);
  DisjointSets sets = JoinEndToEnd(segments);
  std::vector<Chain> chains(segments.size());
  for (uint32_t i = 0; i < segments.size(); ++i) {
    Chain& chain = chains[sets.Find(i)];
    chain.segments.push_back(segments[i]);
    chain.is_cover = chain.is_cover || i >= touching.feet.size();
  }
  std::erase_if(chains, [](const Chain& c) { return c.segments.empty(); });
  return chains;
}

// Adds the foot of a surface that stands beside a lamp, and the frame around
// it.
void AddFootOfLamp(std::vector<Segment> chain,
                   std::vector<Segment> frame,
                   Spared spared,
                   CutLines* rims) {
  spared.foot = static_cast<uint32_t>(rims->spared.size() + 1);
  if (2 * spared.radius < kLeastContactM) {
    for (Segment& segment : chain) {
      segment.least_run = kShortRunAtLampM;
    }
  }
  for (std::vector<Segment>* segments : {&frame, &chain}) {
    for (Segment& segment : *segments) {
      segment.foot = spared.foot;
    }
    Append(*segments, &rims->segments);
  }
  rims->spared.push_back(spared);
}

std::vector<Polygon> CutAlong(const ContactLines& of,
                              size_t feet,
                              const Polygon& polygon,
                              const Plane& plane) {
  CutLines lines = of.rims;
  for (size_t i = 0; i < feet; ++i) {
    Append(of.feet[i].segments, &lines.segments);
  }
  return CutAlongSegments(polygon, plane.normal, lines, of.MostParts());
}

}  // namespace

// The segment where a polygon that reaches in front of the plane meets the
// plane: it joins the two points in the plane that are farthest apart.
std::optional<Segment> FootOf(const Polygon& polygon, const Plane& plane) {
  std::vector<Point3> in_plane;
  double highest = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point3 a = polygon[i];
    const Point3 b = polygon[(i + 1) % polygon.size()];
    const double at_a = plane.Distance(a);
    const double at_b = plane.Distance(b);
    highest = std::max(highest, at_a);
    if (std::abs(at_a) <= kInPlaneM) {
      in_plane.push_back(a - plane.normal * at_a);
    } else if (std::abs(at_b) > kInPlaneM && (at_a < 0) != (at_b < 0)) {
      in_plane.push_back(a + (b - a) * (at_a / (at_a - at_b)));
    }
  }
  if (highest <= kInPlaneM) {
    return std::nullopt;
  }
  Segment foot;
  double longest = kMeetM;
  for (size_t i = 0; i < in_plane.size(); ++i) {
    for (size_t k = i + 1; k < in_plane.size(); ++k) {
      const double length = Length(in_plane[k] - in_plane[i]);
      if (length > longest) {
        longest = length;
        foot = {in_plane[i], in_plane[k]};
      }
    }
  }
  return longest > kMeetM ? std::optional(foot) : std::nullopt;
}

ContactLines LinesThatMatter(
    const Touching& touching,
    const Polygon& polygon,
    const Plane& plane,
    const std::function<bool(const Box3&)>& meets_lamp) {
  ContactLines lines;
  const double size = Length(BoundsOf(polygon).Extent());
  for (Chain& chain : ChainsOf(touching)) {
    Polygon ends;
    for (const Segment& segment : chain.segments) {
      ends.push_back(segment.a);
      ends.push_back(segment.b);
    }
    const Box3 box = BoundsOf(ends);
    const double length = Length(box.Extent());
    const bool is_small = length < kLeastContactM;
    if ((is_small || (length <= kMostLuminaireM && !chain.is_cover)) &&
        meets_lamp(Grown(box, std::min(length, kLeastContactM)))) {
      const bool is_framed = is_small && size > kFramedFrom * length;
      AddFootOfLamp(
          std::move(chain.segments),
          is_framed ? FrameAround(ends, plane) : std::vector<Segment>(),
          {box.Center(), length / 2},
          &lines.rims);
    } else if (is_small) {
      continue;
    } else if (chain.is_cover) {
      Append(chain.segments, &lines.rims.segments);
    } else {
      lines.feet.push_back({length, std::move(chain.segments)});
    }
  }
  std::stable_sort(
      lines.feet.begin(), lines.feet.end(), [](const Feet& a, const Feet& b) {
        return a.length > b.length;
      });
  return lines;
}

std::vector<Polygon> CutAlongThoseThatFit(const ContactLines& lines,
                                          const Polygon& polygon,
                                          const Plane& plane) {
  const auto& feet = lines.feet;
  const size_t most = lines.MostParts();
  std::vector<Polygon> parts = CutAlong(lines, feet.size(), polygon, plane);
  if (parts.size() < most || feet.empty()) {
    return parts;
  }
  size_t fits = 0;
  for (size_t too_many = feet.size(); fits + 1 < too_many;) {
    const size_t middle = (fits + too_many) / 2;
    parts = CutAlong(lines, middle, polygon, plane);
    (parts.size() < most ? fits : too_many) = middle;
  }
  while (fits > 0 && feet[fits - 1].length <= kAlike * feet[fits].length) {
    --fits;
  }
  return CutAlong(lines, fits, polygon, plane);
}

}  // namespace enfilade
