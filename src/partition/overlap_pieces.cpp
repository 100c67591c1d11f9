#include "partition/overlap_pieces.h"

#include "base/stop.h"
#include "partition/patch_cutter.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace enfilade {
namespace {

// A surface that lies farther than this in front of another hides it from rays,
// m.
constexpr double kHiddenM = 1e-4;
// Parts smaller than this share of a patch are ignored.
constexpr double kSmallShare = 0.02;

// The layer that puts a surface that lies `height` in front of a plane at least
// half a layer in front of a surface that is `layer` layers in front of that
// plane.
uint8_t LayerAbove(uint8_t layer, double height) {
  const double steps = std::ceil(layer + 0.5 - height / kApartM);
  return static_cast<uint8_t>(std::clamp(steps, 0.0, double{kMostLayers}));
}

uint8_t LayerBefore(uint8_t layer) {
  return layer < kMostLayers ? static_cast<uint8_t>(layer + 1) : kMostLayers;
}

uint64_t PieceBytes(const Polygon& polygon) {
  return sizeof(OverlapPiece) + kAllocationHeaderBytes +
         polygon.capacity() * sizeof(Point3);
}

uint64_t BytesOf(const std::vector<OverlapPiece>& pieces) {
  return std::accumulate(pieces.begin(),
                         pieces.end(),
                         uint64_t{0},
                         [](uint64_t sum, const OverlapPiece& piece) {
                           return sum + PieceBytes(piece.polygon);
                         });
}

uint8_t MostLayer(const std::vector<OverlapPiece>& pieces) {
  uint8_t most = 0;
  for (const OverlapPiece& piece : pieces) {
    most = std::max(most, piece.layer);
  }
  return most;
}

double AreaOf(const std::vector<OverlapPiece>& pieces) {
  return std::accumulate(
      pieces.begin(), pieces.end(), 0.0, [](double sum, const OverlapPiece& p) {
        return sum + PolygonArea(p.polygon);
      });
}

std::vector<Polygon> PolygonsOf(const std::vector<OverlapPiece>& pieces) {
  std::vector<Polygon> polygons;
  polygons.reserve(pieces.size());
  for (const OverlapPiece& piece : pieces) {
    polygons.push_back(piece.polygon);
  }
  return polygons;
}

std::vector<Polygon> WithoutThose(const std::vector<Polygon>& polygons,
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

// The layer that puts a polygon in front of all those others that it overlaps.
uint8_t LayerOver(const Polygon& polygon,
                  const std::vector<OverlapPiece>& others,
                  Vec3 normal) {
  uint8_t layer = 0;
  for (const OverlapPiece& other : others) {
    const uint8_t before = LayerBefore(other.layer);
    if (before > layer && OverlapArea(polygon, other.polygon, normal) > 0) {
      layer = before;
    }
  }
  return layer;
}

// Puts the part of the polygon that lies in others in front of them. The part
// that sticks out stays in place, if it is large enough for a piece of its own.
void AppendPieces(Polygon polygon,
                  const std::vector<OverlapPiece>& others,
                  Vec3 normal,
                  std::vector<OverlapPiece>* pieces) {
  const uint8_t layer = LayerOver(polygon, others, normal);
  const std::vector<Polygon> out =
      WithoutThose({polygon}, PolygonsOf(others), normal);
  if (TotalArea(out) <= kSmallShare * PolygonArea(polygon)) {
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

}  // namespace

bool OverlapPieces::IsSame(const OverlapPair& pair) const {
  const Patch& front = patches_[pair.front];
  const Patch& behind = patches_[pair.behind];
  if (front.emits != behind.emits || front.is_enclosed != behind.is_enclosed ||
      pair.most_rise > kHiddenM) {
    return false;
  }
  if (front.material == behind.material && front.is_back == behind.is_back) {
    return true;
  }
  const bool have_one_outline =
      surfaces_[pair.front].here == surfaces_[pair.behind].here &&
      pair.area_m2 >= (1 - kSmallShare) * PatchArea(behind);
  if (!have_one_outline) {
    return false;
  }
  if (front.reflects != behind.reflects) {
    return behind.reflects;
  }
  if (front.is_back != behind.is_back) {
    return front.is_back || front.material == behind.material;
  }
  // Of the finish of a room's floor and a slab that goes on below other rooms
  // the finish is seen.
  return surfaces_[pair.front].anywhere == surfaces_[pair.behind].anywhere;
}

// The two sides of a closed board face the same way where one is its inside and
// the other its outside; only in a board thinner than kCoincidentM are they in
// one plane.
bool OverlapPieces::IsInSheet(const OverlapPair& pair) const {
  const Patch& front = patches_[pair.front];
  const Patch& behind = patches_[pair.behind];
  const uint32_t solid = faces_[front.face.Index()].solid;
  return front.is_enclosed && !behind.is_enclosed && solid != 0 &&
         solid == faces_[behind.face.Index()].solid;
}

// Charges copies of all pieces behind, the same pieces as polygons, and about
// as many pieces of the remainder while they are cut.
void OverlapPieces::ChargeSettling(std::span<const OverlapPair> pairs) {
  constexpr uint64_t kCopies = 4;
  constexpr uint64_t kUntouchedBytes =
      sizeof(OverlapPiece) + kAllocationHeaderBytes + 4 * sizeof(Point3);
  uint64_t behind = 0;
  for (const OverlapPair& pair : pairs) {
    const std::vector<OverlapPiece>* pieces = Find(pair.behind);
    behind += pieces != nullptr ? BytesOf(*pieces) : kUntouchedBytes;
  }
  charge_.GrowTo(piece_bytes_ + kCopies * behind);
}

void OverlapPieces::Keep(uint32_t patch, std::vector<OverlapPiece> pieces) {
  constexpr uint64_t kBytesPerPatch = 96;  // entry of the map
  const auto [kept, is_new] = pieces_.try_emplace(patch);
  piece_bytes_ += is_new ? kBytesPerPatch : 0;
  piece_bytes_ -= BytesOf(kept->second);
  kept->second = std::move(pieces);
  piece_bytes_ += BytesOf(kept->second);
  charge_.GrowTo(piece_bytes_);
}

uint64_t OverlapPieces::MostPatches() const {
  uint64_t most = 0;
  for (const auto& [patch, pieces] : pieces_) {
    for (const OverlapPiece& piece : pieces) {
      most += piece.polygon.size();
    }
  }
  return most;
}

// Where many patches lie in one place, few of them have anything left. Skips
// the others before they are compared, so that time does not grow with the
// square of the number of patches.
std::vector<OverlapPair> OverlapPieces::PairsOfFront(uint32_t front) const {
  std::vector<OverlapPair> pairs;
  const Box3 box = Grown(BoundsOf(PolygonOf(patches_[front])), kCoincidentM);
  tree_->ForOverlaps(box, [&](uint32_t k) {
    if (ranks_[k] >= ranks_[front]) {
      return;
    }
    const std::vector<OverlapPiece>* left = Find(k);
    if (left != nullptr && left->empty()) {
      return;
    }
    if (const auto pair = PairOf(front, k, patches_)) {
      pairs.push_back(*pair);
    }
  });
  std::sort(pairs.begin(),
            pairs.end(),
            [&](const OverlapPair& a, const OverlapPair& b) {
              return ranks_[a.behind] < ranks_[b.behind];
            });
  return pairs;
}

void OverlapPieces::Settle(uint32_t front) {
  const std::vector<OverlapPair> pairs = PairsOfFront(front);
  if (!pairs.empty()) {
    SettleBy(pairs);
  }
}

void OverlapPieces::SettleBy(std::span<const OverlapPair> pairs) {
  ChargeSettling(pairs);
  const uint32_t own = pairs.front().front;
  const Vec3 normal = PatchNormal(patches_[own]);
  std::vector<Polygon> same;
  std::vector<OverlapPiece> others;
  for (const OverlapPair& pair : pairs) {
    for (const OverlapPiece& piece : PiecesOf(pair.behind)) {
      if (IsSame(pair) || IsInSheet(pair)) {
        same.push_back(piece.polygon);
      } else {
        others.push_back(piece);
      }
    }
  }
  const std::vector<Polygon> before{PolygonOf(patches_[own])};
  std::vector<OverlapPiece> after;
  for (Polygon& left : WithoutThose(before, same, normal)) {
    if (patches_[own].is_enclosed) {
      const uint8_t layer = LayerOver(left, others, normal);
      after.push_back({std::move(left), layer});  // dark in any layer
    } else {
      AppendPieces(std::move(left), others, normal, &after);
    }
  }
  const double gone = TotalArea(before) - AreaOf(after);
  if (gone > kSmallM2) {
    ++counts_.dropped;
    counts_.area_m2 += gone;
  }
  const bool moved = MostLayer(after) > 0;
  counts_.moved += moved ? 1 : 0;
  if (moved || gone > kSmallM2) {
    Keep(own, std::move(after));
  }
}

void OverlapPieces::RaiseAll() {
  std::set<uint32_t> open;
  for (const auto& [i, pieces] : pieces_) {
    if (MostLayer(pieces) > 0) {
      open.insert(i);
    }
  }
  while (!open.empty()) {
    ThrowIfStopRequested();
    const uint32_t i = *open.begin();
    open.erase(open.begin());
    RaiseAbove(i, &open);
  }
}

void OverlapPieces::RaiseAbove(uint32_t own, std::set<uint32_t>* raised) {
  const std::vector<OverlapPiece> pieces = PiecesOf(own);
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
                          (height >= -kCoincidentM && ranks_[k] > ranks_[own]);
    if (is_above && Raise(k, pieces, std::max(height, 0.0), plane.normal)) {
      raised->insert(k);
    }
  }
}

bool OverlapPieces::Raise(uint32_t patch,
                          const std::vector<OverlapPiece>& others,
                          double height,
                          Vec3 normal) {
  std::vector<OverlapPiece> pieces = PiecesOf(patch);
  const uint8_t before = MostLayer(pieces);
  bool raised = false;
  for (OverlapPiece& piece : pieces) {
    for (const OverlapPiece& other : others) {
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
    Keep(patch, std::move(pieces));
  }
  return raised;
}

const std::vector<OverlapPiece>* OverlapPieces::Find(uint32_t patch) const {
  const auto it = pieces_.find(patch);
  return it != pieces_.end() ? &it->second : nullptr;
}

std::vector<OverlapPiece> OverlapPieces::PiecesOf(uint32_t patch) const {
  const std::vector<OverlapPiece>* pieces = Find(patch);
  return pieces != nullptr
             ? *pieces
             : std::vector<OverlapPiece>{{PolygonOf(patches_[patch])}};
}

}  // namespace enfilade
