#include "solver/cover.h"

#include "base/parallel.h"
#include "base/random.h"
#include "solver/cosine_directions.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

// A point is covered if this many random directions, cosine-weighted, are all
// blocked within the reach, and so are as many others, and these again. In a
// corner between two walls half of them are, below a cover all.
constexpr int kDirectionsPerTest = 8;
// Points that a narrow view is left to, as in a bowl, pass a test now and then
// and fail the next. There is no edge to be found where not this share of those
// that pass two tests pass the third; fewer failures than these are chance.
constexpr float kSharpShare = 0.7F;
constexpr size_t kLeastFailures = 4;
constexpr float kReach = 0.35F;  // m
// Sample points of each projection that may cover: one for this area. Of the
// sides of a chair's leg, their margins included, its foot is about a tenth.
constexpr float kAreaPerPoint = 8e-4F;  // m2
constexpr float kPoints = 32;           // at least, but where they overlap
constexpr size_t kLeastPoints = 2;
constexpr size_t kMostPoints = 256;
// Where more may cover, the parts of a surface are looked at instead of all.
constexpr size_t kMostCandidates = 64;
// A surface can only be covered below what stands on it or hangs before it, or
// inside of it: within this distance of what is projected onto it.
constexpr float kCoverMargin = 0.05F;  // m
// Receivers of a cell: as many, and so many for each of its patches.
constexpr size_t kMostReceivers = 16384;
constexpr size_t kMostReceiversPerPatch = 4;
// Where there would be more, larger edges are left.
constexpr double kCoarser = 4;
// What is nearer to its plane than this does not stand before a surface.
constexpr float kInPlane = 1e-4F;  // m

// A part of a patch, in its coordinates.
struct Rect {
  float low_a, high_a, low_b, high_b;

  [[nodiscard]] bool Has(float a, float b) const {
    return a >= low_a && a <= high_a && b >= low_b && b <= high_b;
  }

  // Requires an overlap.
  [[nodiscard]] Rect ClippedTo(const Rect& other) const {
    return {std::max(low_a, other.low_a),
            std::min(high_a, other.high_a),
            std::max(low_b, other.low_b),
            std::min(high_b, other.high_b)};
  }

  [[nodiscard]] float Area() const {
    return (high_a - low_a) * (high_b - low_b);
  }
};

struct Range {
  float low = 1e30F;
  float high = -1e30F;

  void Add(float v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
};

// Where on a patch others can cover it: their projections, widened.
class Candidates {
 public:
  Candidates(const CoverSide& cell, size_t patch)
      : cell_(&cell), self_(patch), patch_(&cell.patches[patch]) {
    const Corners corners = CornersOf(*patch_, {});
    for (const Vec3f p : corners.View()) {
      reach_.Add(p + Vec3f{kReach, kReach, kReach});
      reach_.Add(p - Vec3f{kReach, kReach, kReach});
    }
    if (!cell.clusters->Items().empty()) {
      Visit(0);
    }
  }

  [[nodiscard]] std::vector<Rect> Take() { return std::move(rects_); }

 private:
  void Visit(uint32_t node) {
    const Cluster& cluster = cell_->clusters->Clusters()[node];
    if (!cluster.box.Overlaps(reach_) || IsClear(HeightsOf(cluster.box))) {
      return;
    }
    if (cluster.child != 0) {
      Visit(cluster.child);
      Visit(cluster.child + 1);
      return;
    }
    for (uint32_t i = cluster.first; i < cluster.first + cluster.count; ++i) {
      const uint32_t other = cell_->clusters->Items()[i].patch;
      if (other != self_) {
        Project(cell_->patches[other]);
      }
    }
  }

  void Project(const PatchGeometry& other) {
    const Corners corners = CornersOf(other, {});
    const Vec3f cross = Cross(patch_->u, patch_->v);
    const float square = Dot(cross, cross);
    const float area = std::sqrt(square);
    Range height;
    Range a;
    Range b;
    for (const Vec3f p : corners.View()) {
      const Vec3f d = p - patch_->origin;
      height.Add(Dot(d, patch_->normal));
      a.Add(Dot(Cross(d, patch_->v), cross) / square);
      b.Add(Dot(Cross(patch_->u, d), cross) / square);
    }
    const float wide_a = kCoverMargin * Length(patch_->v) / area;
    const float wide_b = kCoverMargin * Length(patch_->u) / area;
    const Rect rect = {
        a.low - wide_a, a.high + wide_a, b.low - wide_b, b.high + wide_b};
    if (!IsClear(height) && rect.low_a < 1 && rect.high_a > 0 &&
        rect.low_b < 1 && rect.high_b > 0) {
      rects_.push_back(rect);
    }
  }

  [[nodiscard]] Range HeightsOf(const Box& box) const {
    const Vec3f n = patch_->normal;
    const Vec3f middle = (box.low + box.high) * 0.5F - patch_->origin;
    const Vec3f half = (box.high - box.low) * 0.5F;
    const float spread = half.x * std::abs(n.x) + half.y * std::abs(n.y) +
                         half.z * std::abs(n.z);
    return {Dot(middle, n) - spread, Dot(middle, n) + spread};
  }

