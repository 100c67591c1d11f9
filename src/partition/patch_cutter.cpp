#include "partition/patch_cutter.h"

#include "partition/patch_points.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace enfilade {
namespace {

// A quadrilateral is a parallelogram up to this share of its size.
constexpr double kParallelogramTolerance = 1e-6;
// One that becomes a parallelogram (kMostCornerMoveM) may be changed by at most
// this share of its shorter side.
constexpr double kMostMoveShare = 0.005;
// Larger polygons are cut without looking for parallelograms inside them.
constexpr size_t kMostVerticesForQuads = 20;

// Long pieces are cut into parts of at least this length.
constexpr double kShortestCutM = 1;

// By how much two opposite edges differ.
Vec3 GapOf(Point3 a, Point3 b, Point3 c, Point3 d) {
  return (b - a) - (c - d);
}

bool IsExact(Point3 a, Point3 b, Point3 c, Point3 d) {
  const double size = std::max(Length(c - a), Length(d - b));
  return Length(GapOf(a, b, c, d)) <= kParallelogramTolerance * size;
}

bool IsParallelogram(Point3 a, Point3 b, Point3 c, Point3 d) {
  const double move = Length(GapOf(a, b, c, d)) / 4;
  const double shorter = std::min(Length(b - a), Length(d - a));
  return move <= std::min(kMostCornerMoveM, kMostMoveShare * shorter) ||
         IsExact(a, b, c, d);
}

PatchPiece ParallelogramOf(Point3 a, Point3 b, Point3 c, Point3 d) {
  if (IsExact(a, b, c, d)) {
    return {a, b - a, d - a, PatchShape::kParallelogram};
  }
  const Vec3 quarter = GapOf(a, b, c, d) / 4;
  return {a + quarter,
          b - a - quarter * 2,
          d - a - quarter * 2,
          PatchShape::kParallelogram};
}

// The cost of a cut: the number of pieces first, then the sum of (longest
// edge)^2 / (2 area), with the area of a triangle of the piece.
struct Cost {
  uint32_t pieces = 0;
  double slimness = 0;

  friend Cost operator+(const Cost& a, const Cost& b) {
    return {a.pieces + b.pieces, a.slimness + b.slimness};
  }

  friend bool operator<(const Cost& a, const Cost& b) {
    return a.pieces != b.pieces ? a.pieces < b.pieces : a.slimness < b.slimness;
  }
};

double Slimness(Point3 a, Point3 b, Point3 c) {
  const double longest =
      std::max({Length(b - a), Length(c - b), Length(a - c)});
  const double area = Length(Cross(b - a, c - a));
  return area > 0 ? longest * longest / area
                  : std::numeric_limits<double>::infinity();
}

// Dynamic program over the chains of vertices i..j closed by the chord (i, j),
// as in Klincsek's minimum-weight triangulation (1980), with parallelograms as
// further pieces.
class Cutter {
 public:
  explicit Cutter(const Polygon& polygon)
      : p_(polygon), n_(polygon.size()), table_(n_ * n_) {}

  std::vector<PatchPiece> Cut() {
    for (size_t span = 2; span < n_; ++span) {
      for (size_t i = 0; i + span < n_; ++i) {
        SolveChain(i, i + span);
      }
    }
    Emit(0, n_ - 1);
    return std::move(pieces_);
  }

 private:
  // The piece at chord (i, j): a triangle (i, k, j) or, with l > k, a
  // parallelogram (i, k, l, j).
  struct Entry {
    Cost cost;
    size_t k = 0;
    size_t l = 0;
  };

  [[nodiscard]] Entry& At(size_t i, size_t j) { return table_[i * n_ + j]; }

  void SolveChain(size_t i, size_t j) {
    Entry best{{std::numeric_limits<uint32_t>::max(), 0}, i + 1, 0};
    for (size_t k = i + 1; k < j; ++k) {
      const Cost triangle{1, Slimness(p_[i], p_[k], p_[j])};
      const Cost cost = triangle + At(i, k).cost + At(k, j).cost;
      if (cost < best.cost) {
        best = {cost, k, 0};
      }
    }
    if (n_ <= kMostVerticesForQuads) {
      TryParallelograms(i, j, best);
    }
    At(i, j) = best;
  }

