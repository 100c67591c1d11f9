#include "solver/cover.h"

#include "base/parallel.h"
#include "base/random.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace enfilade {
namespace {

// A point is covered if this many random directions, cosine-weighted, are all
// blocked within the reach. In a corner between two walls half of them are, so
// one point in 256 is taken for covered; below a cover all are.
constexpr int kDirections = 8;
constexpr float kReach = 0.35F;  // m
// One sample point for this area, so that a chair leg's foot is not missed.
constexpr float kAreaPerPoint = 8e-4F;  // m2
constexpr size_t kLeastPoints = 16;
constexpr size_t kMostPoints = 2048;

struct Frame {
  Vec3f u, v, n;
};

Frame FrameOf(const PatchGeometry& patch) {
  const Vec3f u = patch.u * (1 / Length(patch.u));
  return {u, Cross(patch.normal, u), patch.normal};
}

Vec3f CosineDirection(const Frame& frame, Random* random) {
  const auto r2 = static_cast<float>(random->Next());
  const float phi = static_cast<float>(2 * kPi * random->Next());
  const float r = std::sqrt(r2);
  return frame.u * (r * std::cos(phi)) + frame.v * (r * std::sin(phi)) +
         frame.n * std::sqrt(1 - r2);
}

// Looks for covers on one patch.
class Search {
 public:
  Search(const CoverOptions& options,
         const PatchGeometry& patch,
         float reflected,
         uint64_t key,
         std::span<const CellBlockers* const> occluders,
         std::vector<ElementPath>* split)
      : options_(&options),
        patch_(&patch),
        frame_(FrameOf(patch)),
        reflected_(reflected),
        key_(key),
        occluders_(occluders),
        split_(split) {}

  void Visit(ElementPath path, ElementFrame frame) {
    const float diameter = DiameterOf(*patch_, frame);
    const float area = AreaOf(*patch_, frame);
    // No cover at all can hide more than this.
    const float most = 0.5F * reflected_ * std::sqrt(area);
    if (most <= static_cast<float>(options_->tau) ||
        diameter <= options_->least_diameter ||
        path >= (1U << (2 * kMaxLevel))) {
      return;
    }
    const float share = CoveredShare(path, frame);
    const float error = reflected_ * std::sqrt(share * (1 - share) * area);
    if (error <= static_cast<float>(options_->tau)) {
      return;
    }
    split_->push_back(path);
    for (size_t c = 0; c < kChildren; ++c) {
      Visit(ChildPath(path, c), ChildOf(frame, patch_->shape, c));
    }
  }

  [[nodiscard]] uint64_t Rays() const { return rays_; }

 private:
  [[nodiscard]] float CoveredShare(ElementPath path, ElementFrame frame) {
    const float wanted = AreaOf(*patch_, frame) / kAreaPerPoint;
    const size_t points =
        std::clamp(static_cast<size_t>(wanted), kLeastPoints, kMostPoints);
    Random random(MixKey(key_, path));
    size_t covered = 0;
    for (size_t first = 0; first < points; first += 16) {
      covered +=
          CoveredOf(frame, std::min<size_t>(16, points - first), &random);
    }
    return static_cast<float>(covered) / static_cast<float>(points);
  }

  // How many of `count` <= 16 random points are covered.
  size_t CoveredOf(ElementFrame frame, size_t count, Random* random) {
    std::array<Vec3f, 16> points;
    for (size_t i = 0; i < count; ++i) {
      auto s = static_cast<float>(random->Next());
      auto t = static_cast<float>(random->Next());
      if (patch_->shape == PatchShape::kTriangle && s + t > 1) {
        s = 1 - s;
        t = 1 - t;
      }
      points[i] = PointOn(*patch_, frame, s, t);
    }
    for (int k = 0; k < kDirections && count > 0; ++k) {
      SegmentPacket packet{};
      for (size_t i = 0; i < count; ++i) {
        const Vec3f to = points[i] + CosineDirection(frame_, random) * kReach;
        packet.from_x[i] = points[i].x;
        packet.from_y[i] = points[i].y;
        packet.from_z[i] = points[i].z;
        packet.to_x[i] = to.x;
        packet.to_y[i] = to.y;
        packet.to_z[i] = to.z;
      }
      packet.count = static_cast<uint32_t>(count);
      rays_ += count;
      const uint32_t blocked = Occluded(occluders_, packet);
      size_t left = 0;
      for (size_t i = 0; i < count; ++i) {
        if ((blocked >> i & 1) != 0) {
          points[left++] = points[i];
        }
      }
      count = left;
    }
    return count;
  }

  const CoverOptions* options_;
  const PatchGeometry* patch_;
  Frame frame_;
  float reflected_;
  uint64_t key_;
  std::span<const CellBlockers* const> occluders_;
  std::vector<ElementPath>* split_;
  uint64_t rays_ = 0;
};

}  // namespace

CoverMap::CoverMap(const CoverOptions& options,
                   CellId cell,
                   std::span<const PatchGeometry> patches,
                   std::span<const float> reflected,
                   std::span<const CellBlockers* const> occluders)
    : split_(patches.size()) {
  std::vector<uint64_t> rays(patches.size());
  ParallelFor(patches.size(), [&](size_t i) {
    if (patches[i].reflects) {
      Search search(options,
                    patches[i],
                    reflected[i],
                    MixKey(MixKey(options.seed, cell.value), i),
                    occluders,
                    &split_[i]);
      search.Visit(kRootPath, {});
      rays[i] = search.Rays();
      std::sort(split_[i].begin(), split_[i].end());
    }
  });
  for (const uint64_t r : rays) {
    rays_ += r;
  }
}

uint64_t CoverMap::SizeBytes() const {
  uint64_t bytes = split_.size() * sizeof(std::vector<ElementPath>);
  for (const auto& paths : split_) {
    bytes += paths.capacity() * sizeof(ElementPath);
  }
  return bytes;
}

}  // namespace enfilade
