#include "partition/contact.h"

#include "base/stop.h"
#include "partition/contact_lines.h"
#include "partition/overlap.h"
#include "partition/patch_cutter.h"
#include "partition/polygon.h"
#include "scene/box_tree.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

// A part is covered if at most this share of it is free.
constexpr double kFreeShare = 0.02;
// A surface that is nearer than this in front of another lies on it, m. Light
// reaches into a gap of 2 mm, as between tiles.
constexpr double kTouchM = 1e-3;
constexpr uint64_t kContactBytesPerPatch = 400;

// The surfaces that stand or lie on one patch.
struct Contacts {
  ContactLines lines;
  std::vector<Polygon> covers;
};

// Whether `cover` lies on `patch`: in the scene, at most kTouchM in front of
// it.
bool IsJustBefore(const Patch& cover, const Patch& patch, const Plane& plane) {
  const double most =
      kTouchM + kApartM * static_cast<double>(cover.layer + patch.layer);
  const Polygon polygon = PolygonOf(cover);
  return std::all_of(polygon.begin(), polygon.end(), [&](Point3 p) {
    const double height = plane.Distance(p);
    return height > kCoincidentM && height <= most;
  });
}

bool IsCovered(const Polygon& part,
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

void AddRim(const Polygon& polygon, std::vector<Segment>* rims) {
  for (size_t i = 0; i < polygon.size(); ++i) {
    rims->push_back({polygon[i], polygon[(i + 1) % polygon.size()]});
  }
}

class ContactCutter {
 public:
  ContactCutter(std::vector<Patch>& patches,
                const std::function<void(uint64_t)>& grow)
      : patches_(patches), grow_(grow) {
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
      ThrowIfStopRequested();
      MakeRoom(1, &kept);
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
  // Makes room for `more` further patches.
  void MakeRoom(size_t more, std::vector<Patch>* kept) const {
    if (kept->size() + more <= kept->capacity()) {
      return;
    }
    const size_t room = std::max(2 * kept->capacity(), kept->size() + more);
    if (grow_) {
      grow_((kept->capacity() + room) * sizeof(Patch));
    }
    kept->reserve(room);
  }

  [[nodiscard]] bool MeetsLamp(const Box3& box) const {
    bool meets = false;
    tree_->ForOverlaps(box,
                       [&](uint32_t k) { meets = meets || patches_[k].emits; });
    return meets;
  }

  // Whether a patch just before another is a lamp that faces it. Light then
  // fills the gap between them.
  [[nodiscard]] bool EmitsTowards(uint32_t before, uint32_t patch) const {
    return patches_[before].emits &&
           Dot(PatchNormal(patches_[before]), PatchNormal(patches_[patch])) < 0;
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
    Touching touching;
    std::vector<uint32_t> covers;
    std::vector<FaceId> lit_from;
    for (const uint32_t k : near) {
      const Polygon other = PolygonOf(patches_[k]);
      if (std::abs(Dot(PatchNormal(patches_[k]), plane.normal)) <
          kLeastFacing) {
        if (const auto foot = FootOf(other, plane)) {
          touching.feet.push_back(*foot);
        }
      } else if (IsJustBefore(patches_[k], patches_[own], plane)) {
        if (EmitsTowards(k, own)) {
          lit_from.push_back(patches_[k].face);
        }
        covers.push_back(k);
        AddRim(other, &touching.rims);
      }
    }
    // A lamp does not cover what it shines on, nor does its other side; and
    // nothing covers a lamp.
    for (const uint32_t k : covers) {
      const bool is_lit =
          std::find(lit_from.begin(), lit_from.end(), patches_[k].face) !=
          lit_from.end();
      if (!is_lit && !patches_[own].emits) {
        contacts.covers.push_back(PolygonOf(patches_[k]));
      }
    }
    contacts.lines =
        LinesThatMatter(touching, polygon, plane, [&](const Box3& box) {
          return MeetsLamp(box);
        });
    return contacts;
  }

  void Cut(uint32_t own, std::vector<Patch>* kept) {
    const Polygon polygon = PolygonOf(patches_[own]);
    const Plane plane = PlaneOf(polygon);
    const Contacts contacts = ContactsOf(own, polygon, plane);
    Patch patch = patches_[own];
    if (contacts.lines.IsEmpty() && contacts.covers.empty()) {
      kept->push_back(patch);
      return;
    }
    const std::vector<Polygon> parts =
        CutAlongThoseThatFit(contacts.lines, polygon, plane);
    counts_.cut += parts.size() > 1 ? 1U : 0U;
    for (const Polygon& part : parts) {
      patch.is_enclosed = !contacts.covers.empty() &&
                          IsCovered(part, plane.normal, contacts.covers);
      counts_.covered_m2 += patch.is_enclosed ? PolygonArea(part) : 0;
      if (parts.size() == 1) {
        kept->push_back(patch);
      } else {
        MakeRoom(part.size(), kept);
        AppendAsPatches(patch, part, {}, kept);
      }
    }
  }

  std::vector<Patch>& patches_;
  const std::function<void(uint64_t)>& grow_;
  std::optional<BoxTree> tree_;
  ContactCounts counts_;
};

}  // namespace

ContactCounts CutAlongContacts(std::vector<Patch>& patches,
                               const std::function<void(uint64_t)>& grow) {
  return ContactCutter(patches, grow).Run();
}

uint64_t CutAlongContactsBytes(size_t patches) {
  return patches * kContactBytesPerPatch;
}

}  // namespace enfilade
