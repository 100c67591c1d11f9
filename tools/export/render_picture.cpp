#include "tools/export/render_picture.h"

#include "base/error.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <tuple>

#include "tools/building_surfaces.h"
#include <fmt/format.h>
#include <unistd.h>

namespace enfilade {
namespace {

constexpr uint64_t kSampleBytes = 384;  // of a sample in all arrays of a band
constexpr size_t kLeastSamples = 4096;
constexpr size_t kMostSamples = 131072;

enum class Seen : uint8_t { kNothing, kBack, kFront };

// A sample of a band that sees the front of a patch. A band is a run of pixels,
// row by row.
struct SeenPoint {
  uint32_t sample = 0;  // within the band
  uint32_t patch = 0;
  float a = 0;
  float b = 0;
};

// The seen points of a band that lie in one cell; they are stored one after the
// other.
struct Section {
  uint32_t cell = 0;
  uint64_t first = 0;
  uint32_t count = 0;
};

using Value = std::array<float, kRgbChannels>;

class Renderer {
 public:
  Renderer(const BuildingView& view,
           const Camera& camera,
           const RenderOptions& options,
           MemoryBudget& budget)
      : view_(view),
        camera_(camera),
        options_(options),
        per_pixel_(options.samples * options.samples),
        pixels_(static_cast<uint64_t>(options.width) * options.height),
        band_pixels_(BandPixels(budget)),
        charge_(budget,
                band_pixels_ * per_pixel_ * kSampleBytes,
                "the rays of a picture"),
        section_charge_(budget, "the cells seen in a picture"),
        surfaces_(view, budget, budget.FreeBytes() / 16),
        seen_(sizeof(Seen)),
        points_(sizeof(SeenPoint)),
        values_(sizeof(Value)) {}

  Picture Render() {
    ForEachBand(
        0, 0.5, [&](uint64_t first, size_t count) { See(first, count); });
    ShadeSections();
    Picture picture(options_.width, options_.height);
    ForEachBand(0.9, 1, [&](uint64_t first, size_t count) {
      picture.SetPixels(first, Shade(first, count));
    });
    return picture;
  }

 private:
  [[nodiscard]] size_t BandPixels(const MemoryBudget& budget) const {
    const size_t samples =
        std::clamp(static_cast<size_t>(budget.FreeBytes() / 6 / kSampleBytes),
                   kLeastSamples,
                   kMostSamples);
    return std::clamp<size_t>(samples / per_pixel_, 1, pixels_);
  }

  template <typename Body>
  void ForEachBand(double begin, double end, const Body& body) const {
    for (uint64_t first = 0; first < pixels_; first += band_pixels_) {
      body(first, std::min<uint64_t>(band_pixels_, pixels_ - first));
      Report(begin + (end - begin) * static_cast<double>(first) /
                         static_cast<double>(pixels_));
    }
  }

  void Report(double done) const {
    if (options_.progress) {
      options_.progress(done);
    }
  }

  // The ray of sample `k` of a pixel, through the middle of the sample's part
  // of the pixel.
  [[nodiscard]] TraceRay Ray(uint64_t pixel, uint32_t k) const {
    const uint64_t row = pixel / options_.width;
    const uint64_t column = pixel % options_.width;
    const uint32_t n = options_.samples;
    const uint32_t column_in_pixel = k % n;
    const uint32_t row_in_pixel = k / n;
    const double right = (column_in_pixel + 0.5) / n;
    const double down = (row_in_pixel + 0.5) / n;
    const double x =
        2 * (static_cast<double>(column) + right) / options_.width - 1;
    const double y =
        1 - 2 * (static_cast<double>(row) + down) / options_.height;
    TraceRay ray;
    ray.origin = camera_.origin + camera_.origin_x * x + camera_.origin_y * y;
    ray.direction =
        camera_.direction + camera_.direction_x * x + camera_.direction_y * y;
    return ray;
  }

  // Traces the samples of some pixels and stores what they see.
  void See(uint64_t first_pixel, size_t pixels) {
    std::vector<TraceRay> rays;
    rays.reserve(pixels * per_pixel_);
    for (uint64_t pixel = first_pixel; pixel < first_pixel + pixels; ++pixel) {
      for (uint32_t k = 0; k < per_pixel_; ++k) {
        rays.push_back(Ray(pixel, k));
      }
    }
    std::vector<TraceHit> hits(rays.size());
    view_.trace(rays, hits);
    std::vector<Surface> surfaces(rays.size());
    surfaces_.Read(rays, hits, surfaces);
    std::vector<Seen> seen(rays.size());
    std::vector<uint32_t> fronts;
    for (uint32_t i = 0; i < rays.size(); ++i) {
      if (hits[i].hit) {
        seen[i] = surfaces[i].front ? Seen::kFront : Seen::kBack;
      }
      if (seen[i] == Seen::kFront) {
        fronts.push_back(i);
      }
    }
    const uint64_t first = first_pixel * per_pixel_;
    seen_.Write(first, std::as_bytes(std::span(seen)));
    std::stable_sort(fronts.begin(), fronts.end(), [&](uint32_t i, uint32_t j) {
      return std::tie(hits[i].cell, hits[i].patch) <
             std::tie(hits[j].cell, hits[j].patch);
    });
    KeepSections(first, fronts, hits);
  }