  static bool IsClear(Range height) {
    return height.high <= kInPlane || height.low >= kReach;
  }

  const CoverSide* cell_;
  size_t self_;
  const PatchGeometry* patch_;
  Box reach_;
  std::vector<Rect> rects_;
};

// The element's, or of a triangle that of the parallelogram around it.
Rect RectOf(ElementFrame frame) {
  const float end_a = frame.a + frame.scale;
  const float end_b = frame.b + frame.scale;
  return {std::min(frame.a, end_a),
          std::max(frame.a, end_a),
          std::min(frame.b, end_b),
          std::max(frame.b, end_b)};
}

// The receivers of all patches of a cell so far. When there are too many all
// searches end: what they found is of no use.
struct Found {
  std::atomic<size_t> receivers = 0;
  size_t most = 0;

  [[nodiscard]] bool TooMany() const { return receivers > most; }
};

// Where the receivers of one patch go.
struct Sink {
  Found* all = nullptr;
  std::vector<ElementPath>* paths = nullptr;

  void Add(ElementPath path) const {
    paths->push_back(path);
    ++all->receivers;
  }

  // Puts one in the place of the last ones.
  void Replace(size_t count, ElementPath path) const {
    paths->resize(paths->size() - count);
    all->receivers -= count;
    Add(path);
  }
};

// Looks for covers on one patch.
class Search {
 public:
  Search(const CoverOptions& options,
         const PatchGeometry& patch,
         float reflected,
         uint64_t key,
         std::span<const CellBlockers* const> occluders,
         const Sink& sink)
      : options_(&options),
        patch_(&patch),
        directions_(patch),
        reflected_(reflected),
        key_(key),
        occluders_(occluders),
        sink_(sink) {}

  // Adds the receivers of an element; false if nothing covers any of it, and
  // it is one receiver.
  bool Visit(ElementPath path,
             ElementFrame frame,
             const std::vector<Rect>& candidates) {
    if (sink_.all->TooMany()) {
      return true;
    }
    const std::vector<Rect> here = Within(RectOf(frame), candidates);
    const float diameter = DiameterOf(*patch_, frame);
    const float area = AreaOf(*patch_, frame);
    // No cover at all can hide more than this.
    const float most = 0.5F * reflected_ * std::sqrt(area);
    if (here.empty() || most <= static_cast<float>(options_->tau) ||
        diameter <= options_->least_diameter || IsDeepest(path)) {
      sink_.Add(path);
      return false;
    }
    if (here.size() > kMostCandidates) {
      if (VisitChildren(path, frame, here)) {
        return true;
      }
      sink_.Replace(kChildren, path);
      return false;
    }
    const float share = CoveredShare(path, frame, here);
    const float error = reflected_ * std::sqrt(share * (1 - share) * area);
    if (error <= static_cast<float>(options_->tau)) {
      sink_.Add(path);
      return share > 0;
    }
    VisitChildren(path, frame, here);
    return true;
  }

  [[nodiscard]] uint64_t Rays() const { return rays_; }

 private:
  bool VisitChildren(ElementPath path,
                     ElementFrame frame,
                     const std::vector<Rect>& candidates) {
    bool is_covered = false;
    for (size_t c = 0; c < kChildren; ++c) {
      is_covered |= Visit(
          ChildPath(path, c), ChildOf(frame, patch_->shape, c), candidates);
    }
    return is_covered;
  }

  static std::vector<Rect> Within(const Rect& element,
                                  const std::vector<Rect>& rects) {
    std::vector<Rect> within;
    for (const Rect& r : rects) {
      const Rect part = r.ClippedTo(element);
      if (part.low_a < part.high_a && part.low_b < part.high_b) {
        within.push_back(part);
      }
    }
    return within;
  }

  // Points of a packet that may be covered, and for how much each counts.
  struct Suspects {
    std::array<Vec3f, 16> points{};
    std::array<float, 16> shares{};
    size_t count = 0;

    [[nodiscard]] float Share() const {
      float sum = 0;
      for (size_t i = 0; i < count; ++i) {
        sum += shares[i];
      }
      return sum;
    }
  };

