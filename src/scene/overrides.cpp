#include "scene/overrides.h"

#include "base/error.h"
#include "scene/input_file.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fnmatch.h>
#include <nlohmann/json.hpp>

namespace enfilade {

// Walks the JSON of one override file. The line of a key is that of the next
// occurrence of its quoted text, because the walk follows the file's order.
class OverrideParser {
 public:
  OverrideParser(const std::string& text, const std::string& name)
      : text_(text), name_(name) {}

  Overrides Parse() {
    overrides_.file_ = name_;
    const Json root = Read();
    if (!root.is_object()) {
      Fail("the file must hold one JSON object");
    }
    for (const auto& [key, value] : root.items()) {
      Seek(key);
      ParseSection(key, value);
    }
    std::stable_sort(
        overrides_.rules_.begin(),
        overrides_.rules_.end(),
        [](const Rule& a, const Rule& b) { return a.section < b.section; });
    return std::move(overrides_);
  }

 private:
  using Json = nlohmann::ordered_json;
  using Rule = Overrides::Rule;
  using Section = Overrides::Section;

  Json Read() {
    try {
      return Json::parse(text_, [this](int depth, auto event, Json& parsed) {
        return Take(depth, event, parsed);
      });
    } catch (const nlohmann::json::parse_error& error) {
      at_ = std::min(error.byte - std::min<size_t>(error.byte, 1),
                     text_.size());  // at the last byte that was read
      Fail(fmt::format(
          "not valid JSON at column {}: {}", Column(), PlainWords(error)));
    } catch (const nlohmann::json::out_of_range& error) {
      const std::string_view number = QuotedIn(error.what());
      at_ = std::min(text_.find(number), text_.size());
      Fail(fmt::format("the number {} is too large", number));
    }
  }

  // The library's message without its tag, the position, and the text read
  // last, which may be the whole file.
  static std::string_view PlainWords(const std::exception& error) {
    constexpr std::string_view kBefore = " - ";
    std::string_view words = error.what();
    const size_t begin = words.find(kBefore);
    words.remove_prefix(begin == std::string_view::npos
                            ? words.find(' ') + 1  // after the tag, if any
                            : begin + kBefore.size());
    return words.substr(0, words.find("; last read"));
  }

  static std::string_view QuotedIn(std::string_view text) {
    const size_t begin = text.find('\'') + 1;
    return text.substr(begin, text.find('\'', begin) - begin);
  }

  // Rejects equal keys in one object, of which the library would silently keep
  // the last, and objects that are nested too deeply.
  bool Take(int depth, Json::parse_event_t event, const Json& parsed) {
    constexpr int kDeepest = 8;
    if (depth > kDeepest) {
      Fail("nested too deeply; docs/overrides.md shows what a file holds");
    }
    if (event == Json::parse_event_t::object_start) {
      keys_.resize(static_cast<size_t>(depth) + 1);
      keys_.back().clear();
    } else if (event == Json::parse_event_t::key) {
      const auto key = parsed.get<std::string>();
      if (!keys_[static_cast<size_t>(depth) - 1].insert(key).second) {
        at_ = std::min(text_.rfind(Json(key).dump()), text_.size());
        Fail(fmt::format("'{}' is there twice in one object; join the two",
                         key));
      }
    }
    return true;
  }

  void ParseSection(const std::string& key, const Json& value) {
    Section section{};
    if (key == "materials") {
      section = Section::kMaterials;
    } else if (key == "surfaces") {
      section = Section::kSurfaces;
    } else if (key == "objects") {
      section = Section::kObjects;
    } else {
      Fail(
          fmt::format("unknown section '{}'; known are materials, objects and "
                      "surfaces",
                      key));
    }
    if (!value.is_object()) {
      Fail(fmt::format("'{}' must be an object of glob: properties", key));
    }
    for (const auto& [glob, properties] : value.items()) {
      Seek(glob);
      ParseRule(section, glob, properties);
    }
  }

  void ParseRule(Section section,
                 const std::string& glob,
                 const Json& properties) {
    Rule rule;
    rule.section = section;
    rule.glob = glob;
    rule.line = Line();
    if (glob.find('\0') != std::string::npos) {
      Fail("a name has a zero character, which no name in a scene has");
    }
    if (!properties.is_object()) {
      Fail(fmt::format("'{}' must be an object of properties", glob));
    }
    for (const auto& [key, value] : properties.items()) {
      Seek(key);
      ParseProperty(key, value, rule);
    }
    overrides_.rules_.push_back(std::move(rule));
  }

