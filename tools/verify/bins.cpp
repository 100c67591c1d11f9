#include "tools/verify/bins.h"

#include "base/photometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace enfilade {
namespace {

// A leaf has a bin of its own if it is brighter than this many times the mean.
constexpr double kBright = 4;
// Adjacent leaves share a bin as long as their levels differ by no more than
// this factor.
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

// Equal parts of the line, each with the level at its middle.
std::vector<LightBin> BinsByPoints(const BuildingView& view,
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

// The variance, up to a factor, that a bright stretch would add if it had no
// bin of its own. The squared difference is taken as proportional to the level.
double LossWithout(const LightBin& bin) {
  return (bin.end - bin.begin) * bin.level * bin.level;
}

// Collects the bright leaves of the whole solution, patch by patch.
class BrightStretches {
 public:
  explicit BrightStretches(double least_level) : least_level_(least_level) {}

  void Add(const LightBin& leaf) {
    // On a line of square kilometres, rounding may leave a small leaf no
    // length.
    if (leaf.level > least_level_ && leaf.end > leaf.begin) {
      leaves_.push_back(leaf);
    }
    if (leaves_.size() >= kMostBright) {
      EndPatch();
    }
  }

  // Joins adjacent leaves of similar level, on this patch and with the last bin
  // of the patch before. If too many bins remain, drops those with the least
  // LossWithout.
  void EndPatch() {
    Sort(&leaves_);
    for (const LightBin& leaf : leaves_) {
      if (bins_.empty() || leaf.begin != bins_.back().end ||
          leaf.level > kAlike * lowest_ || highest_ > kAlike * leaf.level) {
        bins_.push_back(leaf);
        lowest_ = leaf.level;
        highest_ = leaf.level;
        continue;
      }
      LightBin& last = bins_.back();
      const double before = last.end - last.begin;
      const double added = leaf.end - leaf.begin;
      last.level =
          (last.level * before + leaf.level * added) / (before + added);
      last.end = leaf.end;
      lowest_ = std::min(lowest_, leaf.level);
      highest_ = std::max(highest_, leaf.level);
    }
    leaves_.clear();
    while (bins_.size() > kMostBright) {
      double least = std::numeric_limits<double>::infinity();
      for (const LightBin& bin : bins_) {
        least = std::min(least, LossWithout(bin));
      }
      least_loss_ = 2 * std::max(least, least_loss_);
      std::erase_if(bins_, [&](const LightBin& bin) {
        return LossWithout(bin) < least_loss_;
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
  double least_loss_ = 0;
  double lowest_ = 0;  // of the leaves of the last stretch
  double highest_ = 0;
  std::vector<LightBin> leaves_;  // of the patch at hand
  std::vector<LightBin> bins_;
};

// Calls `add` for the stretch of every leaf of the solution, patch by patch
// along the line but in any order within a patch, and `end_patch` after each
// patch.
template <typename Add, typename EndPatch>
void ForEachLeaf(const BuildingView& view,
                 const Add& add,
                 const EndPatch& end_patch) {
  double line = 0;
  for (size_t i = 0; i < view.partition->cells.size(); ++i) {
    const CellId id(i);
    const CellPatches cell = view.load_cell(id);
    std::vector<PatchId> patches;
    std::vector<double> begins(cell.patches.size());
    for (size_t p = 0; p < cell.patches.size(); ++p) {
      if (Reflects(cell.patches[p], view.scene->materials)) {
        patches.emplace_back(p);
        begins[p] = line;
        line += PatchArea(cell.patches[p]);
      }
    }
    std::optional<PatchId> at;
    view.for_each_mean(id, patches, [&](const LeafMean& leaf) {
      if (at && *at != leaf.patch) {
        end_patch();
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
      add(LightBin{begin + part.begin * area,
                   begin + part.end * area,
                   LevelOf(reflected)});
    });
    end_patch();
  }
}

// Equal parts of the line, each with the mean level of the leaves on it.
class EqualParts {
 public:
  EqualParts(double length, uint32_t parts)
      : each_(length / parts), sums_(parts), covered_(parts) {}

  void Add(const LightBin& leaf) { Spread(leaf, 1); }

  // Removes a stretch with a bin of its own from the parts that it lies on.
  void TakeOut(const LightBin& bin) { Spread(bin, -1); }

  [[nodiscard]] std::vector<LightBin> Bins() const {
    std::vector<LightBin> bins(sums_.size());
    for (size_t i = 0; i < bins.size(); ++i) {
      const auto at = static_cast<double>(i);
      bins[i] = {at * each_,
                 (at + 1) * each_,
                 covered_[i] > kLeastCovered * each_
                     ? std::max(sums_[i], 0.0) / covered_[i]
                     : 0.0};
    }
    return bins;
  }

 private:
  static constexpr double kLeastCovered = 1e-9;

  void Spread(const LightBin& leaf, double sign) {
    const auto last = static_cast<double>(sums_.size() - 1);
    const double first = std::clamp(std::floor(leaf.begin / each_), 0.0, last);
    for (auto i = static_cast<size_t>(first); i < sums_.size(); ++i) {
      const double begin = static_cast<double>(i) * each_;
      const double overlap =
          std::min(leaf.end, begin + each_) - std::max(leaf.begin, begin);
      if (begin >= leaf.end) {
        break;
      }
      sums_[i] += sign * std::max(overlap, 0.0) * leaf.level;
      covered_[i] += sign * std::max(overlap, 0.0);
    }
  }

  double each_;
  std::vector<double> sums_;     // of the levels, by area
  std::vector<double> covered_;  // m2
};

}  // namespace

uint64_t LightBinBytes(uint32_t equal_parts) {
  // Each bright bin cuts at most one equal part in two. One number per bin is
  // held along with the bins. While the bins are made, the bright ones, their
  // leaves and the equal parts are held as well.
  const uint64_t bins = equal_parts + 2 * kMostBright;
  return bins * (sizeof(LightBin) + sizeof(double)) +
         2 * kMostBright * sizeof(LightBin) +
         equal_parts * (sizeof(LightBin) + 2 * sizeof(double));
}

std::vector<LightBin> Overlaid(std::span<const LightBin> bins,
                               std::span<const LightBin> others) {
  std::vector<LightBin> all;
  all.reserve(bins.size() + 2 * others.size());
  auto other = others.begin();
  for (LightBin bin : bins) {
    if (!all.empty()) {  // the last of `others` may reach into this bin
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
  if (!view.for_each_mean) {
    return BinsByPoints(view, sides, equal_parts, points_at_once);
  }
  EqualParts parts(sides.Area(), equal_parts);
  ForEachLeaf(
      view, [&](const LightBin& leaf) { parts.Add(leaf); }, [] {});
  double mean = 0;
  for (const LightBin& bin : parts.Bins()) {
    mean += std::sqrt(bin.level) / equal_parts;
  }
  BrightStretches stretches(kBright * kBright * mean * mean);
  ForEachLeaf(
      view,
      [&](const LightBin& leaf) { stretches.Add(leaf); },
      [&] { stretches.EndPatch(); });
  const std::vector<LightBin> bright = std::move(stretches).Sorted();
  for (const LightBin& bin : bright) {
    parts.TakeOut(bin);
  }
  std::vector<LightBin> equal = parts.Bins();
  equal.back().end = sides.Area();
  return Overlaid(equal, bright);
}

}  // namespace enfilade
