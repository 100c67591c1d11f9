#include "solver/reference/reference_scene.h"

#include "base/error.h"
#include "base/parallel.h"
#include "partition/partition.h"
#include "solver/cell_pager.h"
#include "solver/oracle.h"
#include "solver/transfer_sample.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr uint32_t kRays = 16;            // per pair of panels
constexpr uint32_t kEnclosureRays = 256;  // per panel
constexpr uint64_t kEnclosureStream = 0xe5cab;

double LongestEdgeOf(const PatchGeometry& p) {
  const float third =
      p.shape == PatchShape::kTriangle ? Length(p.u - p.v) : 0.0F;
  return static_cast<double>(std::max({Length(p.u), Length(p.v), third}));
}

// Cosine-distributed about the normal of the patch.
Vec3f CosineDirection(const PatchGeometry& patch, Random* random) {
  const Vec3f n = patch.normal;
  const Vec3f x = patch.u * (1 / Length(patch.u));
  const Vec3f y = Cross(n, x);
  const double r = std::sqrt(random->Next());
  const double phi = 2 * kPi * random->Next();
  const auto a = static_cast<float>(r * std::cos(phi));
  const auto b = static_cast<float>(r * std::sin(phi));
  return x * a + y * b + n * std::sqrt(std::max(0.0F, 1 - a * a - b * b));
}

Rgb RowOf(const std::vector<float>& table, MaterialId material, bool any) {
  Rgb value{};
  for (size_t c = 0; any && c < value.size(); ++c) {
    value[c] = static_cast<double>(table[material.Index() * value.size() + c]);
  }
  return value;
}

}  // namespace

ReferenceScene::ReferenceScene(const BlockStorage& store,
                               uint64_t seed,
                               MemoryBudget& budget)
    : seed_(seed), device_(budget, LoadSceneInfo(store).bounds.Center()) {
  const SceneInfo scene = LoadSceneInfo(store);
  const Partition partition = LoadPartition(store);
  size_t count = 0;
  for (const CellInfo& cell : partition.cells) {
    count += cell.patches;
  }
  if (count > kMostPanels) {
    throw DoesNotFitError(fmt::format(
        "the scene has {} patches; the reference methods hold it whole and "
        "take at most {}. Use --method wavelet",
        count,
        kMostPanels));
  }
  surfaces_ = MakeSurfaceTable(scene);
  reach_ = static_cast<float>(2 * Length(scene.bounds.high - scene.bounds.low));
  charge_ = MemoryCharge(
      budget, count * sizeof(PatchGeometry), "the patches of the scene");
  patches_.reserve(count);
  for (size_t c = 0; c < partition.cells.size(); ++c) {
    const CellPatches cell = LoadCellPatches(store, CellId(c));
    cell_begins_.push_back(patches_.size());
    for (const Patch& p : cell.patches) {
      patches_.push_back(MakePatchGeometry(
          p, scene.materials.at(p.material.Index()), device_.Origin()));
    }
    occluders_.push_back(device_.Build(cell));
    blockers_.push_back(occluders_.back().get());
  }
  cell_begins_.push_back(patches_.size());
  std::vector<uint8_t> sees(count);
  ParallelFor(count, [&](size_t i) {
    const Panel own = PanelAt(static_cast<uint32_t>(i), kRootPath);
    for (size_t j = 0; j < count && sees[i] == 0; ++j) {
      sees[i] = static_cast<uint8_t>(
          i != j && Face(own, PanelAt(static_cast<uint32_t>(j), kRootPath)));
    }
  });
  sees_.assign(sees.begin(), sees.end());
}

Rgb ReferenceScene::ReflectanceOf(const Panel& panel) const {
  const PatchGeometry& p = patches_[panel.patch];
  return RowOf(surfaces_.reflectance, p.material, p.reflects);
}

Rgb ReferenceScene::ExitanceOf(const Panel& panel) const {
  const PatchGeometry& p = patches_[panel.patch];
  return RowOf(surfaces_.exitance, p.material, p.emits);
}

Panel ReferenceScene::PanelAt(uint32_t patch, ElementPath path) const {
  const PatchGeometry& geometry = patches_[patch];
  return {patch,
          path,
          MakeTransferEnd(geometry, FrameOfPath(geometry.shape, path))};
}

