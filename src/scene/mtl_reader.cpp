#define TINYOBJLOADER_USE_DOUBLE
#include "scene/mtl_reader.h"

#include "base/check.h"
#include "base/error.h"
#include "scene/input_file.h"
#include "scene/number_text.h"

#include <istream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tiny_obj_loader.h>

namespace enfilade {
namespace {

constexpr double kLeastOpacity = 0.5;

Rgb ColourOf(std::optional<double> grey, const tinyobj::real_t (&c)[3]) {
  return grey ? Rgb{*grey, *grey, *grey} : Rgb{c[0], c[1], c[2]};
}

// Reads one material at a time: the library takes kilobytes of memory for each,
// of which light needs a few words.
class MtlReading {
 public:
  MtlReading(const InputFile& file, const MaterialTaker& take)
      : file_(&file), take_(&take) {}

  // Takes the next line of the file, and checks the numbers in it.
  void Read(std::string_view line, uint64_t number) {
    const std::vector<std::string_view> words = Words(line);
    if (words.empty()) {
      return;
    }
    if (words[0] == "newmtl") {
      Finish();
      StartMaterial(line, number);
    } else if (words[0] == "Kd" || words[0] == "Ke") {
      ReadColour(words, number);
      Keep(words[0], line);
    } else if (words[0] == "d" || words[0] == "Tr") {
      ReadOpacity(words, number);
      Keep(words[0], line);
    } else if (words[0] == "sides") {
      ReadSides(words, number);
    }
  }

  // Ends a material. Lines before the first newmtl belong to no material.
  void Finish() {
    if (name_.empty()) {
      return;
    }
    const tinyobj::material_t read = Parse();
    MtlMaterial material;
    material.material.name = std::exchange(name_, {});
    material.material.reflectance = ColourOf(grey_reflectance_, read.diffuse);
    material.material.exitance = ColourOf(grey_exitance_, read.emission);
    material.material.clear =
        halo_opacity_.value_or(read.dissolve) < kLeastOpacity;
    material.material.sides = sides_;
    material.place = fmt::format("{}:{}", Name(), place_);
    material.is_assumed =
        kept_.find("Kd") == kept_.end() && !Emits(material.material);
    if (material.is_assumed) {
      material.material.reflectance.fill(kAssumedReflectance);
    }
    (*take_)(std::move(material), file_->Fraction());
  }

 private:
  [[nodiscard]] std::string Name() const { return file_->Path().string(); }

  // The name is the rest of the line, since it may hold blanks.
  void StartMaterial(std::string_view line, uint64_t number) {
    constexpr std::string_view kKey = "newmtl";
    const size_t end = line.find(kKey) + kKey.size();
    if (end == line.size()) {
      throw InputError(
          fmt::format("{}:{}: '{}' without a name: give the material one",
                      Name(),
                      number,
                      kKey));
    }
    name_ = line.substr(line.find_first_not_of(" \t", end));
    place_ = number;
    kept_.clear();
    grey_reflectance_.reset();
    grey_exitance_.reset();
    halo_opacity_.reset();
    sides_ = Material{}.sides;
  }

  void ReadColour(const std::vector<std::string_view>& words, uint64_t number) {
    CheckNumbers(words, 1, number);
    if (words.size() == 3) {
      throw InputError(
          fmt::format("{}:{}: '{}' of material '{}' has two values: give one "
                      "or three",
                      Name(),
                      number,
                      words[0],
                      name_));
    }
    const bool is_reflectance = words[0] == "Kd";
    (is_reflectance ? grey_reflectance_ : grey_exitance_) =
        words.size() == 2 ? ToNumber(words[1]) : std::nullopt;
    if (is_reflectance) {
      place_ = number;
    }
  }

  void ReadOpacity(const std::vector<std::string_view>& words,
                   uint64_t number) {
    const bool has_option = words.size() > 1 && words[1] == "-halo";
    const size_t first = has_option ? 2 : 1;
    CheckNumbers(words, first, number);
    if (*ToNumber(words[first]) < 0) {
      throw InputError(fmt::format("{}:{}: '{}' of material '{}' is below 0",
                                   Name(),
                                   number,
                                   words[0],
                                   name_));
    }
    if (has_option || words[0] == "d") {  // d takes precedence over Tr
      halo_opacity_ = has_option ? ToNumber(words[first]) : std::nullopt;
    }
  }

  // Not a key of the format, but of `enfilade scene`.
  void ReadSides(const std::vector<std::string_view>& words, uint64_t number) {
    if (words.size() != 2 || (words[1] != "1" && words[1] != "2")) {
      throw InputError(
          fmt::format("{}:{}: 'sides' of material '{}' is not 1 "
                      "(the back is black) or 2",
                      Name(),
                      number,
                      name_));
    }
    sides_ = words[1] == "1" ? 1 : 2;
  }

  // Keeps the last line of each key, which is the one that counts.
  void Keep(std::string_view key, std::string_view line) {
    kept_[std::string(key)] = line;
  }

  // Parses the material's kept lines with the library.
  [[nodiscard]] tinyobj::material_t Parse() const {
    std::string text = "newmtl m\n";
    for (const auto& [key, line] : kept_) {
      text.append(line).append("\n");
    }
    std::istringstream lines(text);
    std::map<std::string, int> index_by_name;
    std::vector<tinyobj::material_t> read;
    std::string warnings;
    std::string errors;
    tinyobj::LoadMtl(&index_by_name, &read, &lines, &warnings, &errors);
    if (!errors.empty()) {
      throw InputError(fmt::format("{}:{}: {}", Name(), place_, errors));
    }
    ENFILADE_CHECK(!read.empty(), "no material was read of '{}'", text);
    return std::move(read.back());
  }

  void CheckNumbers(const std::vector<std::string_view>& words,
                    size_t first,
                    uint64_t line) const {
    for (size_t i = first; i < words.size(); ++i) {
      if (!IsNumber(words[i])) {
        throw InputError(
            fmt::format("{}:{}: '{}' of material '{}' is not a "
                        "finite number: give '{}' numbers only",
                        Name(),
                        line,
                        words[i],
                        name_,
                        words[0]));
      }
    }
    if (words.size() <= first) {
      throw InputError(fmt::format("{}:{}: '{}' of material '{}' has no value",
                                   Name(),
                                   line,
                                   words[0],
                                   name_));
    }
  }

  const InputFile* file_;
  const MaterialTaker* take_;
  std::string name_;    // empty before the first material
  uint64_t place_ = 0;  // the line of its colour
  std::map<std::string, std::string> kept_;
  // Values that the library reads differently from what the format says.
  std::optional<double> grey_reflectance_;  // a colour of one value is grey
  std::optional<double> grey_exitance_;
  std::optional<double> halo_opacity_;  // of `d -halo`
  int sides_ = Material{}.sides;
};

}  // namespace

void ReadMtl(const std::filesystem::path& path, const MaterialTaker& take) {
  InputFile file(path);
  MtlReading reading(file, take);
  LineStream* stream_at = nullptr;
  LineStream lines(file, [&](std::string_view line) {
    reading.Read(line, stream_at->Line());
  });
  stream_at = &lines;
  std::istream stream(&lines);
  stream.exceptions(std::ios::badbit);  // lets exceptions of Read through
  stream.ignore(std::numeric_limits<std::streamsize>::max());
  reading.Finish();
}

}  // namespace enfilade
