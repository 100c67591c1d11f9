#include "solver/reference/reference_scene.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/stop.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "solver/paging/cell_pager.h"
#include "solver/reference/panel_rays.h"
#include "solver/transfer/cosine_directions.h"
#include "solver/transfer/oracle.h"
#include "solver/transfer/transfer_sample.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr uint32_t kRaysPerPair = 16;     // of panels
constexpr uint32_t kEnclosureRays = 256;  // per panel
constexpr uint64_t kEnclosureStream = 0xe5cab;
constexpr uint64_t kCenterStream = 0xce47e;

double LongestEdgeOf(const PatchGeometry& p) {
  const float third =
      p.shape == PatchShape::kTriangle ? Length(p.u - p.v) : 0.0F;
  return static_cast<double>(std::max({Length(p.u), Length(p.v), third}));
}

bool IsLongInU(const PatchGeometry& p) {
  return Length(p.u) >= Length(p.v);
}

// The most halvings of the length alone that a patch may take.
size_t MostStrips(const PatchGeometry& p) {
  constexpr double kMost = 4;
  if (p.shape == PatchShape::kTriangle) {
    return 0;
  }
  const auto ratio = static_cast<double>(std::max(Length(p.u), Length(p.v)) /
                                         std::min(Length(p.u), Length(p.v)));
  return static_cast<size_t>(
      std::clamp(std::ceil(std::log2(ratio)), 0.0, kMost));
}

uint64_t FoldInto(uint64_t key, const Panel& p) {
  return MixKey(MixKey(MixKey(key, p.patch), p.strip), p.path);
}

Rgb RowOf(const std::vector<float>& table, MaterialId material, bool any) {
  Rgb value{};
  for (size_t c = 0; any && c < value.size(); ++c) {
    value[c] = static_cast<double>(table[material.Index() * value.size() + c]);
  }
  return value;
}

}  // namespace

size_t StripLevel(uint32_t strip) {
  return static_cast<size_t>(std::bit_width(strip + 1) - 1);
}

bool ComesBefore(const Panel& i, const Panel& j) {
  return std::tie(i.patch, i.strip, i.path) <
         std::tie(j.patch, j.strip, j.path);
}

