#include "tools/verify_bins.h"

#include "base/photometry.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace enfilade {
namespace {

// A leaf has a bin of its own if it is brighter than this many times the mean.
constexpr double kBright = 4;
// Leaves side by side share a bin as long as their levels are alike.
constexpr double kAlike = 16;
constexpr size_t kMostBright = 8192;

double LevelOf(const Rgb& reflected) {
  double sum = 0;
  for (const double channel : reflected) {
    sum += channel * channel / kRgbChannels;
  }
  return sum;
}

Rgb ReflectedAt(const BuildingView& view,
                const SidePoint& point,
                const Rgb& radiosity) {
  Rgb reflected = radiosity;
  const Material& m = view.scene->materials[point.material.Index()];
  for (size_t c = 0; c < kRgbChannels; ++c) {
    reflected[c] -= point.emits ? m.exitance[c] : 0.0;
  }
  return reflected;
}

// Equal parts of the line, by the middles of them.
std::vector<LightBin> EqualBins(const BuildingView& view,
                                const SidePoints& sides,
                                uint32_t parts,
                                uint32_t points_at_once) {
  std::vector<LightBin> bins(parts);
  const double length = sides.Area() / parts;
  for (uint32_t first = 0; first < parts; first += points_at_once) {
    const uint32_t count = std::min(parts - first, points_at_once);
    std::vector<double> places(count);
    for (uint32_t i = 0; i < count; ++i) {
      places[i] = (first + i + 0.5) * length;
    }
    const std::vector<SidePoint> points = sides.At(places);
    std::vector<PatchPoint> on_patches(count);
    std::transform(points.begin(),
                   points.end(),
                   on_patches.begin(),
                   [](const SidePoint& p) { return p.point; });
    const std::vector<Rgb> radiosity = view.radiosity(on_patches);
    for (uint32_t i = 0; i < count; ++i) {
      const double begin = (first + i) * length;
      bins[first + i] = {begin,
                         begin + length,
                         LevelOf(ReflectedAt(view, points[i], radiosity[i]))};
    }
  }
  bins.back().end = sides.Area();
  return bins;
}

// The bright leaves of the whole solution, patch by patch.
class BrightStretches {
 public:
  explicit BrightStretches(double least_level) : least_level_(least_level) {}

  void Add(const LightBin& leaf) {
    if (leaf.level > least_level_) {
      leaves_.push_back(leaf);
    }
    if (leaves_.size() >= kMostBright) {
      EndPatch();
    }
  }

  // Joins the leaves of a patch that are alike and side by side.
  void EndPatch() {
    Sort(&leaves_);
    double lowest = 0;  // of the leaves of the last stretch
    double highest = 0;
    bool is_first = true;
    for (const LightBin& leaf : leaves_) {
      LightBin* last = is_first ? nullptr : &bins_.back();
      is_first = false;
      if (last == nullptr || leaf.begin != last->end ||
          leaf.level > kAlike * lowest || highest > kAlike * leaf.level) {
        bins_.push_back(leaf);
        lowest = leaf.level;
        highest = leaf.level;
        continue;
      }
      const double before = last->end - last->begin;
      const double added = leaf.end - leaf.begin;
      last->level =
          (last->level * before + leaf.level * added) / (before + added);
      last->end = leaf.end;
      lowest = std::min(lowest, leaf.level);
      highest = std::max(highest, leaf.level);
    }
    leaves_.clear();
    while (bins_.size() > kMostBright) {
      least_level_ *= 2;
      std::erase_if(bins_, [&](const LightBin& bin) {
        return !(bin.level > least_level_);
      });
    }
  }

  std::vector<LightBin> Sorted() && {
    Sort(&bins_);
    return std::move(bins_);
  }

 private:
  static void Sort(std::vector<LightBin>* bins) {
    std::sort(
        bins->begin(), bins->end(), [](const LightBin& a, const LightBin& b) {
          return a.begin < b.begin;
        });
  }

  double least_level_;
  std::vector<LightBin> leaves_;  // of the patch at hand
  std::vector<LightBin> bins_;
};

void AddCell(const BuildingView& view,
             CellId id,
             double* line,
             BrightStretches* bright) {
  const CellPatches cell = view.load_cell(id);
  std::vector<PatchId> patches;
  std::vector<double> begins(cell.patches.size());
  for (size_t p = 0; p < cell.patches.size(); ++p) {
    if (Reflects(*view.scene, cell.patches[p])) {
      patches.emplace_back(p);
      begins[p] = *line;
      *line += PatchArea(cell.patches[p]);
    }
  }
  std::optional<PatchId> at;
  view.for_each_mean(id, patches, [&](const LeafMean& leaf) {
    if (at && *at != leaf.patch) {
      bright->EndPatch();
    }
    at = leaf.patch;
    const Patch& patch = cell.patches[leaf.patch.Index()];
    Rgb reflected = view.scene->materials[patch.material.Index()].reflectance;
    for (size_t c = 0; c < kRgbChannels; ++c) {
      reflected[c] *= leaf.irradiance[c];
    }
    const double area = PatchArea(patch);
    const LineStretch part = StretchOnPatch(patch.shape, leaf.frame);
    const double begin = begins[leaf.patch.Index()];
    bright->Add({begin + part.begin * area,
                 begin + part.end * area,
                 LevelOf(reflected)});
  });
  bright->EndPatch();
}

}  // namespace

uint64_t LightBinBytes(uint32_t equal_parts) {
  // Each bright bin cuts an equal one in two at most. With the bins a number
  // is held for each; while they are made, the bright ones and their leaves.
  const uint64_t bins = equal_parts + 2 * kMostBright;
  return bins * (sizeof(LightBin) + sizeof(double)) +
         2 * kMostBright * sizeof(LightBin);
}

std::vector<LightBin> Overlaid(std::span<const LightBin> bins,
                               std::span<const LightBin> others) {
  std::vector<LightBin> all;
  all.reserve(bins.size() + 2 * others.size());
  auto other = others.begin();
  for (LightBin bin : bins) {
    if (!all.empty()) {  // another may have begun before it
      bin.begin = std::max(bin.begin, all.back().end);
    }
    for (; other != others.end() && other->begin < bin.end; ++other) {
      if (bin.begin < other->begin) {
        all.push_back({bin.begin, other->begin, bin.level});
      }
      all.push_back(*other);
      bin.begin = std::max(bin.begin, other->end);
    }
    if (bin.begin < bin.end) {
      all.push_back(bin);
    }
  }
  return all;
}

std::vector<LightBin> FindLightBins(const BuildingView& view,
                                    const SidePoints& sides,
                                    uint32_t equal_parts,
                                    uint32_t points_at_once) {
  std::vector<LightBin> equal =
      EqualBins(view, sides, equal_parts, points_at_once);
  if (!view.for_each_mean) {
    return equal;
  }
  double mean = 0;
  for (const LightBin& bin : equal) {
    mean += std::sqrt(bin.level) / static_cast<double>(equal.size());
  }
  BrightStretches bright(kBright * kBright * mean * mean);
  double line = 0;
  for (size_t c = 0; c < view.partition->cells.size(); ++c) {
    AddCell(view, CellId(c), &line, &bright);
  }
  return Overlaid(equal, std::move(bright).Sorted());
}

}  // namespace enfilade