  void ParseProperty(const std::string& key, const Json& value, Rule& rule) {
    if (key == "reflectance") {
      rule.reflectance = ParseRgb(key, value);
      if (MaxChannel(*rule.reflectance) >= 1) {
        Fail("a reflectance must be below 1");
      }
    } else if (key == "exitance") {
      rule.exitance = ParseRgb(key, value);
    } else if (key == "sides") {
      if (!value.is_number_integer() || (value != 1 && value != 2)) {
        Fail("'sides' must be 1 or 2");
      }
      rule.sides = value.get<int>();
    } else if (key == "clear") {
      if (!value.is_boolean()) {
        Fail("'clear' must be true or false");
      }
      rule.clear = value.get<bool>();
    } else {
      Fail(
          fmt::format("unknown property '{}'; known are reflectance, "
                      "exitance, sides and clear",
                      key));
    }
  }

  Rgb ParseRgb(const std::string& key, const Json& value) {
    Rgb rgb{};
    if (value.is_number()) {
      rgb.fill(value.get<double>());
    } else if (value.is_array() && value.size() == rgb.size() &&
               std::all_of(value.begin(), value.end(), [](const Json& v) {
                 return v.is_number();
               })) {
      for (size_t c = 0; c < rgb.size(); ++c) {
        rgb[c] = value[c].get<double>();
      }
    } else {
      Fail(fmt::format("'{}' must be a number or [r, g, b]", key));
    }
    for (const double c : rgb) {
      if (!std::isfinite(c) || c < 0) {
        Fail(fmt::format("'{}' must be finite and at least 0", key));
      }
    }
    return rgb;
  }

  void Seek(const std::string& key) {
    const size_t found = text_.find(Json(key).dump(), at_);
    if (found != std::string::npos) {
      at_ = found + 1;
    }
  }

  [[nodiscard]] size_t Line() const {
    const auto end = text_.begin() + static_cast<std::ptrdiff_t>(at_);
    return 1 + static_cast<size_t>(std::count(text_.begin(), end, '\n'));
  }

  [[nodiscard]] size_t Column() const {
    const size_t feed =
        at_ > 0 ? text_.rfind('\n', at_ - 1) : std::string::npos;
    return feed == std::string::npos ? at_ + 1 : at_ - feed;
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", name_, Line(), what));
  }

  const std::string& text_;
  const std::string& name_;
  size_t at_ = 0;
  std::vector<std::set<std::string>> keys_;  // by depth, of the open objects
  Overrides overrides_;
};

Overrides Overrides::Load(const std::filesystem::path& path) {
  constexpr uint64_t kMostBytes = 16ULL << 20;
  return Parse(ReadWholeFile(path, kMostBytes), path.string());
}

Overrides Overrides::Parse(const std::string& text, const std::string& name) {
  return OverrideParser(text, name).Parse();
}

std::vector<size_t> Overrides::Matching(std::string_view material,
                                        std::string_view object,
                                        std::string_view surface_type) const {
  if (rules_.empty()) {
    return {};
  }
  const std::string names[] = {
      std::string(material), std::string(surface_type), std::string(object)};
  std::vector<size_t> matching;
  for (size_t i = 0; i < rules_.size(); ++i) {
    const std::string& name = names[static_cast<size_t>(rules_[i].section)];
    if (!name.empty() &&
        fnmatch(rules_[i].glob.c_str(), name.c_str(), 0) == 0) {
      matching.push_back(i);
    }
  }
  return matching;
}

void Overrides::Apply(size_t rule, Material& material) const {
  const Rule& r = rules_[rule];
  material.reflectance = r.reflectance.value_or(material.reflectance);
  material.exitance = r.exitance.value_or(material.exitance);
  material.sides = r.sides.value_or(material.sides);
  material.clear = r.clear.value_or(material.clear);
}

bool Overrides::Describes(std::string_view material) const {
  bool reflects = false;
  bool clear = false;
  for (const size_t rule : Matching(material, "", "")) {
    reflects = reflects || rules_[rule].reflectance.has_value();
    clear = rules_[rule].clear.value_or(clear);
  }
  return reflects || clear;
}

std::string Overrides::Place(size_t rule) const {
  return fmt::format("{}:{}", file_, rules_[rule].line);
}

}  // namespace enfilade
