// Materials as the faces use them: those of the input, changed by the override
// file and the command line, and checked when a face first uses them.

#pragma once

#include "base/memory.h"
#include "scene/face.h"
#include "scene/overrides.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace enfilade {

// Not thread-safe.
class MaterialTable {
 public:
  // `sides` applies to every material whose sides no override sets.
  MaterialTable(Overrides overrides,
                std::optional<int> sides,
                MemoryBudget& budget);

  // What resolving a material takes, once.
  static uint64_t BytesToResolve(const Material& material);

  // Charges what the caller is about to add, BytesToResolve included, as long
  // as the table lives. `share`: of all that will be charged so, about. Throws
  // DoesNotFitError.
  void Charge(uint64_t bytes, double share);

  // A material of the input; `place` (file and line) goes into errors about
  // it, and `is_assumed` says that its reflectance is a guess. Returns its
  // index for Resolve.
  size_t AddInput(Material material,
                  std::string place,
                  bool is_assumed = false);

  // Whether the override file says what a material of this name is, so that the
  // input need not.
  [[nodiscard]] bool IsDescribed(std::string_view name) const {
    return overrides_.Describes(name);
  }

  // The material of a face with this input material, object and surface type
  // (empty if the format has none). Nullopt if the material is clear: the face
  // is then ignored.
  std::optional<MaterialId> Resolve(size_t input,
                                    std::string_view object,
                                    std::string_view surface_type);

  // Throws InputError if a material in use has a reflectance or exitance out
  // of range; the message names the place of each and a correction.
  void ThrowIfRefused() const;

  // A sentence for each rule of the override file that matches no face.
  [[nodiscard]] std::vector<std::string> NotesOnUnusedRules() const;

  // A sentence on the materials of faces whose reflectance is a guess; empty if
  // there are none.
  [[nodiscard]] std::string NoteOnAssumed() const;

  [[nodiscard]] const std::vector<Material>& Materials() const {
    return materials_;
  }

  // Appends a finished material.
  MaterialId Append(Material material);

 private:
  struct InputMaterial {
    Material material;
    std::string place;
    bool is_assumed = false;
  };

  std::optional<MaterialId> Make(size_t input,
                                 const std::vector<size_t>& rules);

  Overrides overrides_;
  std::optional<int> sides_;
  GrowingCharge charge_;
  uint64_t bytes_ = 0;  // charged
  std::vector<InputMaterial> inputs_;
  std::vector<Material> materials_;
  std::vector<InputMaterial> refused_;
  // The materials made so far, by input material and matching override rules.
  std::map<std::pair<size_t, std::vector<size_t>>, std::optional<MaterialId>>
      resolved_;
};

}  // namespace enfilade
