#include "base/error.h"

#include <array>
#include <csetjmp>
#include <string_view>
#include <vector>

#include "tools/export/file.h"
#include "tools/export/image.h"
#include "tools/export/render_tone.h"
#include <fmt/format.h>
#include <png.h>

namespace enfilade {
namespace {

constexpr double kCutLuminance = 0.03;  // of solid that a plan cuts open

ToneMap Expose(const Picture& picture, double stops) {
  ExposureMeter meter;
  for (uint32_t row = 0; row < picture.Height(); ++row) {
    for (const Pixel& p : picture.Row(row)) {
      meter.Add({p.radiosity[0], p.radiosity[1], p.radiosity[2]}, p.front);
    }
  }
  return {meter.Key(), stops};
}

std::vector<uint8_t> EncodeRow(const std::vector<Pixel>& pixels,
                               const ToneMap& tone,
                               double background) {
  std::vector<uint8_t> bytes;
  bytes.reserve(pixels.size() * 3);
  for (const Pixel& p : pixels) {
    const Rgb color =
        tone.Linear({p.radiosity[0], p.radiosity[1], p.radiosity[2]});
    const double nothing = 1.0 - p.front - p.back;
    for (const double channel : color) {
      bytes.push_back(EncodeSrgb(channel * p.front + kCutLuminance * p.back +
                                 background * nothing));
    }
  }
  return bytes;
}

// libpng's callbacks: errors are kept and thrown later, because no exception
// may pass through C.
struct PngSink {
  SectionWriter* out = nullptr;
  std::exception_ptr failure;      // of the file
  std::array<char, 128> why = {};  // of libpng itself
};

void PutPngBytes(png_structp png, png_bytep data, size_t size) {
  auto* sink = static_cast<PngSink*>(png_get_io_ptr(png));
  try {
    sink->out->PutBytes(std::as_bytes(std::span(data, size)));
  } catch (...) {
    sink->failure = std::current_exception();
  }
  if (sink->failure) {
    png_error(png, "write failed");
  }
}

void FlushPng(png_structp /*png*/) {}

// Replaces libpng's own error handler, which prints.
[[noreturn]] void GiveUpPng(png_structp png, png_const_charp why) {
  auto& kept = static_cast<PngSink*>(png_get_error_ptr(png))->why;
  const std::string_view text(why);
  text.copy(kept.data(), kept.size() - 1);
  png_longjmp(png, 1);
}

void IgnorePngWarning(png_structp /*png*/, png_const_charp /*what*/) {}

// An encoder that owns libpng's structures. Each member returns false when
// libpng has given up; C++ objects with destructors must not be created between
// setjmp and the calls it guards.
class PngEncoder {
 public:
  explicit PngEncoder(PngSink& sink)
      : png_(png_create_write_struct(
            PNG_LIBPNG_VER_STRING, &sink, GiveUpPng, IgnorePngWarning)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr),
        sink_(&sink) {}

  ~PngEncoder() { png_destroy_write_struct(&png_, &info_); }

  PngEncoder(const PngEncoder&) = delete;
  PngEncoder& operator=(const PngEncoder&) = delete;

  bool Begin(uint32_t width, uint32_t height) {
    if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) {  // NOLINT
      return false;
    }
    png_set_write_fn(png_, sink_, PutPngBytes, FlushPng);
    png_set_IHDR(png_,
                 info_,
                 width,
                 height,
                 8,
                 PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(png_, info_, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png_, info_);
    return true;
  }

  bool Row(const uint8_t* bytes) {
    if (setjmp(png_jmpbuf(png_)) != 0) {  // NOLINT
      return false;
    }
    png_write_row(png_, bytes);
    return true;
  }

  bool End() {
    if (setjmp(png_jmpbuf(png_)) != 0) {  // NOLINT
      return false;
    }
    png_write_end(png_, info_);
    return true;
  }

 private:
  png_structp png_;
  png_infop info_;
  PngSink* sink_;
};

void RequirePng(bool done, const PngSink& sink) {
  if (sink.failure) {
    std::rethrow_exception(sink.failure);
  }
  if (!done) {
    throw DiskError(
        fmt::format("libpng cannot write the picture: {}", sink.why.data()));
  }
}

}  // namespace

uint64_t WritePng(const Picture& picture,
                  const ImageOptions& options,
                  const std::filesystem::path& out) {
  const ToneMap tone = Expose(picture, options.exposure_stops);
  OutputFile file(out);
  SectionWriter writer(file, 0);
  PngSink sink{&writer, nullptr, {}};
  PngEncoder encoder(sink);
  RequirePng(encoder.Begin(picture.Width(), picture.Height()), sink);
  for (uint32_t row = 0; row < picture.Height(); ++row) {
    const std::vector<uint8_t> bytes =
        EncodeRow(picture.Row(row), tone, options.white_background ? 1.0 : 0.0);
    RequirePng(encoder.Row(bytes.data()), sink);
  }
  RequirePng(encoder.End(), sink);
  writer.Flush();
  file.Finish();
  return file.Size();
}

}  // namespace enfilade
