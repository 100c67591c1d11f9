#include "solver/reference/corner_deviations.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

namespace enfilade {
namespace {

// A point of a patch: patch, and its coordinates in units of 2^-kMaxLevel.
using CornerKey = std::tuple<uint32_t, uint32_t, uint32_t>;

struct CornerMean {
  Rgb sum{};
  double count = 0;
};

size_t CornerCount(const Panel& panel) {
  return panel.end.node_count;
}

std::array<CornerKey, 4> CornersOfPanel(const ReferenceScene& scene,
                                        const Panel& panel) {
  const auto key = [&](float a, float b) {
    const auto grid = [](float x) {
      return static_cast<uint32_t>(std::lround(x * (1U << kMaxLevel)));
    };
    return CornerKey{panel.patch, grid(a), grid(b)};
  };
  if (panel.end.patch->shape == PatchShape::kTriangle) {
    const ElementFrame& f = panel.end.frame;
    return {
        key(f.a, f.b), key(f.a + f.scale, f.b), key(f.a, f.b + f.scale), {}};
  }
  const PanelRect r = scene.RectOf(panel);
  return {key(r.a_low, r.b_low),
          key(r.a_high, r.b_low),
          key(r.a_low, r.b_high),
          key(r.a_high, r.b_high)};
}

}  // namespace

std::vector<double> CornerDeviations(const ReferenceScene& scene,
                                     std::span<const Panel* const> panels,
                                     std::span<const Rgb> radiosities) {
  std::map<CornerKey, CornerMean> corners;
  for (size_t i = 0; i < panels.size(); ++i) {
    const auto keys = CornersOfPanel(scene, *panels[i]);
    for (size_t k = 0; k < CornerCount(*panels[i]); ++k) {
      CornerMean& corner = corners[keys[k]];
      for (size_t c = 0; c < kRgbChannels; ++c) {
        corner.sum[c] += radiosities[i][c];
      }
      ++corner.count;
    }
  }
  std::vector<double> deviations;
  deviations.reserve(panels.size());
  for (const Panel* panel : panels) {
    const auto keys = CornersOfPanel(scene, *panel);
    const auto n = static_cast<double>(CornerCount(*panel));
    Rgb sum{};
    Rgb square{};
    for (size_t k = 0; k < CornerCount(*panel); ++k) {
      const CornerMean& corner = corners.at(keys[k]);
      for (size_t c = 0; c < sum.size(); ++c) {
        const double value = corner.sum[c] / corner.count;
        sum[c] += value / n;
        square[c] += value * value / n;
      }
    }
    Rgb variance{};
    for (size_t c = 0; c < sum.size(); ++c) {
      variance[c] = std::max(0.0, square[c] - sum[c] * sum[c]);
    }
    deviations.push_back(std::sqrt(MeanChannel(variance)));
  }
  return deviations;
}

}  // namespace enfilade
