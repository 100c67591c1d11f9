#include "partition/contact.h"

#include "base/disjoint_sets.h"
#include "partition/overlap.h"
#include "partition/patch_cutter.h"
#include "partition/polygon.h"
#include "partition/segment_cut.h"
#include "scene/box_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

namespace enfilade {
namespace {

// What reaches no further before a surface lies in it.
constexpr double kInPlaneM = kMostLayers * kApartM + kCoincidentM;
// Ends of segments nearer than this meet.
constexpr double kMeetM = 1e-3;
// A part is covered if no more than this share of it is free.
constexpr double kFreeShare = 0.02;
constexpr uint64_t kContactBytesPerPatch = 400;
// What is small is cut out of what is so many times as large by a frame at
// this distance, relative to its size: its lines would cut all of it else.
constexpr double kFramedFrom = 6;
constexpr double kFrameMargin = 0.4;
// Lengths up to this ratio are alike.
constexpr double kAlike = 1.05;
// What stands beside a lamp and is no longer than this may be its luminaire.
constexpr double kMostLuminaireM = 2;
// Beside lamps, rims are followed by runs as short as this.
constexpr double kShortRunAtLampM = 2e-3;

// Where a polygon that reaches before the plane meets it: the segment between
// the two points farthest apart of those in the plane.
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

// Which of the segments hang together, end by end.
DisjointSets ChainsOf(const std::vector<Segment>& segments) {
  struct End {
    Point3 at;
    uint32_t segment = 0;
  };

  std::vector<End> ends;
  for (uint32_t i = 0; i < segments.size(); ++i) {
    ends.push_back({segments[i].a, i});
    ends.push_back({segments[i].b, i});
  }
  std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
    return std::pair(a.at.x, a.segment) < std::pair(b.at.x, b.segment);
  });
  DisjointSets chains(segments.size());
  for (size_t i = 0; i < ends.size(); ++i) {
    for (size_t k = i + 1;
         k < ends.size() && ends[k].at.x - ends[i].at.x <= kMeetM;
         ++k) {
      if (Length(ends[k].at - ends[i].at) <= kMeetM) {
        chains.Join(ends[i].segment, ends[k].segment);
      }
    }
  }
  return chains;
}

// The sides of a rectangle around points in the plane.
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

// Segments that hang together, of what stands on a patch.
struct Feet {
  double length = 0;  // from end to end of all of them
  std::vector<Segment> segments;
};

// What stands or lies on one patch.
struct Contacts {
  // Of what lies on it, and of what stands beside a lamp: these are spared.
  CutLines rims;
  std::vector<Feet> feet;  // of all else, the longest first
  std::vector<Polygon> covers;

  [[nodiscard]] size_t MostParts() const {
    return kMostContactParts * (1 + rims.spared.size());
  }
};

class ContactCutter {
 public:
  explicit ContactCutter(std::vector<Patch>& patches) : patches_(patches) {
    std::vector<Box3> boxes;
    boxes.reserve(patches.size());
    for (const Patch& p : patches) {
      boxes.push_back(Grown(BoundsOf(PolygonOf(p)), kInPlaneM));
    }
    tree_.emplace(std::move(boxes));
  }

