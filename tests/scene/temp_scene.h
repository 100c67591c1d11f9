// Small scene files for tests, in a folder that goes away with the test.

#pragma once

#include "base/error.h"
#include "base/planar_polygon.h"
#include "scene/import.h"
#include "store/sqlite_store.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "tests/data_folder.h"
#include "tests/temporary_folder.h"
#include <gtest/gtest.h>

namespace enfilade {

inline constexpr uint64_t kTestBudgetBytes = 200ULL << 20;

class TempScene {
 public:
  std::filesystem::path Write(const std::string& name,
                              const std::string& text) const {
    const std::filesystem::path path = folder_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }

 private:
  TemporaryFolder folder_;
};

// An imported scene with all its faces.
struct Imported {
  SceneInfo info;
  std::vector<Face> faces;

  [[nodiscard]] double Area() const {
    double area = 0;
    for (const Face& face : faces) {
      area += PolygonArea(face.vertices);
    }
    return area;
  }
};

inline Imported ImportFile(const std::filesystem::path& path,
                           const ImportOptions& options = {},
                           uint64_t budget_bytes = kTestBudgetBytes) {
  const std::unique_ptr<BlockStorage> store = CreateStoreInMemory();
  MemoryBudget budget(budget_bytes);
  Imported imported;
  ImportScene(path, options, budget, *store);
  EXPECT_EQ(budget.UsedBytes(), 0U) << "a charge outlives the import";
  EXPECT_EQ(store->Count(BlockKind::kScratch), 0U);
  imported.info = LoadSceneInfo(*store);
  ForEachFace(*store, [&](FaceId, const Face& face) {
    imported.faces.push_back(face);
  });
  return imported;
}

// The message of the InputError that importing throws; empty if none is.
inline std::string ImportError(const std::filesystem::path& path,
                               const ImportOptions& options = {}) {
  try {
    ImportFile(path, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace enfilade

// Skips the test where the real buildings are absent.
#define ENFILADE_NEEDS_DATA()                                             \
  if (!std::filesystem::exists(::enfilade::DataFolder() / "gbxml")) {     \
    GTEST_SKIP() << "no real buildings in " << ::enfilade::DataFolder()   \
                 << "; set ENFILADE_DATA to the folder that holds gbxml/" \
                    " and obj/";                                          \
  }
