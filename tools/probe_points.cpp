#include "tools/probe_points.h"

#include "base/error.h"
#include "base/random.h"
#include "base/stopwatch.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ostream>
#include <string>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr uint64_t kProbeSeedDomain = 0x70726f6265000001ULL;
constexpr size_t kBatchPoints = 1024;
// Bytes of a point in all arrays of a batch.
constexpr uint64_t kProbePointBytes = 1024;
// The text of a batch, which is kept for its output; a last line may exceed it.
constexpr uint64_t kBatchTextBytes = kBatchPoints * kProbePointBytes / 4;
// A point lies on the surface that it is this near to, m; if there is none, on
// the outermost that is nearer than kOnPatchDistance.
constexpr double kInPlaceDistance = 1e-4;
constexpr double kOnPatchDistance = 1e-3;
constexpr double kOnPatchCosine = 0.99619469809174555;  // of 5 degrees

class Prober {
 public:
  Prober(const BuildingView& view,
         const ProbeOptions& options,
         MemoryBudget& budget)
      : view_(view),
        options_(options),
        charge_(budget, kBatchPoints * kProbePointBytes, "a batch of points"),
        tracer_(view, budget, BatchRoom::kMost) {}

  // One value per line, in their order.
  std::vector<Rgb> Irradiance(const std::vector<ProbeLine>& lines) {
    std::vector<Rgb> values(lines.size());
    std::vector<PatchPoint> on_patches;
    std::vector<size_t> on_patch_lines;
    std::vector<Receiver> free_points;
    std::vector<size_t> free_lines;
    const std::vector<TraceHit> hits = FindPatches(lines);
    for (size_t i = 0; i < lines.size(); ++i) {
      if (hits[i].hit && surfaces_[i].front &&
          MaxChannel(surfaces_[i].reflectance) > 0) {
        on_patches.push_back(
            {hits[i].cell, hits[i].patch, hits[i].a, hits[i].b});
        on_patch_lines.push_back(i);
      } else {
        free_points.push_back(lines[i].receiver);
        if (surfaces_[i].front) {
          free_points.back().position = surfaces_[i].position;
        }
        free_lines.push_back(i);
      }
    }
    summary_.on_patches += on_patches.size();
    summary_.gathered += free_points.size();
    if (!on_patches.empty()) {
      const std::vector<Rgb> irradiance = view_.irradiance(on_patches);
      for (size_t k = 0; k < on_patches.size(); ++k) {
        values[on_patch_lines[k]] = irradiance[k];
      }
    }
    const std::vector<Rgb> gathered = Gather(free_points);
    for (size_t k = 0; k < free_points.size(); ++k) {
      values[free_lines[k]] = gathered[k];
    }
    summary_.points += lines.size();
    return values;
  }

  [[nodiscard]] const ProbeSummary& Summary() const { return summary_; }

 private:
  // Finds the surface that each point lies on, and returns the hits. Leaves
  // surfaces_[i].front set only where there is one.
  std::vector<TraceHit> FindPatches(const std::vector<ProbeLine>& lines) {
    surfaces_.assign(lines.size(), {});
    std::vector<TraceHit> hits(lines.size());
    // Of surfaces in one place, the raised one is seen. If there is none, what
    // is more than kOnPatchDistance above the point is in the way.
    constexpr double kRaised = kMostLayers * kApartM;
    const auto look_within = [&](double distance) {
      Look({kRaised + distance, distance}, lines, &hits);
      Look({distance, distance}, lines, &hits);
    };
    look_within(kInPlaceDistance);
    double within = kOnPatchDistance;
    look_within(within);
    // The surface may have been moved from where the file, and the point, has
    // it. The nearest is the likeliest.
    const double most = kOnPatchDistance + view_.scene->greatest_move_m;
    while (within < most) {
      within = std::min(within + kOnPatchDistance, most);
      look_within(within);
    }
    return hits;
  }

  // Where a surface is looked for: from so far above a point, and at most so
  // far from it.
  struct Reach {
    double height_m = 0;
    double distance_m = 0;
  };

  // Traces a short ray against the normal of each point that has no surface
  // yet.
  void Look(Reach reach,
            const std::vector<ProbeLine>& lines,
            std::vector<TraceHit>* hits) {
    std::vector<size_t> points;
    std::vector<TraceRay> rays;
    for (size_t i = 0; i < lines.size(); ++i) {
      if (!surfaces_[i].front) {
        const Receiver& r = lines[i].receiver;
        points.push_back(i);
        TraceRay& ray = rays.emplace_back();
        ray.origin = r.position + r.normal * reach.height_m;
        ray.direction = -r.normal;
        ray.max_distance = reach.height_m + reach.distance_m;
      }
    }
    std::vector<TraceHit> found(rays.size());
    std::vector<Surface> surfaces(rays.size());
    view_.trace(rays, found);
    tracer_.Surfaces().Read(rays, found, surfaces);
    for (size_t k = 0; k < points.size(); ++k) {
      const size_t i = points[k];
      if (surfaces[k].front &&
          reach.height_m - found[k].distance - surfaces[k].raised <=
              reach.distance_m &&
          Dot(surfaces[k].normal, lines[i].receiver.normal) >= kOnPatchCosine) {
        (*hits)[i] = found[k];
        surfaces_[i] = surfaces[k];
      }
    }
  }

  std::vector<Rgb> Gather(const std::vector<Receiver>& points) {
    const auto strata = static_cast<uint32_t>(
        std::ceil(std::sqrt(static_cast<double>(options_.gather_rays))));
    const auto report = [&](double) {
      if (options_.progress) {
        options_.progress(summary_.points);
      }
    };
    const uint64_t key =
        MixKey(MixKey(kProbeSeedDomain, options_.seed), summary_.points);
    return tracer_.Irradiance(points, key, strata, GatherMode::kField, report);
  }

  const BuildingView& view_;
  const ProbeOptions& options_;
  MemoryCharge charge_;
  PathTracer tracer_;
  std::vector<Surface> surfaces_;
  ProbeSummary summary_;
};

}  // namespace

ProbeSummary ProbePoints(const BuildingView& view,
                         std::istream& points,
                         const std::string& name,
                         std::ostream& out,
                         const ProbeOptions& options,
                         MemoryBudget& budget) {
  const auto start = std::chrono::steady_clock::now();
  ProbeReader reader(points, name);
  Prober prober(view, options, budget);
  const std::string header = reader.Header();
  bool more = true;
  for (bool is_first = true; more; is_first = false) {
    std::vector<ProbeLine> lines;
    size_t text_bytes = 0;
    while (more && lines.size() < kBatchPoints &&
           text_bytes < kBatchTextBytes) {
      auto line = reader.Next();
      more = line.has_value();
      if (line) {
        text_bytes += line->text.size();
        lines.push_back(std::move(*line));
      }
    }
    const std::vector<Rgb> values = prober.Irradiance(lines);
    if (is_first) {  // errors in the first batch come before any output
      out << header << '\n';
    }
    for (size_t i = 0; i < lines.size(); ++i) {
      const Rgb& h = values[i];
      out << lines[i].text
          << fmt::format(",{:.9g},{:.9g},{:.9g}\n", h[0], h[1], h[2]);
    }
    if (!out) {
      throw DiskError("cannot write the irradiance: the disk may be full");
    }
    if (options.progress) {
      options.progress(prober.Summary().points);
    }
  }
  ProbeSummary summary = prober.Summary();
  summary.seconds = SecondsSince(start);
  return summary;
}

}  // namespace enfilade
