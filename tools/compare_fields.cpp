#include "tools/compare_fields.h"

#include "base/error.h"
#include "base/random.h"

#include <algorithm>
#include <cmath>

#include "tools/verify/points.h"

namespace enfilade {
namespace {

constexpr uint64_t kCompareSeedDomain = 0x636f6d7061726501ULL;
constexpr size_t kGroupPoints = 32768;  // evaluated together
constexpr uint64_t kGroupBytes = 64;  // of two values and a weight, plus slack
constexpr double kMostGrid = 32;      // sample points per patch and direction

class Comparison {
 public:
  Comparison(const BuildingView& building,
             const RadiosityField& a,
             const RadiosityField& b,
             const CompareOptions& options,
             MemoryBudget& budget)
      : building_(building),
        a_(a),
        b_(b),
        options_(options),
        charge_(budget,
                (kGroupPoints + kMostPatchPoints) *
                    (sizeof(PatchPoint) + sizeof(Sample) + kGroupBytes),
                "the points of a comparison") {}

  CompareSummary Run() {
    const size_t cells = building_.partition->cells.size();
    for (size_t c = 0; c < cells; ++c) {
      AddCell(CellId(c));
      if (options_.progress) {
        options_.progress(static_cast<double>(c + 1) /
                          static_cast<double>(cells));
      }
    }
    Flush();
    return Summary();
  }

 private:
  static constexpr size_t kMostPatchPoints = 1024;

  struct Sample {
    double area = 0;  // area that the point represents, m2
    Rgb exitance{};
  };

  void AddCell(CellId id) {
    const CellPatches cell = building_.load_cell(id);
    for (size_t p = 0; p < cell.patches.size(); ++p) {
      const Patch& patch = cell.patches[p];
      if (Reflects(patch, building_.scene->materials)) {
        AddPatch(id, PatchId(p), patch);
      }
      if (points_.size() >= kGroupPoints) {
        Flush();
      }
    }
  }

  // Samples a jittered grid, so that the points do not lie on the edges of a
  // grid of elements.
  void AddPatch(CellId cell, PatchId id, const Patch& patch) {
    const double area = PatchArea(patch);
    const double wanted = std::max<double>(options_.samples_per_patch,
                                           area / options_.sample_area_m2);
    const auto grid = static_cast<uint32_t>(
        std::clamp(std::ceil(std::sqrt(wanted)), 1.0, kMostGrid));
    Random random(MixKey(MixKey(kCompareSeedDomain, cell.value), id.value));
    Sample sample;
    sample.area = area / (grid * grid);
    if (patch.emits) {
      sample.exitance =
          building_.scene->materials[patch.material.Index()].exitance;
    }
    for (uint32_t k = 0; k < grid * grid; ++k) {
      const uint32_t column = k % grid;
      const uint32_t row = k / grid;
      const double s = (column + random.Next()) / grid;
      PatchPoint point = UniformPointOn(patch, s, (row + random.Next()) / grid);
      point.cell = cell;
      point.patch = id;
      points_.push_back(point);
      samples_.push_back(sample);
    }
  }

  void Flush() {
    if (points_.empty()) {
      return;
    }
    const std::vector<Rgb> a = a_(points_);
    const std::vector<Rgb> b = b_(points_);
    for (size_t i = 0; i < points_.size(); ++i) {
      for (size_t c = 0; c < kRgbChannels; ++c) {
        const double d = a[i][c] - b[i][c];
        const double weight = samples_[i].area / kRgbChannels;
        squares_ += weight * d * d;
        absolute_ += weight * std::abs(d);
        signed_ += weight * d;
        reflected_ += weight * (b[i][c] - samples_[i].exitance[c]);
        largest_ = std::max(largest_, std::abs(d));
      }
      area_ += samples_[i].area;
    }
    count_ += points_.size();
    points_.clear();
    samples_.clear();
  }

  [[nodiscard]] CompareSummary Summary() const {
    CompareSummary s;
    s.points = count_;
    s.mean_reflected = area_ > 0 ? reflected_ / area_ : 0;
    if (!(s.mean_reflected > 0)) {
      throw InputError(
          "the second solution, the reference, reflects no light, so that an "
          "error relative to it is undefined");
    }
    s.rms_error = std::sqrt(squares_ / area_) / s.mean_reflected;
    s.l1_error = absolute_ / area_ / s.mean_reflected;
    s.mean_deviation = signed_ / area_ / s.mean_reflected;
    s.max_error = largest_ / s.mean_reflected;
    return s;
  }

  const BuildingView& building_;
  const RadiosityField& a_;
  const RadiosityField& b_;
  const CompareOptions& options_;
  MemoryCharge charge_;
  std::vector<PatchPoint> points_;
  std::vector<Sample> samples_;
  double squares_ = 0;
  double absolute_ = 0;
  double signed_ = 0;
  double reflected_ = 0;
  double largest_ = 0;
  double area_ = 0;
  uint64_t count_ = 0;
};

}  // namespace

CompareSummary CompareFields(const BuildingView& building,
                             const RadiosityField& a,
                             const RadiosityField& b,
                             const CompareOptions& options,
                             MemoryBudget& budget) {
  return Comparison(building, a, b, options, budget).Run();
}

}  // namespace enfilade
