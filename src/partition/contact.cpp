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
constexpr uint64_t kContactBytesPerPatch = 300;
// What is small is cut out of what is so many times as large by a frame at
// this distance, relative to its size: its lines would cut all of it else.
constexpr double kFramedFrom = 6;
constexpr double kFrameMargin = 0.4;
// Lengths up to this ratio are alike.
constexpr double kAlikeShare = 1.05;
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

// What stands or lies on one patch.
struct Contacts {
  std::vector<Segment> rims;
  std::vector<Polygon> covers;
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
  // Segments that hang together.
  struct Chain {
    std::vector<Segment> segments;
    Polygon ends;
    Box3 box;
    double length = 0;
    bool is_at_lamp = false;  // as near as it is long
    bool is_cover = false;    // something lies within it
  };

  [[nodiscard]] Chain ChainOf(std::vector<Segment> segments) const {
    Chain chain;
    for (const Segment& segment : segments) {
      chain.ends.push_back(segment.a);
      chain.ends.push_back(segment.b);
    }
    chain.segments = std::move(segments);
    chain.box = BoundsOf(chain.ends);
    chain.length = Length(chain.box.Extent());
    chain.is_at_lamp = chain.length < kLeastContactM &&
                       MeetsLamp(Grown(chain.box, chain.length));
    return chain;
  }

  // Segments that reach far together with all that they hang together with, or
  // are as near to a lamp as they are long. These are framed where the polygon
  // is far larger.
  [[nodiscard]] std::vector<Segment> ThoseThatMatter(
      const std::vector<Segment>& feet,
      const std::vector<Segment>& covers,
      const Polygon& polygon,
      const Plane& plane) const {
    std::vector<Segment> segments = feet;
    Append(covers, &segments);
    DisjointSets sets = ChainsOf(segments);
    std::vector<std::vector<Segment>> members(segments.size());
    std::vector<bool> is_cover(segments.size());
    for (uint32_t i = 0; i < segments.size(); ++i) {
      const uint32_t set = sets.Find(i);
      members[set].push_back(segments[i]);
      is_cover[set] = is_cover[set] || i >= feet.size();
    }
    const double size = Length(BoundsOf(polygon).Extent());
    std::vector<Segment> kept;
    std::vector<Chain> far;
    for (size_t i = 0; i < members.size(); ++i) {
      if (members[i].empty()) {
        continue;
      }
      Chain chain = ChainOf(std::move(members[i]));
      chain.is_cover = is_cover[i];
      if (chain.is_at_lamp) {
        if (size > kFramedFrom * chain.length) {
          Append(FrameAround(chain.ends, plane), &kept);
        }
        for (Segment& segment : chain.segments) {
          segment.least_run = kShortRunAtLampM;
        }
        Append(chain.segments, &kept);
      } else if (chain.length >= kLeastContactM) {
        far.push_back(std::move(chain));
      }
    }
    AppendLongest(std::move(far), &kept);
    return kept;
  }

  static void Append(std::span<const Segment> more, std::vector<Segment>* all) {
    all->insert(all->end(), more.begin(), more.end());
  }

  // Those of which no part has to be left for want of parts. A floor would be
  // in strips along some of its many feet, and they would be of no use to the
  // others: what is as short as those that do not fit is left to refinement.
  // What lies on the floor hides it whole, however many there are.
  static void AppendLongest(std::vector<Chain> chains,
                            std::vector<Segment>* kept) {
    std::stable_sort(
        chains.begin(), chains.end(), [](const Chain& a, const Chain& b) {
          return a.length > b.length;
        });
    size_t fitting = kept->size();
    double too_short = 0;
    for (const Chain& chain : chains) {
      fitting += chain.segments.size();
      if (fitting >= kMostContactParts) {
        too_short = chain.length * kAlikeShare;
        break;
      }
    }
    for (const Chain& chain : chains) {
      if (chain.is_cover || chain.length > too_short) {
        Append(chain.segments, kept);
      }
    }
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
    std::vector<Segment> feet;
    std::vector<Segment> rims;
    for (const uint32_t k : near) {
      const Polygon other = PolygonOf(patches_[k]);
      if (std::abs(Dot(PatchNormal(patches_[k]), plane.normal)) <
          kLeastFacing) {
        if (const auto foot = FootOf(other, plane)) {
          feet.push_back(*foot);
        }
      } else if (IsJustBefore(other, plane)) {
        contacts.covers.push_back(other);
        AddRim(other, &rims);
      }
    }
    contacts.rims = ThoseThatMatter(feet, rims, polygon, plane);
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
    if (contacts.rims.empty() && contacts.covers.empty()) {
      kept->push_back(patch);
      return;
    }
    const std::vector<Polygon> parts = CutAlongSegments(
        polygon, plane.normal, contacts.rims, kMostContactParts);
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