  // `fronts` are the samples of a band that see a front, cell by cell. `first`
  // is the index of the band's first sample in the picture.
  void KeepSections(uint64_t first,
                    std::span<const uint32_t> fronts,
                    std::span<const TraceHit> hits) {
    std::vector<SeenPoint> points;
    for (const uint32_t i : fronts) {
      const TraceHit& hit = hits[i];
      const uint64_t at = first + points.size();
      if (points.empty() || sections_.back().cell != hit.cell.value) {
        section_charge_.GrowTo(3 * sizeof(Section) * (sections_.size() + 1));
        sections_.push_back({hit.cell.value, at});
      }
      ++sections_.back().count;
      points.push_back({i,
                        hit.patch.value,
                        static_cast<float>(hit.a),
                        static_cast<float>(hit.b)});
    }
    points_.Write(first, std::as_bytes(std::span(points)));
  }

  // Evaluates the radiosity of all seen points, cell by cell.
  void ShadeSections() {
    std::sort(sections_.begin(),
              sections_.end(),
              [](const Section& a, const Section& b) {
                return std::tie(a.cell, a.first) < std::tie(b.cell, b.first);
              });
    for (size_t i = 0; i < sections_.size(); ++i) {
      ShadeSection(sections_[i]);
      Report(0.5 + 0.4 * static_cast<double>(i) /
                       static_cast<double>(sections_.size()));
    }
  }

  void ShadeSection(const Section& section) {
    std::vector<SeenPoint> seen(section.count);
    points_.Read(section.first, std::as_writable_bytes(std::span(seen)));
    std::vector<PatchPoint> points;
    points.reserve(seen.size());
    for (const SeenPoint& s : seen) {
      points.push_back({CellId(section.cell), PatchId(s.patch), s.a, s.b});
    }
    const std::vector<Rgb> radiosity = options_.smooth
                                           ? view_.display_radiosity(points)
                                           : view_.radiosity(points);
    std::vector<Value> values(radiosity.size());
    for (size_t i = 0; i < values.size(); ++i) {
      for (size_t c = 0; c < kRgbChannels; ++c) {
        values[i].at(c) = static_cast<float>(radiosity[i].at(c));
      }
    }
    values_.Write(section.first, std::as_bytes(std::span(values)));
  }

  [[nodiscard]] std::vector<Pixel> Shade(uint64_t first_pixel,
                                         size_t count) const {
    const uint64_t first = first_pixel * per_pixel_;
    std::vector<Seen> seen(count * per_pixel_);
    seen_.Read(first, std::as_writable_bytes(std::span(seen)));
    const auto fronts =
        static_cast<size_t>(std::count(seen.begin(), seen.end(), Seen::kFront));
    std::vector<SeenPoint> points(fronts);
    points_.Read(first, std::as_writable_bytes(std::span(points)));
    std::vector<Value> values(fronts);
    values_.Read(first, std::as_writable_bytes(std::span(values)));
    std::vector<Value> radiosity(seen.size());
    for (size_t i = 0; i < fronts; ++i) {
      radiosity[points[i].sample] = values[i];
    }
    std::vector<Pixel> pixels(count);
    for (size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] =
          ShadePixel(std::span(seen).subspan(i * per_pixel_, per_pixel_),
                     std::span(radiosity).subspan(i * per_pixel_, per_pixel_));
    }
    return pixels;
  }

  static Pixel ShadePixel(std::span<const Seen> seen,
                          std::span<const Value> radiosity) {
    Rgb sum{};
    double fronts = 0;
    double backs = 0;
    for (size_t i = 0; i < seen.size(); ++i) {
      if (seen[i] == Seen::kFront) {
        for (size_t c = 0; c < kRgbChannels; ++c) {
          sum[c] += static_cast<double>(radiosity[i].at(c));
        }
        ++fronts;
      } else if (seen[i] == Seen::kBack) {
        ++backs;
      }
    }
    Pixel pixel;
    const auto count = static_cast<double>(seen.size());
    pixel.front = static_cast<float>(fronts / count);
    pixel.back = static_cast<float>(backs / count);
    for (size_t c = 0; c < kRgbChannels && fronts > 0; ++c) {
      pixel.radiosity[c] = static_cast<float>(sum[c] / fronts);
    }
    return pixel;
  }

  const BuildingView& view_;
  const Camera& camera_;
  const RenderOptions& options_;
  uint32_t per_pixel_;  // samples
  uint64_t pixels_;
  size_t band_pixels_;
  MemoryCharge charge_;
  GrowingCharge section_charge_;
  SurfaceReader surfaces_;
  std::vector<Section> sections_;
  Spool seen_;    // of every sample, pixel by pixel
  Spool points_;  // SeenPoint, band by band and within it section by section
  Spool values_;  // radiosity of points_
};

}  // namespace

Picture::Picture(uint32_t width, uint32_t height)
    : width_(width), height_(height), spool_(sizeof(Pixel)) {}

void Picture::SetPixels(uint64_t first, std::span<const Pixel> pixels) {
  spool_.Write(first, std::as_bytes(pixels));
}

std::vector<Pixel> Picture::Row(uint32_t row) const {
  std::vector<Pixel> pixels(width_);
  spool_.Read(static_cast<uint64_t>(row) * width_,
              std::as_writable_bytes(std::span(pixels)));
  return pixels;
}

Picture RenderPicture(const BuildingView& view,
                      const Camera& camera,
                      const RenderOptions& options,
                      MemoryBudget& budget) {
  return Renderer(view, camera, options, budget).Render();
}

}  // namespace enfilade
