// The real buildings that tests run on where their folder exists.

#pragma once

#include "base/memory.h"
#include "scene/import.h"
#include "store/sqlite_store.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "tests/data_folder.h"
#include "tests/temporary_folder.h"
#include <gtest/gtest.h>

namespace enfilade::testing {

// An imported building. The partition ignores light, so everything emits.
struct Building {
  std::unique_ptr<BlockStorage> store = CreateStoreInMemory();
  SceneInfo info;
};

inline Building Import(const std::string& name,
                       MemoryBudget& budget,
                       bool strip_spaces = false) {
  const TemporaryFolder folder;
  const std::string overrides = folder / "overrides.json";
  std::ofstream(overrides)
      << R"({"materials": {"*": {"reflectance": 0.5, "exitance": 1}}})";
  ImportOptions options;
  options.overrides = overrides;
  options.strip_spaces = strip_spaces;
  Building building;
  building.info =
      ImportScene(DataFolder() / name, options, budget, *building.store);
  return building;
}

// Skips the test if the folder is missing. The parameter names a file in it.
class RealBuildings : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(DataFolder())) {
      GTEST_SKIP() << "no folder " << DataFolder()
                   << ": set ENFILADE_DATA to the folder of real buildings";
    }
  }
};

}  // namespace enfilade::testing
