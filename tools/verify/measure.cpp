#include "tools/verify/measure.h"

#include "base/error.h"
#include "base/random.h"
#include "base/stopwatch.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tools/verify/density.h"
#include "tools/verify/differences.h"
#include "tools/verify/estimate.h"
#include "tools/verify/paths.h"
#include "tools/verify/points.h"

namespace enfilade {
namespace {

using Clock = std::chrono::steady_clock;

// Keeps the samples apart from those of every other part of the program.
constexpr uint64_t kVerifySeedDomain = 0x7665726966790001ULL;

constexpr uint64_t kPointBytes = 512;  // of a point in all arrays of a round
constexpr uint32_t kBinsPerPoint = 8;  // of the density of points
constexpr uint32_t kPilotPoints = 2048;
constexpr uint32_t kLeastPoints = 512;  // of a round
constexpr double kAFewMore = 2.25;      // times the paths of the first pilot
constexpr double kPilotGrowth = 4;      // of the paths: needs a further pilot
constexpr double kMostOfTime = 0.25;    // the part that a round may take
// Paths are guided to places that are more than this many times brighter than
// the mean.
constexpr double kBrightBin = 8;
constexpr uint64_t kPartBytes =  // while spots are made of them
    3 * sizeof(BrightPart) + sizeof(SidePoint) + sizeof(double);

// Tells the time that pilots take for paths from the time that they take for
// reading.
class PilotTimes {
 public:
  void Add(double paths, double seconds) {
    if (paths_ > 0 && paths != paths_) {
      per_path_ = std::max((seconds - seconds_) / (paths - paths_), 0.0);
    }
    paths_ = paths;
    seconds_ = seconds;
  }

  [[nodiscard]] bool KnowsPaths() const { return per_path_.has_value(); }

  // The number of paths that take at most `seconds`. Until two pilots tell the
  // time of a path, all of a pilot's time is attributed to its paths.
  [[nodiscard]] double MostPaths(double seconds) const {
    const double all = seconds_ / paths_;
    const double per_path =
        std::max(per_path_.value_or(all), kLeastShare * all);
    return seconds / std::max(per_path, 1e-12);
  }

 private:
  static constexpr double kLeastShare = 0.02;

  double paths_ = 0;
  double seconds_ = 0;
  std::optional<double> per_path_;
};

class Measurement {
 public:
  Measurement(const BuildingView& view,
              const VerifyOptions& options,
              MemoryBudget& budget)
      : view_(view),
        options_(options),
        budget_(budget),
        points_(view),
        equal_bins_(options.points_per_round * kBinsPerPoint),
        charge_(
            budget,
            options.points_per_round * kPointBytes + LightBinBytes(equal_bins_),
            "the points of a round"),
        tracer_(view, budget),
        counted_points_(std::min(kLeastPoints, options.points_per_round)) {}

  VerifySummary Run() {
    if (points_.Area() <= 0) {
      throw InputError(
          "no surface of the scene reflects light, so that there is no error "
          "to measure");
    }
    tracer_.LearnEmitters(
        budget_, MixKey(MixKey(kVerifySeedDomain, options_.seed), ~0ULL));
    LookAtTheSolution();
    LearnWhereToLook();
    // All counted rounds have the same size, because the results of a round
    // must not affect the weight of later rounds.
    counted_points_ = PointsFor(most_paths_, options_.points_per_round);
    while (!Done()) {
      const double start = Seconds();
      Learn(AddRound(estimate_, counted_points_, &largest_));
      ++rounds_;
      round_seconds_ = Seconds() - start;
    }
    return Summary();
  }

 private:
  [[nodiscard]] double Seconds() const { return SecondsSince(start_); }

  void LookAtTheSolution() {
    std::vector<LightBin> bins =
        FindLightBins(view_, points_, equal_bins_, options_.points_per_round);
    GuidePaths(bins);
    density_.emplace(std::move(bins));
  }