ReferenceScene::ReferenceScene(const BlockStorage& store,
                               uint64_t seed,
                               MemoryBudget& budget)
    : seed_(seed), device_(budget, LoadSceneInfo(store).bounds.Center()) {
  const SceneInfo scene = LoadSceneInfo(store);
  const std::vector<CellInfo> cells = LoadCells(store);
  const size_t count = PatchCount(cells);
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
  for (size_t c = 0; c < cells.size(); ++c) {
    const CellPatches cell = LoadCellPatches(store, CellId(c));
    cell_begins_.push_back(patches_.size());
    for (const Patch& p : cell.patches) {
      patches_.push_back(MakePatchGeometry(
          p, scene.materials.at(p.material.Index()), device_.Origin()));
    }
    held_blockers_.push_back(device_.Build(cell));
    blockers_.push_back(held_blockers_.back().get());
  }
  cell_begins_.push_back(patches_.size());
  size_t strips = 0;
  for (const PatchGeometry& p : patches_) {
    strips += (size_t{2} << MostStrips(p)) - 1;
  }
  strip_charge_ = MemoryCharge(
      budget, strips * sizeof(PatchGeometry), "the strips of the patches");
  strips_.reserve(strips);  // panels point into it
  for (const PatchGeometry& p : patches_) {
    AppendStrips(p);
  }
  std::vector<uint8_t> sees(count);
  ParallelFor(count, [&](size_t i) {
    ThrowIfStopRequested();
    const Panel own = PanelAt(static_cast<uint32_t>(i), 0, kRootPath);
    for (size_t j = 0; j < count && sees[i] == 0; ++j) {
      sees[i] = static_cast<uint8_t>(
          i != j && Face(own, PanelAt(static_cast<uint32_t>(j), 0, kRootPath)));
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

void ReferenceScene::AppendStrips(const PatchGeometry& patch) {
  strip_begins_.push_back(strips_.size());
  for (size_t k = 0; k <= MostStrips(patch); ++k) {
    const float width = std::ldexp(1.0F, -static_cast<int>(k));
    PatchGeometry strip = patch;
    Vec3f& step = IsLongInU(patch) ? strip.u : strip.v;
    step = step * width;
    strip.area *= width;
    strip.diameter =
        std::max(Length(strip.u + strip.v), Length(strip.u - strip.v));
    if (k == 0) {
      strip.diameter = patch.diameter;
    }
    for (uint32_t i = 0; i < 1U << k; ++i) {
      strip.origin = patch.origin + step * static_cast<float>(i);
      strips_.push_back(strip);
    }
  }
}

Panel ReferenceScene::PanelAt(uint32_t patch,
                              uint32_t strip,
                              ElementPath path) const {
  const PatchGeometry& geometry = strips_[strip_begins_[patch] + strip];
  return {patch,
          strip,
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

ReferenceScene::Cuts ReferenceScene::CutsFor(size_t patch,
                                             double longest_edge) const {
  const PatchGeometry& p = patches_[patch];
  // The tolerance is for edges that should be equal but differ in floats.
  const auto halvings = [&](double edge) {
    size_t count = 0;
    for (edge *= 0.9999; edge > longest_edge && count < kMaxLevel; ++count) {
      edge *= 0.5;
    }
    return count;
  };
  if (!sees_[patch]) {
    return {};
  }
  const size_t length = halvings(LongestEdgeOf(p));
  const size_t width =
      p.shape == PatchShape::kTriangle
          ? length
          : halvings(static_cast<double>(std::min(Length(p.u), Length(p.v))));
  const size_t strips =
      std::min({length - width, MostStrips(p), kMaxLevel - length});
  return {strips, length - strips};
}

size_t ReferenceScene::DiceCount(double longest_edge) const {
  size_t count = 0;
  for (size_t i = 0; i < patches_.size(); ++i) {
    const Cuts cuts = CutsFor(i, longest_edge);
    count += size_t{1} << (cuts.strips + 2 * cuts.quarters);
  }
  return count;
}

std::vector<Panel> ReferenceScene::Dice(double longest_edge) const {
  std::vector<Panel> panels;
  panels.reserve(DiceCount(longest_edge));
  for (size_t i = 0; i < patches_.size(); ++i) {
    const Cuts cuts = CutsFor(i, longest_edge);
    const uint32_t strips = 1U << cuts.strips;
    // The paths of a level are consecutive numbers (element_tree.h).
    const ElementPath end = ElementPath{1} << (2 * cuts.quarters);
    for (uint32_t strip = strips - 1; strip < 2 * strips - 1; ++strip) {
      for (ElementPath path = end; path < 2 * end; ++path) {
        panels.push_back(PanelAt(static_cast<uint32_t>(i), strip, path));
      }
    }
  }
  return panels;
}

PanelRect ReferenceScene::RectOf(const Panel& panel) const {
  const PatchGeometry& p = patches_[panel.patch];
  const size_t k = StripLevel(panel.strip);
  const float width = std::ldexp(1.0F, -static_cast<int>(k));
  const auto index = static_cast<float>(panel.strip + 1 - (1U << k));
  const ElementFrame& f = panel.end.frame;
  PanelRect rect{f.a, f.a + f.scale, f.b, f.b + f.scale};
  float& low = IsLongInU(p) ? rect.a_low : rect.b_low;
  float& high = IsLongInU(p) ? rect.a_high : rect.b_high;
  low = (low + index) * width;
  high = (high + index) * width;
  return rect;
}

uint32_t ReferenceScene::StripAt(uint32_t patch, size_t k, UnitPoint* p) const {
  const uint32_t strips = 1U << k;
  double& along = IsLongInU(patches_[patch]) ? p->a : p->b;
  along *= strips;
  const uint32_t index =
      std::min(static_cast<uint32_t>(std::max(along, 0.0)), strips - 1);
  along -= index;
  return strips - 1 + index;
}

bool ReferenceScene::Covers(const Panel& outer, const Panel& inner) const {
  if (outer.patch != inner.patch) {
    return false;
  }
  if (patches_[outer.patch].shape == PatchShape::kTriangle) {
    ElementPath path = inner.path;
    while (path > outer.path) {
      path >>= 2;
    }
    return path == outer.path;
  }
  const PanelRect o = RectOf(outer);
  const PanelRect i = RectOf(inner);
  const float a = 0.5F * (i.a_low + i.a_high);
  const float b = 0.5F * (i.b_low + i.b_high);
  return o.a_low < a && a < o.a_high && o.b_low < b && b < o.b_high;
}

std::vector<ElementPath> ReferenceScene::TreePaths(const Panel& panel) const {
  if (panel.strip == 0) {
    return {panel.path};
  }
  // Covers the panel with squares in patch coordinates whose side is the
  // panel's shorter side.
  const PanelRect rect = RectOf(panel);
  const float size =
      std::min(rect.a_high - rect.a_low, rect.b_high - rect.b_low);
  const int levels = -std::ilogb(size);
  std::vector<ElementPath> paths;
  for (float b = rect.b_low; b < rect.b_high; b += size) {
    for (float a = rect.a_low; a < rect.a_high; a += size) {
      const auto column = static_cast<uint32_t>(a / size);
      const auto row = static_cast<uint32_t>(b / size);
      ElementPath path = kRootPath;
      for (int bit = levels; bit-- > 0;) {
        path = ChildPath(path, (column >> bit & 1) | (row >> bit & 1) << 1);
      }
      paths.push_back(path);
    }
  }
  return paths;
}

bool ReferenceScene::Face(const Panel& i, const Panel& j) {
  return !IsBehind(i.end, *j.end.patch) && !IsBehind(j.end, *i.end.patch);
}

float ReferenceScene::Exchange(const Panel& i, const Panel& j) const {
  if (ComesBefore(j, i)) {
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
      form_factor += i.end.nodes.weight[g] * kernel[g * kTransferNodes + q];
    }
  }
  return form_factor > 0 ? i.end.area * form_factor * VisibleShare(i, j) : 0;
}

// Traces one ray for each pair of nodes, and the rest for random pairs.
float ReferenceScene::VisibleShare(const Panel& i, const Panel& j) const {
  if (ComesBefore(j, i)) {
    return VisibleShare(j, i);
  }
  Random random(FoldInto(KeyOf(i), j));
  SegmentPacket packet;
  for (uint32_t ray = 0; ray < kRaysPerPair; ++ray) {
    const size_t stratum = ray < i.end.node_count * j.end.node_count
                               ? ray
                               : random.NextBelow(kRaysPerPair);
    const size_t g = stratum % i.end.node_count;
    const size_t q = stratum / i.end.node_count % j.end.node_count;
    if (const auto pair = RandomPair(i.end, g, j.end, q, &random)) {
      AddSegment(*pair, &packet);
    }
  }
  const uint32_t lanes = (1U << packet.count) - 1;
  const auto seen = static_cast<uint32_t>(
      std::popcount(~Occluded(blockers_, packet) & lanes));
  return packet.count > 0
             ? static_cast<float>(seen) / static_cast<float>(packet.count)
             : 1.0F;
}

float ReferenceScene::ShareSeenFromCenter(const Panel& i,
                                          const Panel& j) const {
  const Vec3f x = i.end.center;
  Random random(MixKey(FoldInto(KeyOf(i), j), kCenterStream));
  SegmentPacket packet;
  for (uint32_t ray = 0; ray < kRaysPerPair; ++ray) {
    const Vec3f y = PointNearNode(j.end, ray % j.end.node_count, &random);
    if (Dot(y - x, i.end.patch->normal) > 0) {
      AddSegment({x, y}, &packet);
    }
  }
  const int blocked = std::popcount(Occluded(blockers_, packet));
  const auto traced = static_cast<float>(packet.count);
  return packet.count > 0 ? 1 - static_cast<float>(blocked) / traced : 0;
}

uint64_t ReferenceScene::KeyOf(const Panel& panel) const {
  return FoldInto(seed_, panel);
}

bool ReferenceScene::IsEnclosed(const Panel& panel) const {
  Random random(MixKey(KeyOf(panel), kEnclosureStream));
  const CosineDirections directions(*panel.end.patch);
  int escaped = 0;
  for (uint32_t done = 0; done < kEnclosureRays; done += kRaysPerPair) {
    SegmentPacket packet;
    for (uint32_t ray = 0; ray < kRaysPerPair; ++ray) {
      const Vec3f x = RandomPoint(panel.end, &random);
      const Vec3f d = directions.Draw(&random);
      AddSegment({x, x + d * reach_}, &packet);
    }
    escaped += static_cast<int>(kRaysPerPair) -
               std::popcount(Occluded(blockers_, packet));
  }
  return escaped <= 1;
}

}  // namespace enfilade
