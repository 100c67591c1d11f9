// The override file sets properties of materials by globs that match the name
// of a material, an object or a surface type. Format: docs/overrides.md.

#pragma once

#include "scene/face.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade {

class Overrides {
 public:
  // Overrides nothing.
  Overrides() = default;

  // Throws InputError with file and line for bad JSON, unknown keys, wrong
  // types and values out of range.
  static Overrides Load(const std::filesystem::path& path);

  // Reads the text of an override file; `name` is for error messages.
  static Overrides Parse(const std::string& text, const std::string& name);

  // The rules that match a face, in the order in which they apply: the sections
  // materials, surfaces, objects, and within a section the order of the file.
  // The last rule wins. An empty name matches no rule.
  [[nodiscard]] std::vector<size_t> Matching(
      std::string_view material,
      std::string_view object,
      std::string_view surface_type) const;

  void Apply(size_t rule, Material& material) const;

  // Whether rules for materials say how a material of this name reflects, or
  // that it is clear.
  [[nodiscard]] bool Describes(std::string_view material) const;

  [[nodiscard]] size_t RuleCount() const { return rules_.size(); }

  [[nodiscard]] const std::string& Glob(size_t rule) const {
    return rules_[rule].glob;
  }

  // File and line, for messages.
  [[nodiscard]] std::string Place(size_t rule) const;

  [[nodiscard]] bool SetsReflectance(size_t rule) const {
    return rules_[rule].reflectance.has_value();
  }

  [[nodiscard]] bool IsByObject(size_t rule) const {
    return rules_[rule].section == Section::kObjects;
  }

 private:
  friend class OverrideParser;

  enum class Section { kMaterials, kSurfaces, kObjects };

  struct Rule {
    Section section{};
    std::string glob;
    size_t line = 0;
    std::optional<Rgb> reflectance;
    std::optional<Rgb> exitance;
    std::optional<int> sides;
    std::optional<bool> clear;
  };

  std::string file_;
  std::vector<Rule> rules_;  // sorted by section, then as in the file
};

}  // namespace enfilade
