#include "scene/polygon_sink.h"

#include "store/sqlite_store.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// A few polygons of many corners take as much memory as many polygons of few.
TEST(PolygonSink, BatchesAreBoundedByTheirCornersToo) {
  constexpr size_t kCorners = 4096;
  constexpr int kPolygons = 256;
  std::vector<Point3> edge;  // to and fro: without area
  for (size_t i = 0; i < kCorners; ++i) {
    edge.push_back({i % 2 == 0 ? 0.0 : 1.0, 0, 0});
  }
  const auto store = CreateStoreInMemory();
  SceneWriter writer(*store);
  MemoryBudget budget(100ULL << 20);
  PolygonSink sink(budget, writer);
  sink.Begin(MaterialId(0U), Material(), ObjectId(0U));
  for (int i = 0; i < kPolygons; ++i) {
    sink.Add(edge);
  }
  sink.Flush();
  EXPECT_EQ(sink.Counts().zero_area, size_t{kPolygons});
}

}  // namespace
}  // namespace enfilade
