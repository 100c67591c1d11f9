// OpenEXR, scan lines of 32-bit floats, without compression. The layout is the
// simplest that the format has, so it is written here rather than through a
// library that holds thread pools and caches of its own ("OpenEXR File
// Layout", openexr.com).

#include <array>
#include <string_view>
#include <vector>

#include "tools/export/file.h"
#include "tools/export/image.h"

namespace enfilade {
namespace {

constexpr uint32_t kMagic = 20000630;
constexpr uint32_t kVersion = 2;
constexpr uint32_t kFloatPixels = 2;
constexpr size_t kChannels = 4;

class ExrHeader {
 public:
  explicit ExrHeader(SectionWriter& out) : out_(out) {
    out_.Put(kMagic);
    out_.Put(kVersion);
  }

  void String(std::string_view text) {
    out_.PutText(text);
    out_.Put(uint8_t{0});
  }

  void Attribute(std::string_view name, std::string_view type, uint32_t size) {
    String(name);
    String(type);
    out_.Put(size);
  }

  // Lists the channels in the order of their names, as the pixels have them.
  void Channels() {
    constexpr uint32_t kEntryBytes = 2 + 16;
    Attribute("channels", "chlist", kChannels * kEntryBytes + 1);
    for (const char* name : {"A", "B", "G", "R"}) {
      String(name);
      out_.Put(kFloatPixels);
      out_.Put(uint32_t{0});  // not perceptually linear; reserved
      out_.Put(std::array<uint32_t, 2>{1, 1});
    }
    out_.Put(uint8_t{0});
  }

  void Window(std::string_view name, uint32_t width, uint32_t height) {
    Attribute(name, "box2i", 16);
    out_.Put(std::array<uint32_t, 4>{0, 0, width - 1, height - 1});
  }

 private:
  SectionWriter& out_;
};

void PutHeader(SectionWriter& out, uint32_t width, uint32_t height) {
  ExrHeader header(out);
  header.Channels();
  header.Attribute("compression", "compression", 1);
  out.Put(uint8_t{0});  // none
  header.Window("dataWindow", width, height);
  header.Window("displayWindow", width, height);
  header.Attribute("lineOrder", "lineOrder", 1);
  out.Put(uint8_t{0});  // increasing
  header.Attribute("pixelAspectRatio", "float", 4);
  out.Put(1.0F);
  header.Attribute("screenWindowCenter", "v2f", 8);
  out.Put(std::array<float, 2>{0, 0});
  header.Attribute("screenWindowWidth", "float", 4);
  out.Put(1.0F);
  out.Put(uint8_t{0});  // end of the header
}

// Radiosity times coverage: colours are premultiplied, as the format has it.
float Channel(const Pixel& p, size_t channel) {
  return channel == 0 ? p.front : p.radiosity[3 - channel] * p.front;
}

}  // namespace

uint64_t WriteExr(const Picture& picture, const std::filesystem::path& out) {
  OutputFile file(out);
  SectionWriter writer(file, 0);
  const uint32_t width = picture.Width();
  const uint32_t height = picture.Height();
  PutHeader(writer, width, height);
  const uint64_t row_bytes = sizeof(float) * kChannels * width;
  constexpr uint64_t kRowHeaderBytes = 8;
  const uint64_t first_row = writer.Position() + 8ULL * height;
  for (uint32_t row = 0; row < height; ++row) {
    writer.Put(first_row + row * (kRowHeaderBytes + row_bytes));
  }
  for (uint32_t row = 0; row < height; ++row) {
    writer.Put(row);
    writer.Put(static_cast<uint32_t>(row_bytes));
    const std::vector<Pixel> pixels = picture.Row(row);
    for (size_t channel = 0; channel < kChannels; ++channel) {
      for (const Pixel& p : pixels) {
        writer.Put(Channel(p, channel));
      }
    }
  }
  writer.Flush();
  file.Finish();
  return file.Size();
}

}  // namespace enfilade