  // Guides paths to where the solution is far brighter than in the mean.
  void GuidePaths(std::span<const LightBin> bins) {
    double mean = 0;
    for (const LightBin& bin : bins) {
      mean += std::sqrt(bin.level) * (bin.end - bin.begin) / points_.Area();
    }
    const auto bright = [&](const LightBin& bin) {
      return std::sqrt(bin.level) > kBrightBin * mean;
    };
    const auto count =
        static_cast<size_t>(std::count_if(bins.begin(), bins.end(), bright));
    if (count == 0) {
      return;
    }
    const MemoryCharge charge(budget_, count * kPartBytes, "the bright places");
    std::vector<BrightPart> parts;
    std::vector<double> places;
    parts.reserve(count);
    places.reserve(count);
    for (const LightBin& bin : bins) {
      if (bright(bin)) {
        const double radiosity = std::sqrt(bin.level);
        const double area = bin.end - bin.begin;
        places.push_back((bin.begin + bin.end) / 2);
        parts.push_back({{}, std::sqrt(area), radiosity * area});
      }
    }
    const std::vector<SidePoint> points = points_.At(places);
    for (size_t i = 0; i < parts.size(); ++i) {
      parts[i].position = points[i].receiver.position;
      parts[i].cell = points[i].point.cell;
    }
    tracer_.LearnBrightParts(
        std::move(parts),
        mean,
        budget_,
        MixKey(MixKey(kVerifySeedDomain, options_.seed), ~1ULL));
  }

  static std::vector<PatchPoint> OnPatches(
      const std::vector<SidePoint>& points) {
    std::vector<PatchPoint> on_patches;
    on_patches.reserve(points.size());
    for (const SidePoint& p : points) {
      on_patches.push_back(p.point);
    }
    return on_patches;
  }

  [[nodiscard]] Rgb ExitanceAt(const SidePoint& p) const {
    return p.emits ? view_.scene->materials[p.material.Index()].exitance
                   : Rgb{};
  }

  // Runs pilot rounds, which do not enter the result. They find where points,
  // and how many paths per point, are worth their time.
  void LearnWhereToLook() {
    PilotTimes times;
    uint32_t pilots = 0;
    for (bool settled = false; !settled;) {
      ErrorEstimate pilot;
      const double start = Seconds();
      const double paths = density_->MeanPaths();
      const uint32_t points = PointsFor(most_paths_ / 2, kPilotPoints);
      const PointDensity::Draw draw = AddRound(pilot, points);
      if (!(pilot.MeanReflected() > 0)) {
        throw InputError(
            "no light reaches a reflecting side of the scene, so that an "
            "error relative to it is undefined; check where the emitting "
            "faces look");
      }
      times.Add(paths * points, Seconds() - start);
      // A few more paths in the second pilot tell the time of paths from that
      // of reading.
      most_paths_ = std::max(
          times.MostPaths(kMostOfTime * options_.max_seconds),
          times.KnowsPaths() ? 0 : kAFewMore * paths * counted_points_);
      Learn(draw);
      // The first pilot places points where light is, not where they are worth
      // their time, so a second one always follows.
      settled = ++pilots > 1 && density_->MeanPaths() <= kPilotGrowth * paths;
    }
  }

  // Each round stays unbiased, whatever the rounds before it have taught the
  // density.
  void Learn(const PointDensity::Draw& draw) {
    density_->Learn(draw, values_);
    density_->LimitPaths(most_paths_ / counted_points_);
  }

  // The number of points of a round of about `paths` paths and at most `most`
  // points. If points need many paths, there are few points.
  [[nodiscard]] uint32_t PointsFor(double paths, uint32_t most) const {
    most = std::min(most, options_.points_per_round);
    return static_cast<uint32_t>(
        std::clamp(paths / density_->MeanPaths(),
                   static_cast<double>(std::min(counted_points_, most)),
                   static_cast<double>(most)));
  }

  PointDensity::Draw AddRound(ErrorEstimate& estimate,
                              uint32_t count,
                              LargestDifferences* largest = nullptr) {
    const uint64_t key =
        MixKey(MixKey(kVerifySeedDomain, options_.seed), round_key_++);
    PointDensity::Draw draw = density_->Choose(count, MixKey(key, 0));
    const std::vector<SidePoint> points = points_.At(draw.places);
    std::vector<Receiver> receivers;
    receivers.reserve(points.size());
    for (const SidePoint& p : points) {
      receivers.push_back(p.receiver);
    }
    const auto trace = [&](uint64_t half) {
      for (const uint32_t strata : draw.strata) {
        paths_ += uint64_t{strata} * strata;
      }
      return tracer_.Irradiance(
          receivers,
          MixKey(key, half),
          draw.strata,
          GatherMode::kPaths,
          [&](double fraction) {
            Report((static_cast<double>(half - 1) + fraction) / 2);
          });
    };
    const std::vector<Rgb> first = trace(1);
    const std::vector<Rgb> second = trace(2);
    const std::vector<Rgb> radiosity = view_.radiosity(OnPatches(points));
    std::vector<ErrorSample> samples(points.size());
    values_.resize(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      samples[i].reflectance =
          view_.scene->materials[points[i].material.Index()].reflectance;
      samples[i].exitance = ExitanceAt(points[i]);
      samples[i].irradiance1 = first[i];
      samples[i].irradiance2 = second[i];
      samples[i].radiosity = radiosity[i];
      samples[i].weight = draw.weights[i];
      values_[i] = {ProductOfDifferences(samples[i]),
                    NoiseVariance(samples[i])};
      const double part = samples[i].weight * values_[i].product;
      if (largest != nullptr && largest->Wants(part)) {
        largest->Add(Differing(points[i], samples[i], draw.strata[i], part));
      }
    }
    estimate.AddRound(samples);
    return draw;
  }