  void TryParallelograms(size_t i, size_t j, Entry& best) {
    for (size_t k = i + 1; k < j; ++k) {
      for (size_t l = k + 1; l < j; ++l) {
        if (!IsParallelogram(p_[i], p_[k], p_[l], p_[j])) {
          continue;
        }
        const Cost quad{1, Slimness(p_[i], p_[k], p_[l])};
        const Cost cost = quad + At(i, k).cost + At(k, l).cost + At(l, j).cost;
        if (cost < best.cost) {
          best = {cost, k, l};
        }
      }
    }
  }

  void Emit(size_t i, size_t j) {
    if (j - i < 2) {
      return;
    }
    const Entry entry = At(i, j);
    if (entry.l > 0) {
      pieces_.push_back(
          ParallelogramOf(p_[i], p_[entry.k], p_[entry.l], p_[j]));
      Emit(i, entry.k);
      Emit(entry.k, entry.l);
      Emit(entry.l, j);
    } else {
      pieces_.push_back(
          {p_[i], p_[entry.k] - p_[i], p_[j] - p_[i], PatchShape::kTriangle});
      Emit(i, entry.k);
      Emit(entry.k, j);
    }
  }

  const Polygon& p_;
  size_t n_;
  std::vector<Entry> table_;
  std::vector<PatchPiece> pieces_;
};

}  // namespace

std::vector<PatchPiece> CutIntoPatches(const Polygon& polygon) {
  const Polygon corners = WithoutStraightCorners(polygon);
  if (corners.size() < 3 || PolygonArea(corners) < kLeastAreaM2) {
    return {};
  }
  std::vector<PatchPiece> pieces = Cutter(corners).Cut();
  std::erase_if(pieces, [](const PatchPiece& piece) {
    return Length(Cross(piece.u, piece.v)) < kLeastAreaM2;
  });
  return pieces;
}

namespace {

// The number of parts that a piece is cut into because it is long.
size_t PartsOf(const PatchPiece& piece) {
  if (piece.shape == PatchShape::kTriangle) {
    return 1;
  }
  const double longer = std::max(Length(piece.u), Length(piece.v));
  const double shorter = std::min(Length(piece.u), Length(piece.v));
  return static_cast<size_t>(
      std::max(1.0, std::floor(longer / std::max(shorter, kShortestCutM))));
}

}  // namespace

std::vector<PatchPiece> CutLongOnes(const std::vector<PatchPiece>& pieces) {
  std::vector<PatchPiece> cut;
  cut.reserve(pieces.size());
  for (const PatchPiece& piece : pieces) {
    const size_t count = PartsOf(piece);
    PatchPiece part = piece;
    Vec3& along = Length(part.u) > Length(part.v) ? part.u : part.v;
    along = along / static_cast<double>(count);
    for (size_t i = 0; i < count; ++i) {
      part.origin = piece.origin + along * static_cast<double>(i);
      cut.push_back(part);
    }
  }
  return cut;
}

size_t CountPatches(const Polygon& polygon) {
  const size_t corners = WithoutStraightCorners(polygon).size();
  if (corners > kMostVerticesForQuads) {
    return corners - 2;
  }
  size_t count = 0;
  for (const PatchPiece& piece : CutIntoPatches(polygon)) {
    count += PartsOf(piece);
  }
  return count;
}

Polygon PolygonOf(const Patch& p) {
  const CornerList<Point3> corners = CornersOf(p);
  const std::span<const Point3> view = corners.View();
  return {view.begin(), view.end()};
}

void AppendAsPatches(Patch patch,
                     const Polygon& part,
                     Vec3 offset,
                     std::vector<Patch>* patches) {
  for (const PatchPiece& cut : CutIntoPatches(part)) {
    patch.origin = cut.origin + offset;
    patch.u = cut.u;
    patch.v = cut.v;
    patch.shape = cut.shape;
    patches->push_back(patch);
  }
}

}  // namespace enfilade
