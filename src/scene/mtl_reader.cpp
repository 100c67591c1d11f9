#define TINYOBJLOADER_USE_DOUBLE
#include "scene/mtl_reader.h"

#include "base/error.h"
#include "scene/input_file.h"
#include "scene/number_text.h"

#include <algorithm>
#include <istream>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <tiny_obj_loader.h>

namespace enfilade {
namespace {

constexpr double kLeastOpacity = 0.5;

Rgb ColourOf(std::optional<double> grey, const tinyobj::real_t (&c)[3]) {
  return grey ? Rgb{*grey, *grey, *grey} : Rgb{c[0], c[1], c[2]};
}

// What the library reads otherwise than the format has it.
struct MtlValues {
  std::optional<double> grey_reflectance;  // a colour of one value is grey
  std::optional<double> grey_exitance;
  std::optional<double> halo_opacity;  // of `d -halo`
};

// Lines as they pass: where each material's colour stands, and whether what
// should be numbers are.
class MtlChecker {
 public:
  explicit MtlChecker(std::string file) : file_(std::move(file)) {}

  void Check(std::string_view line, uint64_t number) {
    const std::vector<std::string_view> words = Words(line);
    if (words.empty()) {
      return;
    }
    if (words[0] == "newmtl") {
      StartMaterial(line, number);
    } else if (words[0] == "Kd" || words[0] == "Ke") {
      CheckNumbers(words, 1, number);
      if (words.size() == 3) {
        throw InputError(
            fmt::format("{}:{}: '{}' of material '{}' has two values: give one "
                        "or three",
                        file_,
                        number,
                        words[0],
                        name_));
      }
      const bool is_reflectance = words[0] == "Kd";
      MtlValues& values = values_[name_];
      (is_reflectance ? values.grey_reflectance : values.grey_exitance) =
          words.size() == 2 ? ToNumber(words[1]) : std::nullopt;
      if (is_reflectance) {
        lines_[name_] = number;
      }
    } else if (words[0] == "d" || words[0] == "Tr") {
      const bool has_option = words.size() > 1 && words[1] == "-halo";
      const size_t first = has_option ? 2 : 1;
      CheckNumbers(words, first, number);
      if (*ToNumber(words[first]) < 0) {
        throw InputError(fmt::format("{}:{}: '{}' of material '{}' is below 0",
                                     file_,
                                     number,
                                     words[0],
                                     name_));
      }
      if (has_option || words[0] == "d") {  // a Tr leaves it: d wins
        values_[name_].halo_opacity =
            has_option ? ToNumber(words[first]) : std::nullopt;
      }
    }
  }

  [[nodiscard]] MtlValues ValuesOf(const std::string& material) const {
    const auto it = values_.find(material);
    return it == values_.end() ? MtlValues{} : it->second;
  }

  [[nodiscard]] std::string Place(const std::string& material) const {
    const auto it = lines_.find(material);
    return it == lines_.end() ? file_ : fmt::format("{}:{}", file_, it->second);
  }

 private:
  // As the library has it, the name is all that follows one blank: it may hold
  // others.
  void StartMaterial(std::string_view line, uint64_t number) {
    constexpr std::string_view kKey = "newmtl";
    const size_t end = line.find(kKey) + kKey.size();
    if (end == line.size()) {
      throw InputError(
          fmt::format("{}:{}: '{}' without a name: give the material one",
                      file_,
                      number,
                      kKey));
    }
    name_ = line.substr(end + 1);
    lines_[name_] = number;
    values_.erase(name_);
  }

  void CheckNumbers(const std::vector<std::string_view>& words,
                    size_t first,
                    uint64_t line) const {
    for (size_t i = first; i < words.size(); ++i) {
      if (!IsNumber(words[i])) {
        throw InputError(
            fmt::format("{}:{}: '{}' of material '{}' is not a "
                        "finite number: give '{}' numbers only",
                        file_,
                        line,
                        words[i],
                        name_,
                        words[0]));
      }
    }
    if (words.size() <= first) {
      throw InputError(fmt::format("{}:{}: '{}' of material '{}' has no value",
                                   file_,
                                   line,
                                   words[0],
                                   name_));
    }
  }

  std::string file_;
  std::string name_;
  std::map<std::string, uint64_t> lines_;
  std::map<std::string, MtlValues> values_;
};

}  // namespace

std::vector<MtlMaterial> ReadMtl(const std::filesystem::path& path) {
  InputFile file(path);
  MtlChecker checker(path.string());
  LineStream* stream_at = nullptr;
  LineStream lines(file, [&](std::string_view line) {
    checker.Check(line, stream_at->Line());
  });
  stream_at = &lines;
  std::istream stream(&lines);
  stream.exceptions(std::ios::badbit);  // lets errors of the check through
  std::map<std::string, int> index_by_name;
  std::vector<tinyobj::material_t> read;
  std::string warnings;
  std::string errors;
  tinyobj::LoadMtl(&index_by_name, &read, &stream, &warnings, &errors);
  if (!errors.empty()) {
    throw InputError(fmt::format("{}: {}", path.string(), errors));
  }
  std::vector<MtlMaterial> materials;
  for (const tinyobj::material_t& m : read) {
    if (m.name.empty()) {
      continue;  // what stands before the first newmtl
    }
    MtlMaterial material;
    material.material.name = m.name;
    const MtlValues values = checker.ValuesOf(m.name);
    material.material.reflectance =
        ColourOf(values.grey_reflectance, m.diffuse);
    material.material.exitance = ColourOf(values.grey_exitance, m.emission);
    material.material.clear =
        values.halo_opacity.value_or(m.dissolve) < kLeastOpacity;
    material.place = checker.Place(m.name);
    materials.push_back(std::move(material));
  }
  return materials;
}

}  // namespace enfilade
