#include "solver/reference/panel_rays.h"

#include "solver/transfer/cosine_directions.h"
#include "solver/transfer/transfer_sample.h"

namespace enfilade {
namespace {

// The middle of pixel k, in [-1, 1].
float PixelCenter(size_t k) {
  return (2 * static_cast<float>(k) + 1) / static_cast<float>(kHemicubePixels) -
         1;
}

// cos cos' dA / (pi r^2) of the pixel at (a, b) on a face at distance 1 from
// the center, where cos' = 1 / r and cos = height / r.
float DeltaFormFactor(float a, float b, float height) {
  constexpr float kEdge = 2 / static_cast<float>(kHemicubePixels);
  const float r2 = a * a + b * b + 1;
  return height * kEdge * kEdge * kInversePi / (r2 * r2);
}

}  // namespace

std::vector<PanelRay> HemicubeRays(const TransferEnd& end) {
  const PatchAxes axes = AxesOf(*end.patch);
  std::vector<PanelRay> rays;
  rays.reserve(3 * kHemicubePixels * kHemicubePixels);
  for (size_t row = 0; row < kHemicubePixels; ++row) {
    const float b = PixelCenter(row);
    for (size_t column = 0; column < kHemicubePixels; ++column) {
      const float a = PixelCenter(column);
      rays.push_back({end.center,
                      axes.x * a + axes.y * b + axes.z,
                      DeltaFormFactor(a, b, 1)});
      if (b < 0) {
        continue;  // this half of the sides is below the horizon
      }
      const float share = DeltaFormFactor(a, b, b);
      const Vec3f up = axes.z * b;
      rays.push_back({end.center, axes.x + axes.y * a + up, share});
      rays.push_back({end.center, axes.x * -1 + axes.y * a + up, share});
      rays.push_back({end.center, axes.y + axes.x * a + up, share});
      rays.push_back({end.center, axes.y * -1 + axes.x * a + up, share});
    }
  }
  return rays;
}

std::vector<PanelRay> CosineRays(const TransferEnd& end, uint64_t key) {
  Random random(key);
  const CosineDirections directions(*end.patch);
  std::vector<PanelRay> rays(kCosineRays);
  for (PanelRay& ray : rays) {
    ray.from = RandomPoint(end, &random);
    ray.direction = directions.Draw(&random);
    ray.share = 1 / static_cast<float>(kCosineRays);
  }
  return rays;
}

std::vector<PanelRay> CosineRaysFromCenter(const TransferEnd& end,
                                           uint64_t key) {
  std::vector<PanelRay> rays = CosineRays(end, key);
  for (PanelRay& ray : rays) {
    ray.from = end.center;
  }
  return rays;
}

}  // namespace enfilade