  ContactCounts Run() {
    std::vector<Patch> kept;
    kept.reserve(patches_.size());
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      const Patch& patch = patches_[i];
      if (!(patch.reflects || patch.emits) || patch.is_enclosed) {
        kept.push_back(patch);
      } else {
        Cut(i, &kept);
      }
    }
    patches_ = std::move(kept);
    return counts_;
  }

 private:
  // Adds those that reach far together with all that they hang together with,
  // or that have a lamp beside them: as near as they are long, or as what
  // counts as long. Small ones are framed where the polygon is far larger.
  void AddThoseThatMatter(const std::vector<Segment>& of_feet,
                          const std::vector<Segment>& of_covers,
                          const Polygon& polygon,
                          const Plane& plane,
                          Contacts* contacts) const {
    std::vector<Segment> segments = of_feet;
    Append(of_covers, &segments);
    DisjointSets sets = ChainsOf(segments);
    std::vector<std::vector<Segment>> chains(segments.size());
    std::vector<bool> is_cover(segments.size());
    for (uint32_t i = 0; i < segments.size(); ++i) {
      const uint32_t set = sets.Find(i);
      chains[set].push_back(segments[i]);
      is_cover[set] = is_cover[set] || i >= of_feet.size();
    }
    const double size = Length(BoundsOf(polygon).Extent());
    for (size_t i = 0; i < chains.size(); ++i) {
      std::vector<Segment>& chain = chains[i];
      if (chain.empty()) {
        continue;
      }
      Polygon ends;
      for (const Segment& segment : chain) {
        ends.push_back(segment.a);
        ends.push_back(segment.b);
      }
      const Box3 box = BoundsOf(ends);
      const double length = Length(box.Extent());
      const bool is_small = length < kLeastContactM;
      if ((is_small || (length <= kMostLuminaireM && !is_cover[i])) &&
          MeetsLamp(Grown(box, std::min(length, kLeastContactM)))) {
        const bool is_framed = is_small && size > kFramedFrom * length;
        AddFootOfLamp(
            std::move(chain),
            is_framed ? FrameAround(ends, plane) : std::vector<Segment>(),
            {box.Center(), length / 2},
            &contacts->rims);
      } else if (is_small) {
        continue;
      } else if (is_cover[i]) {
        Append(chain, &contacts->rims.segments);
      } else {
        contacts->feet.push_back({length, std::move(chain)});
      }
    }
    std::stable_sort(
        contacts->feet.begin(),
        contacts->feet.end(),
        [](const Feet& a, const Feet& b) { return a.length > b.length; });
  }

  // What stands beside a lamp, and the frame that it is cut out by.
  static void AddFootOfLamp(std::vector<Segment> chain,
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

  static void Append(std::span<const Segment> more, std::vector<Segment>* all) {
    all->insert(all->end(), more.begin(), more.end());
  }

  static std::vector<Polygon> CutAlong(const Contacts& contacts,
                                       size_t feet,
                                       const Polygon& polygon,
                                       const Plane& plane) {
    CutLines lines = contacts.rims;
    for (size_t i = 0; i < feet; ++i) {
      Append(contacts.feet[i].segments, &lines.segments);
    }
    return CutAlongSegments(polygon, plane.normal, lines, contacts.MostParts());
  }

  // Along all feet or, where that takes more parts than there may be, along the
  // longest. A floor would be in strips along some of its many feet, which are
  // of no use to the others: what does not fit is left to refinement, with all
  // that is as short.
  static std::vector<Polygon> CutAlongThoseThatFit(const Contacts& contacts,
                                                   const Polygon& polygon,
                                                   const Plane& plane) {
    const auto& feet = contacts.feet;
    const size_t most = contacts.MostParts();
    std::vector<Polygon> parts =
        CutAlong(contacts, feet.size(), polygon, plane);
    if (parts.size() < most || feet.empty()) {
      return parts;
    }
    size_t fits = 0;
    for (size_t too_many = feet.size(); fits + 1 < too_many;) {
      const size_t middle = (fits + too_many) / 2;
      parts = CutAlong(contacts, middle, polygon, plane);
      (parts.size() < most ? fits : too_many) = middle;
    }
    while (fits > 0 && feet[fits - 1].length <= kAlike * feet[fits].length) {
      --fits;
    }
    return CutAlong(contacts, fits, polygon, plane);
  }

  [[nodiscard]] bool MeetsLamp(const Box3& box) const {
    bool meets = false;
    tree_->ForOverlaps(box,
                       [&](uint32_t k) { meets = meets || patches_[k].emits; });
    return meets;
  }

  [[nodiscard]] Contacts ContactsOf(uint32_t own,
                                    const Polygon& polygon,
                                    const Plane& plane) const {
    std::vector<uint32_t> near;
    tree_->ForOverlaps(BoundsOf(polygon), [&](uint32_t k) {
      if (k != own) {
        near.push_back(k);
      }
    });
    std::sort(near.begin(), near.end());
    Contacts contacts;
    std::vector<Segment> of_feet;
    std::vector<Segment> of_covers;
    for (const uint32_t k : near) {
      const Polygon other = PolygonOf(patches_[k]);
      if (std::abs(Dot(PatchNormal(patches_[k]), plane.normal)) <
          kLeastFacing) {
        if (const auto foot = FootOf(other, plane)) {
          of_feet.push_back(*foot);
        }
      } else if (IsJustBefore(other, plane)) {
        contacts.covers.push_back(other);
        AddRim(other, &of_covers);
      }
    }
    AddThoseThatMatter(of_feet, of_covers, polygon, plane, &contacts);
    return contacts;
  }

  static bool IsJustBefore(const Polygon& polygon, const Plane& plane) {
    return std::all_of(polygon.begin(), polygon.end(), [&](Point3 p) {
      const double height = plane.Distance(p);
      return height > kCoincidentM && height <= kInPlaneM;
    });
  }

  static void AddRim(const Polygon& polygon, std::vector<Segment>* rims) {
    for (size_t i = 0; i < polygon.size(); ++i) {
      rims->push_back({polygon[i], polygon[(i + 1) % polygon.size()]});
    }
  }

  static bool IsCovered(const Polygon& part,
                        Vec3 normal,
                        const std::vector<Polygon>& covers) {
    std::vector<const Polygon*> over;
    over.reserve(covers.size());
    for (const Polygon& cover : covers) {
      over.push_back(&cover);
    }
    double free = 0;
    for (const Polygon& rest : Subtract(part, normal, over)) {
      free += PolygonArea(rest);
    }
    return free <= kFreeShare * PolygonArea(part);
  }

  void Cut(uint32_t own, std::vector<Patch>* kept) {
    const Polygon polygon = PolygonOf(patches_[own]);
    const Plane plane = PlaneOf(polygon);
    const Contacts contacts = ContactsOf(own, polygon, plane);
    Patch patch = patches_[own];
    if (contacts.rims.segments.empty() && contacts.feet.empty() &&
        contacts.covers.empty()) {
      kept->push_back(patch);
      return;
    }
    const std::vector<Polygon> parts =
        CutAlongThoseThatFit(contacts, polygon, plane);
    counts_.cut += parts.size() > 1 ? 1U : 0U;
    for (const Polygon& part : parts) {
      patch.is_enclosed = !contacts.covers.empty() &&
                          IsCovered(part, plane.normal, contacts.covers);
      counts_.covered_m2 += patch.is_enclosed ? PolygonArea(part) : 0;
      if (parts.size() == 1) {
        kept->push_back(patch);
      } else {
        AppendAsPatches(patch, part, {}, kept);
      }
    }
  }

  std::vector<Patch>& patches_;
  std::optional<BoxTree> tree_;
  ContactCounts counts_;
};

}  // namespace

ContactCounts CutAlongContacts(std::vector<Patch>& patches) {
  return ContactCutter(patches).Run();
}

uint64_t CutAlongContactsBytes(size_t patches) {
  return patches * kContactBytesPerPatch;
}

}  // namespace enfilade
