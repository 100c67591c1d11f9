#include "scene/material_table.h"

#include "base/error.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

// The highest reflectance that a message suggests: that of fresh white paint.
constexpr double kSuggestedMost = 0.9;
// The range of a nonzero exitance, W/m2 or lm/m2; the sun has 6e7. Outside this
// range sums of squares in single precision overflow or vanish.
constexpr double kBrightest = 1e15;
constexpr double kDarkest = 1e-15;

bool AllIn(const Rgb& channels, double end) {
  return std::all_of(channels.begin(), channels.end(), [&](double c) {
    return c >= 0 && c < end;
  });
}

bool IsPhysical(const Material& m) {
  return AllIn(m.reflectance, 1) &&
         std::all_of(m.exitance.begin(), m.exitance.end(), [](double e) {
           return e == 0 || (e >= kDarkest && e <= kBrightest);
         });
}

std::string Channels(const Rgb& c) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", c[0], c[1], c[2]);
}

// A sentence that says what is wrong with the material.
std::string Complaint(const Material& m, const std::string& place) {
  return AllIn(m.reflectance, 1)
             ? fmt::format(
                   "{}: material '{}' has exitance {}; it must be 0, or "
                   "between 1e-15 and 1e15",
                   place,
                   m.name,
                   Channels(m.exitance))
             : fmt::format(
                   "{}: material '{}' has reflectance {}, which is "
                   "not in [0, 1)",
                   place,
                   m.name,
                   Channels(m.reflectance));
}

// The JSON string of a glob that matches this name alone.
std::string KeyOf(const std::string& name) {
  std::string pattern;
  for (const char c : name) {
    if (std::string_view("*?[\\").find(c) != std::string_view::npos) {
      pattern += '\\';
    }
    pattern += c;
  }
  return nlohmann::json(pattern).dump(
      -1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// An entry of the override file that corrects the material.
std::string Mend(const Material& m) {
  Rgb mended{};
  for (size_t c = 0; c < mended.size(); ++c) {
    mended[c] =
        m.reflectance[c] >= 0 ? std::min(m.reflectance[c], kSuggestedMost) : 0;
  }
  return AllIn(m.reflectance, 1)
             ? fmt::format("{}: {{\"exitance\": 0}}", KeyOf(m.name))
             : fmt::format("{}: {{\"reflectance\": {}}}",
                           KeyOf(m.name),
                           Channels(mended));
}

}  // namespace

MaterialTable::MaterialTable(Overrides overrides,
                             std::optional<int> sides,
                             MemoryBudget& budget)
    : overrides_(std::move(overrides)),
      sides_(sides),
      charge_(budget, "the materials of the scene") {}

uint64_t MaterialTable::BytesToResolve(const Material& material) {
  // The entry in the map, the material in a growing vector, its copy in the
  // SceneInfo, and what of it is on its way into the store.
  constexpr uint64_t kBytesPerEntry = 112;
  constexpr uint64_t kMaterials = 3;
  constexpr uint64_t kNames = 3;
  return kBytesPerEntry + kMaterials * sizeof(Material) +
         kNames * AllocatedBytes(material.name.size() + 1);
}

void MaterialTable::Charge(uint64_t bytes, double share) {
  bytes_ += bytes;
  charge_.GrowTo(bytes_, share);
}

size_t MaterialTable::AddInput(Material material,
                               std::string place,
                               bool is_assumed) {
  inputs_.push_back({std::move(material), std::move(place), is_assumed});
  return inputs_.size() - 1;
}

std::optional<MaterialId> MaterialTable::Resolve(
    size_t input, std::string_view object, std::string_view surface_type) {
  const std::vector<size_t> rules =
      overrides_.Matching(inputs_[input].material.name, object, surface_type);
  const auto key = std::pair(input, rules);
  const auto known = resolved_.find(key);
  if (known != resolved_.end()) {
    return known->second;
  }
  if (resolved_.size() >= inputs_.size()) {  // some are several materials
    Charge(BytesToResolve(inputs_[input].material), 1);
  }
  const std::optional<MaterialId> made = Make(input, rules);
  resolved_.emplace(key, made);
  return made;
}

std::optional<MaterialId> MaterialTable::Make(
    size_t input, const std::vector<size_t>& rules) {
  Material material = inputs_[input].material;
  if (sides_) {
    material.sides = *sides_;
  }
  std::string place = inputs_[input].place;
  std::string objects;  // of the last rule that goes by them
  for (const size_t rule : rules) {
    overrides_.Apply(rule, material);
    place = overrides_.Place(rule);
    if (overrides_.IsByObject(rule)) {
      objects = overrides_.Glob(rule);
    }
  }
  if (material.clear) {
    return std::nullopt;
  }
  if (!IsPhysical(material)) {
    refused_.push_back({material, place, false});
  }
  if (!objects.empty()) {
    material.name = fmt::format("{} of {}", material.name, objects);
  }
  return Append(std::move(material));
}

std::vector<std::string> MaterialTable::NotesOnUnusedRules() const {
  std::vector<bool> used(overrides_.RuleCount());
  for (const auto& [key, material] : resolved_) {
    for (const size_t rule : key.second) {
      used[rule] = true;
    }
  }
  std::vector<std::string> notes;
  for (size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) {
      notes.push_back(fmt::format("{}: '{}' matches nothing in the scene",
                                  overrides_.Place(i),
                                  overrides_.Glob(i)));
    }
  }
  return notes;
}

std::string MaterialTable::NoteOnAssumed() const {
  std::vector<size_t> assumed;  // in the order of the input
  for (const auto& [key, material] : resolved_) {
    const auto& [input, rules] = key;
    const bool is_told =
        std::any_of(rules.begin(), rules.end(), [this](size_t rule) {
          return overrides_.SetsReflectance(rule);
        });
    if (inputs_[input].is_assumed && material && !is_told &&
        (assumed.empty() || assumed.back() != input)) {
      assumed.push_back(input);
    }
  }
  return assumed.empty()
             ? std::string()
             : fmt::format(
                   "{} materials give no Kd (first: {}): taken as 0.5; set "
                   "them with --overrides",
                   assumed.size(),
                   inputs_[assumed.front()].material.name);
}

void MaterialTable::ThrowIfRefused() const {
  if (refused_.empty()) {
    return;
  }
  std::string complaints;
  std::string mends;
  for (const InputMaterial& m : refused_) {
    complaints += Complaint(m.material, m.place) + "\n";
    mends += (mends.empty() ? "" : ", ") + Mend(m.material);
  }
  throw InputError(
      fmt::format("{}Change it there, or with --overrides FILE.json holding "
                  "{{\"materials\": {{{}}}}}",
                  complaints,
                  mends));
}

MaterialId MaterialTable::Append(Material material) {
  materials_.push_back(std::move(material));
  return MaterialId(materials_.size() - 1);
}

}  // namespace enfilade
