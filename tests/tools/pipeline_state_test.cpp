#include "tools/pipeline_state.h"

#include "base/error.h"
#include "store/sqlite_store.h"

#include <string>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(SolveSettings, SurviveTheStore) {
  SolveSettings settings;
  settings.scene = "/some/office.obj";
  settings.overrides = "/some/overrides.json";
  settings.default_luminaires = true;
  settings.photometric = true;
  settings.strip_spaces = true;
  settings.sides = 1;
  settings.error = 0.1 / 3;  // no short decimal
  settings.basis = "haar";
  settings.seed = 0xffffffffffffffffULL;
  settings.method.kind = SolveMethod::kHierarchical;
  settings.method.epsilon = 0.1 / 3;
  settings.method.visibility = "quadrature";
  settings.method.singular = "cc";
  settings.method.oracle = "power";
  const auto store = CreateStoreInMemory();
  SaveSettings(*store, settings);
  EXPECT_EQ(LoadSettings(*store), settings);
}

TEST(SolveSettings, AbsentOnesStayAbsent) {
  const auto store = CreateStoreInMemory();
  SaveSettings(*store, SolveSettings());
  EXPECT_EQ(LoadSettings(*store), SolveSettings());
}

TEST(SolveSettings, DamageIsNamed) {
  const auto store = CreateStoreInMemory();
  EXPECT_THROW(LoadSettings(*store), DamagedStoreError);
  for (const char* text : {"", "{", "{}", "[1]", R"({"scene": 3})"}) {
    store->SetMeta("settings", text);
    try {
      LoadSettings(*store);
      ADD_FAILURE() << text;
    } catch (const DamagedStoreError& error) {
      EXPECT_EQ(std::string(error.what()).find("json.exception"),
                std::string::npos)
          << error.what();
    }
  }
}

// Others read the names of methods in stores.
TEST(SolveSettings, MethodsAreKeptByTheirNames) {
  const auto store = CreateStoreInMemory();
  for (const std::string name :
       {"wavelet", "matrix", "progressive", "substructuring", "hierarchical"}) {
    SolveSettings settings;
    settings.method.kind = MethodNamed(name).value();
    SaveSettings(*store, settings);
    const std::string text = store->Meta("settings").value();
    EXPECT_NE(text.find("\"method\":\"" + name + "\""), std::string::npos)
        << text;
    EXPECT_EQ(LoadSettings(*store), settings);
  }
}

TEST(SolveSettings, AMethodThatIsNoneIsDamage) {
  const auto store = CreateStoreInMemory();
  SaveSettings(*store, SolveSettings());
  std::string text = store->Meta("settings").value();
  text.replace(text.find("wavelet"), 7, "wavelength");
  store->SetMeta("settings", text);
  try {
    LoadSettings(*store);
    ADD_FAILURE() << text;
  } catch (const DamagedStoreError& error) {
    EXPECT_NE(std::string(error.what()).find("'wavelength'"), std::string::npos)
        << error.what();
  }
}

TEST(Stage, SurvivesTheStore) {
  const auto store = CreateStoreInMemory();
  for (const Stage stage : {Stage::kCreated,
                            Stage::kImported,
                            Stage::kPartitioned,
                            Stage::kVisible,
                            Stage::kTraceable}) {
    SaveStage(*store, stage);
    EXPECT_EQ(LoadStage(*store), stage);
  }
}

TEST(Stage, UnknownOneIsDamage) {
  const auto store = CreateStoreInMemory();
  EXPECT_THROW(LoadStage(*store), DamagedStoreError);
  store->SetMeta("stage", "baked");
  EXPECT_THROW(LoadStage(*store), DamagedStoreError);
}

TEST(RunRecord, SurvivesTheStore) {
  const auto store = CreateStoreInMemory();
  EXPECT_EQ(LoadRunRecord(*store).runs, 0U);
  RunRecord record;
  record.import_seconds = 1.25;
  record.wall_seconds = 7;
  record.bytes_read = 1ULL << 40;
  record.runs = 3;
  record.version = "0.1.0";
  SaveRunRecord(*store, record);
  const RunRecord loaded = LoadRunRecord(*store);
  EXPECT_EQ(loaded.import_seconds, 1.25);
  EXPECT_EQ(loaded.wall_seconds, 7);
  EXPECT_EQ(loaded.bytes_read, 1ULL << 40);
  EXPECT_EQ(loaded.runs, 3U);
  EXPECT_EQ(loaded.version, "0.1.0");
}

}  // namespace
}  // namespace enfilade