  // Points are drawn on each of the candidates, which may overlap: one that
  // lies on several could have come from any of them.
  [[nodiscard]] float CoveredShare(ElementPath path,
                                   ElementFrame frame,
                                   const std::vector<Rect>& candidates) {
    // Of the parallelogram around the element.
    const float fill = patch_->shape == PatchShape::kTriangle ? 0.5F : 1.0F;
    const float area = AreaOf(*patch_, frame) / fill;
    const float rect_area = RectOf(frame).Area();
    float layers = 0;  // of candidates, mean over the element
    for (const Rect& rect : candidates) {
      layers += rect.Area() / rect_area;
    }
    Random random(MixKey(key_, path));
    float twice = 0;
    float thrice = 0;
    size_t failures = 0;
    for (const Rect& rect : candidates) {
      const float share = rect.Area() / rect_area;
      const float wanted = std::max(kPoints, share * area / kAreaPerPoint) /
                           std::max(layers, 1.0F);
      const size_t points =
          std::clamp(static_cast<size_t>(wanted), kLeastPoints, kMostPoints);
      const float scale = share / (fill * static_cast<float>(points));
      for (size_t first = 0; first < points; first += 16) {
        const size_t drawn = std::min<size_t>(16, points - first);
        Suspects suspects =
            DrawSuspects(frame, rect, drawn, candidates, &random);
        KeepCovered(&suspects, &random);
        KeepCovered(&suspects, &random);
        twice += scale * suspects.Share();
        failures += suspects.count;
        KeepCovered(&suspects, &random);
        thrice += scale * suspects.Share();
        failures -= suspects.count;
      }
    }
    return failures >= kLeastFailures && thrice < kSharpShare * twice
               ? 0
               : std::min(thrice, 1.0F);
  }

  // The points of the element among `drawn` <= 16 random ones of a candidate.
  Suspects DrawSuspects(ElementFrame frame,
                        const Rect& rect,
                        size_t drawn,
                        const std::vector<Rect>& candidates,
                        Random* random) const {
    Suspects suspects;
    for (size_t i = 0; i < drawn; ++i) {
      const auto s = static_cast<float>(random->Next());
      const auto t = static_cast<float>(random->Next());
      const float a = rect.low_a + s * (rect.high_a - rect.low_a);
      const float b = rect.low_b + t * (rect.high_b - rect.low_b);
      if (patch_->shape == PatchShape::kTriangle &&
          (a - frame.a + b - frame.b) / frame.scale > 1) {
        continue;
      }
      const auto over = std::count_if(
          candidates.begin(), candidates.end(), [&](const Rect& r) {
            return r.Has(a, b);
          });
      suspects.shares[suspects.count] =
          1 / static_cast<float>(std::max<std::ptrdiff_t>(over, 1));
      suspects.points[suspects.count++] = PointOn(*patch_, {}, a, b);
    }
    return suspects;
  }

  // Drops the points from which one of the directions is free.
  void KeepCovered(Suspects* suspects, Random* random) {
    for (int k = 0; k < kDirectionsPerTest && suspects->count > 0; ++k) {
      SegmentPacket packet;
      for (size_t i = 0; i < suspects->count; ++i) {
        const Vec3f from = suspects->points[i];
        const Vec3f to = from + directions_.Draw(random) * kReach;
        packet.from_x[i] = from.x;
        packet.from_y[i] = from.y;
        packet.from_z[i] = from.z;
        packet.to_x[i] = to.x;
        packet.to_y[i] = to.y;
        packet.to_z[i] = to.z;
      }
      packet.count = static_cast<uint32_t>(suspects->count);
      rays_ += packet.count;
      const uint32_t blocked = Occluded(occluders_, packet);
      size_t left = 0;
      for (size_t i = 0; i < packet.count; ++i) {
        if ((blocked >> i & 1) != 0) {
          suspects->shares[left] = suspects->shares[i];
          suspects->points[left++] = suspects->points[i];
        }
      }
      suspects->count = left;
    }
  }

  const CoverOptions* options_;
  const PatchGeometry* patch_;
  CosineDirections directions_;
  float reflected_;
  uint64_t key_;
  std::span<const CellBlockers* const> occluders_;
  Sink sink_;
  uint64_t rays_ = 0;
};

// False, and nothing found, if there are too many receivers.
bool FindWith(const CoverOptions& options,
              const CoverSide& cell,
              std::span<const float> reflected,
              Covers* covers) {
  const auto& patches = cell.patches;
  const CellBlockers* const occluders[] = {cell.occluders};
  Found found;
  found.most = options.most_receivers;
  std::vector<uint64_t> rays(patches.size());
  std::vector<std::vector<ElementPath>> leaves(patches.size());
  ParallelFor(patches.size(), [&](size_t i) {
    if (patches[i].reflects && !found.TooMany()) {
      Search search(options,
                    patches[i],
                    reflected[i],
                    MixKey(MixKey(options.seed, cell.id.value), i),
                    occluders,
                    {&found, &leaves[i]});
      search.Visit(kRootPath, {}, Candidates(cell, i).Take());
      rays[i] = search.Rays();
    }
  });
  if (found.TooMany()) {
    return false;
  }
  for (size_t i = 0; i < patches.size(); ++i) {
    covers->rays += rays[i];
    for (const ElementPath path : leaves[i]) {
      covers->receivers.push_back({static_cast<uint32_t>(i), path});
    }
  }
  return true;
}

}  // namespace

Covers FindCovers(const CoverOptions& options,
                  const CoverSide& cell,
                  std::span<const float> reflected) {
  CoverOptions now = options;
  now.most_receivers =
      std::min(options.most_receivers,
               kMostReceivers + kMostReceiversPerPatch * cell.patches.size());
  Covers covers;
  while (!FindWith(now, cell, reflected, &covers)) {
    now.tau *= kCoarser;
  }
  return covers;
}

}  // namespace enfilade