  [[nodiscard]] DifferingPoint Differing(const SidePoint& point,
                                         const ErrorSample& sample,
                                         uint32_t strata,
                                         double part) const {
    DifferingPoint d{
        .position = point.receiver.position,
        .normal = point.receiver.normal,
        .material = view_.scene->materials[point.material.Index()].name,
        .paths = 2 * strata * strata,
        .share = part};
    for (size_t c = 0; c < kRgbChannels; ++c) {
      d.solution[c] = sample.radiosity[c] - sample.exitance[c];
      d.reference[c] = sample.reflectance[c] *
                       (sample.irradiance1[c] + sample.irradiance2[c]) / 2;
    }
    return d;
  }

  [[nodiscard]] bool Tight() const {
    if (rounds_ == 0) {
      return false;
    }
    const Interval error = estimate_.Error();
    const double half = (error.high - error.low) / 2;
    return half <= TargetHalfWidth(error.value);
  }

  [[nodiscard]] double TargetHalfWidth(double error) const {
    return std::max(options_.target_half_width,
                    options_.target_relative_half_width *
                        std::max(error, options_.requested_error));
  }

  [[nodiscard]] bool Done() const {
    return Tight() || rounds_ >= options_.max_rounds ||
           (rounds_ > 0 && Seconds() + round_seconds_ > options_.max_seconds);
  }

  // Predicts how many rounds it takes until the half-width, which falls with
  // the root of their number, meets the target.
  void Report(double fraction_of_round) const {
    if (!options_.progress) {
      return;
    }
    double rounds = 2;
    if (rounds_ > 0) {
      const Interval error = estimate_.Error();
      const double target = std::max(TargetHalfWidth(error.value), 1e-12);
      const double excess = (error.high - error.low) / 2 / target;
      rounds = std::clamp(rounds_ * excess * excess,
                          rounds_ + 1.0,
                          static_cast<double>(options_.max_rounds));
    }
    const double by_rounds = (rounds_ + fraction_of_round) / rounds;
    const double by_time = Seconds() / options_.max_seconds;
    options_.progress(std::clamp(std::max(by_rounds, by_time), 0.0, 1.0));
  }

  [[nodiscard]] VerifySummary Summary() const {
    VerifySummary s;
    const Interval error = estimate_.Error();
    s.error = error.value;
    s.error_low = error.low;
    s.error_high = error.high;
    const Interval deviation = estimate_.Deviation();
    s.mean_deviation = deviation.value;
    s.mean_deviation_low = deviation.low;
    s.mean_deviation_high = deviation.high;
    s.mean_reflected = estimate_.MeanReflected();
    s.area_m2 = points_.Area();
    s.points = estimate_.Points();
    s.paths = paths_;
    s.rays = tracer_.Rays();
    s.rounds = rounds_;
    s.tight = Tight();
    s.seconds = Seconds();
    s.largest_differences = largest_.SharesOf(estimate_.SumOfSquares());
    return s;
  }

  const BuildingView& view_;
  const VerifyOptions& options_;
  MemoryBudget& budget_;
  Clock::time_point start_ = Clock::now();
  SidePoints points_;
  uint32_t equal_bins_;
  MemoryCharge charge_;
  PathTracer tracer_;
  std::optional<PointDensity> density_;
  ErrorEstimate estimate_;
  LargestDifferences largest_;
  std::vector<PilotValue> values_;  // at the points of the last round
  // The most paths of a round, over all points, for one of the two estimates.
  double most_paths_ = std::numeric_limits<double>::infinity();
  // Points of a counted round; the fewest allowed until the pilots have ended.
  uint32_t counted_points_;
  uint32_t rounds_ = 0;
  uint64_t round_key_ = 0;
  uint64_t paths_ = 0;
  double round_seconds_ = 0;
};

}  // namespace

VerifySummary MeasureError(const BuildingView& view,
                           const VerifyOptions& options,
                           MemoryBudget& budget) {
  return Measurement(view, options, budget).Run();
}

}  // namespace enfilade
