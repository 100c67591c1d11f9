#include "partition/overlap.h"

#include "partition/patch_cutter.h"
#include "partition/polygon.h"
#include "scene/box_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace enfilade {
namespace {

// Overlaps narrower than this, or smaller than that, are rounding.
constexpr double kNarrowM = 1e-4;
constexpr double kSmallM2 = 1e-7;
// What lies farther than this before another hides it from rays, m.
constexpr double kHiddenM = 1e-4;
// Parts smaller than this share of a patch do not count.
constexpr double kSmallShare = 0.02;
// Box, tree, rank and face area of a patch, and its share of pairs and pieces.
constexpr uint64_t kOverlapBytesPerPatch = 320;

bool LiesIn(const Polygon& polygon, const Plane& plane) {
  return Classify(polygon, plane, kCoincidentM) == PlaneSide::kOn;
}

// The part of `polygon` over `other` (both face along `normal`), a little less
// at its rim; empty where that is rounding.
Polygon OverlapOf(const Polygon& polygon, const Polygon& other, Vec3 normal) {
  Polygon rest = polygon;
  for (size_t i = 0; i < other.size() && !rest.empty(); ++i) {
    const Point3 a = other[i];
    const Vec3 in = Normalize(Cross(normal, other[(i + 1) % other.size()] - a));
    const Plane side{in, Dot(in, a - Point3{}) + kNarrowM};
    rest = ClipToFront(rest, side, kRoundingM);
  }
  return rest.size() >= 3 && PolygonArea(rest) > kSmallM2 ? rest : Polygon{};
}

// Its area; 0 where that is rounding.
double OverlapArea(const Polygon& polygon, const Polygon& other, Vec3 normal) {
  const Polygon overlap = OverlapOf(polygon, other, normal);
  return overlap.empty() ? 0 : PolygonArea(overlap);
}

// A part of a patch, and before how many others it is put.
struct Piece {
  Polygon polygon;
  uint8_t layer = 0;
};

// How many steps put what lies `height` before a plane at least half of one
// before what was put `layer` steps before that plane.
uint8_t LayerAbove(uint8_t layer, double height) {
  const double steps = std::ceil(layer + 0.5 - height / kApartM);
  return static_cast<uint8_t>(std::clamp(steps, 0.0, double{kMostLayers}));
}

uint8_t MostLayer(const std::vector<Piece>& pieces) {
  uint8_t most = 0;
  for (const Piece& piece : pieces) {
    most = std::max(most, piece.layer);
  }
  return most;
}

uint8_t LayerBefore(uint8_t layer) {
  return layer < kMostLayers ? static_cast<uint8_t>(layer + 1) : kMostLayers;
}

double AreaOf(const std::vector<Polygon>& polygons) {
  return std::accumulate(
      polygons.begin(), polygons.end(), 0.0, [](double sum, const Polygon& p) {
        return sum + PolygonArea(p);
      });
}

double AreaOf(const std::vector<Piece>& pieces) {
  return std::accumulate(
      pieces.begin(), pieces.end(), 0.0, [](double sum, const Piece& p) {
        return sum + PolygonArea(p.polygon);
      });
}

class OverlapSeparator {
 public:
  explicit OverlapSeparator(std::vector<Patch>& patches) : patches_(patches) {}

  OverlapCounts Run() {
    FindPairs();
    if (pairs_.empty()) {
      return {};
    }
    Rank();
    SortPairs();
    for (size_t first = 0; first < pairs_.size();) {
      size_t last = first;
      while (last < pairs_.size() &&
             pairs_[last].front == pairs_[first].front) {
        ++last;
      }
      Settle(std::span(pairs_).subspan(first, last - first));
      first = last;
    }
    RaiseWhatLiesAbove();
    Replace();
    return counts_;
  }

 private:
  // The one of higher rank is in front, or is cut.
  struct Pair {
    uint32_t front = 0;
    uint32_t behind = 0;
    double area = 0;  // of the overlap, m2
    // How far the front one lies before the other there, m.
    double least_rise = 0;
    double most_rise = 0;

    void Swap() {
      std::swap(front, behind);
      std::swap(least_rise, most_rise);
      least_rise = -least_rise;
      most_rise = -most_rise;
    }
  };

  void FindPairs() {
    std::vector<Box3> boxes;
    boxes.reserve(patches_.size());
    for (const Patch& p : patches_) {
      boxes.push_back(Grown(BoundsOf(PolygonOf(p)), kCoincidentM));
    }
    tree_.emplace(boxes);
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      const Polygon own = PolygonOf(patches_[i]);
      const Plane plane = PlaneOf(own);
      tree_->ForOverlaps(boxes[i], [&](uint32_t k) {
        if (k < i) {
          AddIfCoincident({i, k}, own, plane);
        }
      });
    }
  }