double ReferenceScene::LongestEdge() const {
  double longest = 0;
  for (size_t i = 0; i < patches_.size(); ++i) {
    longest = std::max(longest, sees_[i] ? LongestEdgeOf(patches_[i]) : 0.0);
  }
  return longest;
}

size_t ReferenceScene::LevelsFor(size_t patch, double longest_edge) const {
  // A hair of tolerance: edges that should be equal are not, in floats.
  double edge = sees_[patch] ? LongestEdgeOf(patches_[patch]) * 0.9999 : 0.0;
  size_t levels = 0;
  for (; edge > longest_edge && levels < kMaxLevel; ++levels) {
    edge *= 0.5;
  }
  return levels;
}

size_t ReferenceScene::DiceCount(double longest_edge) const {
  size_t count = 0;
  for (size_t i = 0; i < patches_.size(); ++i) {
    count += size_t{1} << (2 * LevelsFor(i, longest_edge));
  }
  return count;
}

std::vector<Panel> ReferenceScene::Dice(double longest_edge) const {
  std::vector<Panel> panels;
  panels.reserve(DiceCount(longest_edge));
  for (size_t i = 0; i < patches_.size(); ++i) {
    // The paths of a level are consecutive numbers (element_tree.h).
    const ElementPath end = ElementPath{1} << (2 * LevelsFor(i, longest_edge));
    for (ElementPath path = end; path < 2 * end; ++path) {
      panels.push_back(PanelAt(static_cast<uint32_t>(i), path));
    }
  }
  return panels;
}

bool ReferenceScene::Face(const Panel& i, const Panel& j) {
  return !IsBehind(i.end, *j.end.patch) && !IsBehind(j.end, *i.end.patch);
}

float ReferenceScene::Exchange(const Panel& i, const Panel& j) const {
  if (std::pair(j.patch, j.path) < std::pair(i.patch, i.path)) {
    return Exchange(j, i);
  }
  if (!Face(i, j)) {
    return 0;
  }
  const bool near = IsNear(i.end, j.end) || IsNear(j.end, i.end);
  const Kernel kernel =
      near ? NearKernel(i.end, j.end) : QuadratureKernel(i.end, j.end);
  float form_factor = 0;
  for (size_t g = 0; g < kTransferNodes; ++g) {
    for (size_t q = 0; q < kTransferNodes; ++q) {
      form_factor += i.end.weight[g] * kernel[g * kTransferNodes + q];
    }
  }
  return form_factor > 0 ? i.end.area * form_factor * VisibleShare(i, j) : 0;
}

// One ray for each pair of nodes, the rest anywhere.
float ReferenceScene::VisibleShare(const Panel& i, const Panel& j) const {
  const uint64_t first = MixKey(MixKey(seed_, i.patch), i.path);
  Random random(MixKey(MixKey(first, j.patch), j.path));
  SegmentPacket packet;
  for (uint32_t ray = 0; ray < kRays; ++ray) {
    const size_t stratum = ray < i.end.node_count * j.end.node_count
                               ? ray
                               : random.NextBelow(kRays);
    const size_t g = stratum % i.end.node_count;
    const size_t q = stratum / i.end.node_count % j.end.node_count;
    AddSegment(RandomPair(i.end, g, j.end, q, &random), &packet);
  }
  const auto blocked =
      static_cast<uint32_t>(__builtin_popcount(Occluded(blockers_, packet)));
  return static_cast<float>(kRays - blocked) / static_cast<float>(kRays);
}

bool ReferenceScene::IsEnclosed(const Panel& panel) const {
  Random random(
      MixKey(MixKey(MixKey(seed_, panel.patch), panel.path), kEnclosureStream));
  for (uint32_t done = 0; done < kEnclosureRays; done += kRays) {
    SegmentPacket packet;
    for (uint32_t ray = 0; ray < kRays; ++ray) {
      const Vec3f x = RandomPoint(panel.end, &random);
      const Vec3f d = CosineDirection(*panel.end.patch, &random);
      AddSegment({x, x + d * reach_}, &packet);
    }
    if (Occluded(blockers_, packet) != (1U << kRays) - 1) {
      return false;
    }
  }
  return true;
}

}  // namespace enfilade