  // `own` and `plane` are those of the pair's front.
  void AddIfCoincident(Pair pair, const Polygon& own, const Plane& plane) {
    const Patch& patch = patches_[pair.behind];
    if (Dot(PatchNormal(patch), plane.normal) < kLeastFacing) {
      return;
    }
    const Polygon other = PolygonOf(patch);
    const Plane others = PlaneOf(other);
    if (!LiesIn(other, plane) && !LiesIn(own, others)) {
      return;
    }
    const Polygon overlap = OverlapOf(own, other, plane.normal);
    if (overlap.empty()) {
      return;
    }
    pair.area = PolygonArea(overlap);
    pair.least_rise = pair.most_rise = others.Distance(overlap.front());
    for (const Point3 p : overlap) {
      const double rise = others.Distance(p);
      pair.least_rise = std::min(pair.least_rise, rise);
      pair.most_rise = std::max(pair.most_rise, rise);
    }
    pairs_.push_back(pair);
  }

  // From back to front: what is not inside of a solid before what is, what does
  // not emit before what does, large faces (by their area on this side) before
  // small ones.
  void Rank() {
    std::unordered_map<uint64_t, double> area_of_side;
    const auto side = [](const Patch& p) {
      return uint64_t{p.face.value} << 1 | (p.is_back ? 1U : 0U);
    };
    for (const Patch& p : patches_) {
      area_of_side[side(p)] += PatchArea(p);
    }
    const auto key = [&](uint32_t i) {
      const Patch& p = patches_[i];
      return std::tuple(
          p.is_enclosed, p.emits, -area_of_side[side(p)], p.face.value, i);
    };
    std::vector<uint32_t> order(patches_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      return key(a) < key(b);
    });
    rank_.resize(order.size());
    for (uint32_t i = 0; i < order.size(); ++i) {
      rank_[order[i]] = i;
    }
  }

  void SortPairs() {
    for (Pair& pair : pairs_) {
      if (rank_[pair.front] < rank_[pair.behind]) {
        pair.Swap();
      }
    }
    std::sort(pairs_.begin(), pairs_.end(), [&](const Pair& a, const Pair& b) {
      return std::pair(rank_[a.front], rank_[a.behind]) <
             std::pair(rank_[b.front], rank_[b.behind]);
    });
  }

  [[nodiscard]] bool IsSame(const Pair& pair) const {
    const Patch& front = patches_[pair.front];
    const Patch& behind = patches_[pair.behind];
    if (front.emits != behind.emits ||
        front.is_enclosed != behind.is_enclosed || pair.most_rise > kHiddenM) {
      return false;
    }
    return (front.material == behind.material &&
            front.is_back == behind.is_back) ||
           pair.area >= (1 - kSmallShare) * PatchArea(behind);
  }

  // Decides on one patch by all that it lies in, which are decided.
  void Settle(std::span<const Pair> pairs) {
    const uint32_t own = pairs.front().front;
    const Vec3 normal = PatchNormal(patches_[own]);
    std::vector<Polygon> same;
    std::vector<Polygon> others;
    uint8_t layer = 0;
    for (const Pair& pair : pairs) {
      for (const Piece& piece : PiecesOf(pair.behind)) {
        if (IsSame(pair)) {
          same.push_back(piece.polygon);
        } else {
          others.push_back(piece.polygon);
          layer = std::max(layer, LayerBefore(piece.layer));
        }
      }
    }
    const std::vector<Polygon> before{PolygonOf(patches_[own])};
    std::vector<Piece> after;
    for (Polygon& left : WithoutThose(before, same, normal)) {
      if (patches_[own].is_enclosed) {
        after.push_back({std::move(left), layer});  // dark wherever it lies
      } else {
        AppendPieces(std::move(left), others, normal, layer, &after);
      }
    }
    const double gone = AreaOf(before) - AreaOf(after);
    if (gone > kSmallM2) {
      ++counts_.dropped;
      counts_.area_m2 += gone;
    }
    const bool moved = std::any_of(
        after.begin(), after.end(), [](const Piece& p) { return p.layer > 0; });
    counts_.moved += moved ? 1 : 0;
    if (moved || gone > kSmallM2) {
      pieces_[own] = std::move(after);
    }
  }

  static std::vector<Polygon> WithoutThose(const std::vector<Polygon>& polygons,
                                           const std::vector<Polygon>& covers,
                                           Vec3 normal) {
    std::vector<Polygon> left;
    for (const Polygon& polygon : polygons) {
      std::vector<const Polygon*> over;
      for (const Polygon& cover : covers) {
        if (OverlapArea(polygon, cover, normal) > 0) {
          over.push_back(&cover);
        }
      }
      for (Polygon& rest : Subtract(polygon, normal, over)) {
        left.push_back(std::move(rest));
      }
    }
    return left;
  }

  // What lies in others is put before them; what sticks out, if it is worth a
  // piece, stays.
  static void AppendPieces(Polygon polygon,
                           const std::vector<Polygon>& others,
                           Vec3 normal,
                           uint8_t layer,
                           std::vector<Piece>* pieces) {
    const std::vector<Polygon> out = WithoutThose({polygon}, others, normal);
    if (AreaOf(out) <= kSmallShare * PolygonArea(polygon)) {
      pieces->push_back({std::move(polygon), layer});
      return;
    }
    for (Polygon& in : WithoutThose({std::move(polygon)}, out, normal)) {
      pieces->push_back({std::move(in), layer});
    }
    for (const Polygon& rest : out) {
      pieces->push_back({rest, 0});
    }
  }

  [[nodiscard]] std::vector<Piece> PiecesOf(uint32_t i) const {
    const auto it = pieces_.find(i);
    return it != pieces_.end() ? it->second
                               : std::vector<Piece>{{PolygonOf(patches_[i])}};
  }

  // A carpet a millimetre above a floor with layers in it: they must not come
  // through. What lies that little before a patch that was put before others
  // is put before it again.
  void RaiseWhatLiesAbove() {
    std::set<uint32_t> open;
    for (const auto& [i, pieces] : pieces_) {
      if (MostLayer(pieces) > 0) {
        open.insert(i);
      }
    }
    while (!open.empty()) {
      const uint32_t i = *open.begin();
      open.erase(open.begin());
      RaiseWhatLiesAbove(i, &open);
    }
  }

  // Adds to `raised` what was.
  void RaiseWhatLiesAbove(uint32_t own, std::set<uint32_t>* raised) {
    const std::vector<Piece> pieces = PiecesOf(own);
    const Polygon polygon = PolygonOf(patches_[own]);
    const Plane plane = PlaneOf(polygon);
    const double reach = MostLayer(pieces) * kApartM + kCoincidentM;
    std::vector<uint32_t> near;
    tree_->ForOverlaps(Grown(BoundsOf(polygon), reach), [&](uint32_t k) {
      if (k != own &&
          Dot(PatchNormal(patches_[k]), plane.normal) >= kLeastFacing) {
        near.push_back(k);
      }
    });
    for (const uint32_t k : near) {
      double height = reach;
      for (const Point3 corner : PolygonOf(patches_[k])) {
        height = std::min(height, plane.Distance(corner));
      }
      const bool is_above = height > kCoincidentM ||
                            (height >= -kCoincidentM && rank_[k] > rank_[own]);
      if (is_above && Raise(k, pieces, std::max(height, 0.0), plane.normal)) {
        raised->insert(k);
      }
    }
  }

  // Puts the pieces of a patch that lies `height` before others before those of
  // them that were moved. False if all are.
  bool Raise(uint32_t i,
             const std::vector<Piece>& others,
             double height,
             Vec3 normal) {
    std::vector<Piece> pieces = PiecesOf(i);
    const uint8_t before = MostLayer(pieces);
    bool raised = false;
    for (Piece& piece : pieces) {
      for (const Piece& other : others) {
        const uint8_t layer = LayerAbove(other.layer, height);
        if (other.layer > 0 && layer > piece.layer &&
            OverlapArea(other.polygon, piece.polygon, normal) > 0) {
          piece.layer = layer;
          raised = true;
        }
      }
    }
    if (raised) {
      counts_.moved += before == 0 ? 1 : 0;
      pieces_[i] = std::move(pieces);
    }
    return raised;
  }

  void Replace() {
    // Its two sides are no longer in one place: each blocks rays for itself.
    std::unordered_set<uint32_t> touched_faces;
    for (const auto& [i, pieces] : pieces_) {
      touched_faces.insert(patches_[i].face.value);
    }
    std::vector<Patch> kept;
    for (uint32_t i = 0; i < patches_.size(); ++i) {
      Patch patch = patches_[i];
      patch.is_twin =
          patch.is_twin && !touched_faces.contains(patch.face.value);
      const auto it = pieces_.find(i);
      if (it == pieces_.end()) {
        kept.push_back(patch);
      } else {
        const Vec3 normal = PatchNormal(patch);
        for (const Piece& piece : it->second) {
          patch.layer = piece.layer;
          AppendAsPatches(
              patch, piece.polygon, normal * (piece.layer * kApartM), &kept);
        }
      }
    }
    patches_ = std::move(kept);
  }

  std::vector<Patch>& patches_;
  std::optional<BoxTree> tree_;
  std::vector<Pair> pairs_;
  std::vector<uint32_t> rank_;  // by patch, from back to front
  // Of the patches that were touched: what is left of them, and where.
  std::unordered_map<uint32_t, std::vector<Piece>> pieces_;
  OverlapCounts counts_;
};

}  // namespace

OverlapCounts SeparateOverlaps(std::vector<Patch>& patches) {
  return OverlapSeparator(patches).Run();
}

uint64_t SeparateOverlapsBytes(size_t patches) {
  return patches * kOverlapBytesPerPatch;
}

}  // namespace enfilade
