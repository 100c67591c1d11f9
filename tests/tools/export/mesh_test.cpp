#include "base/error.h"

#include <sstream>
#include <string>
#include <vector>

#include "tests/store/file_size_limit.h"
#include "tests/tools/export_fixture.h"
#include "tests/tools/verify_fake_building.h"
#include "tools/export/csv.h"
#include "tools/export/elements.h"
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

class ExportMeshTest : public ExportFixture {
 protected:
  MeshCensus Census() { return TakeCensus(Leaves(), {}); }

  MeshSource Leaves() { return LeavesOf(source_); }
};

TEST_F(ExportMeshTest, CensusCountsElements) {
  const MeshCensus census = Census();
  EXPECT_EQ(census.faces, 2U);
  EXPECT_EQ(census.vertices, 7U);
  EXPECT_EQ(census.bounds.high, (Point3{2, 3, 5}));
}

TEST_F(ExportMeshTest, PlyHoldsVerticesAndFaces) {
  const uint64_t bytes = WritePly(Leaves(), Census(), {}, Path("a.ply"));
  const std::string ply = Content("a.ply");
  EXPECT_EQ(ply.size(), bytes);
  EXPECT_NE(ply.find("element vertex 7\n"), std::string::npos);
  EXPECT_NE(ply.find("element face 2\n"), std::string::npos);
  const size_t body = ply.find("end_header\n") + 11;
  constexpr size_t kVertex = 24 + 3 + 24;
  ASSERT_EQ(ply.size(), body + 7 * kVertex + (1 + 16) + (1 + 12));
  // The second vertex of the square: x, and its red radiosity and irradiance.
  EXPECT_EQ(At<double>(ply, body + kVertex), 1.0);
  EXPECT_EQ(At<float>(ply, body + kVertex + 27), 2.0F);
  EXPECT_EQ(At<float>(ply, body + kVertex + 39), 4.0F);
  EXPECT_GT(At<uint8_t>(ply, body + kVertex + 24),
            At<uint8_t>(ply, body + 24));  // brighter than the first
  const size_t faces = body + 7 * kVertex;
  EXPECT_EQ(At<uint8_t>(ply, faces), 4);
  EXPECT_EQ(At<int32_t>(ply, faces + 1 + 12), 3);
  EXPECT_EQ(At<uint8_t>(ply, faces + 17), 3);
  EXPECT_EQ(At<int32_t>(ply, faces + 18), 4);
}

TEST_F(ExportMeshTest, GlbIsWellFormed) {
  const uint64_t bytes = WriteGlb(Leaves(), Census(), {}, Path("a.glb"));
  const std::string glb = Content("a.glb");
  ASSERT_EQ(glb.size(), bytes);
  EXPECT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(At<uint32_t>(glb, 8), glb.size());
  const auto json_bytes = At<uint32_t>(glb, 12);
  EXPECT_EQ(json_bytes % 4, 0U);
  const auto gltf = nlohmann::json::parse(glb.substr(20, json_bytes));
  const size_t binary = 20 + json_bytes + 8;
  EXPECT_EQ(At<uint32_t>(glb, 20 + json_bytes), glb.size() - binary);
  EXPECT_EQ(gltf["buffers"][0]["byteLength"], glb.size() - binary);
  EXPECT_EQ(gltf["accessors"][0]["count"], 7);
  const std::vector<double> matrix = gltf["nodes"][0]["matrix"];
  const std::vector<double> high = gltf["accessors"][0]["max"];
  EXPECT_EQ(matrix[12] + high[0], 2);
  EXPECT_EQ(matrix[13] + high[2], 5);  // Z goes to Y
  EXPECT_EQ(matrix[14] - high[1], -3);
  EXPECT_EQ(gltf["accessors"][2]["count"], 9);
  const size_t indices =
      binary + gltf["bufferViews"][1]["byteOffset"].get<size_t>();
  std::vector<uint32_t> got;
  for (size_t i = 0; i < 9; ++i) {
    got.push_back(At<uint32_t>(glb, indices + 4 * i));
  }
  EXPECT_EQ(got, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3, 4, 5, 6}));
  // Colours are linear and within [0, 1]; the triangle is pure red.
  const float red = At<float>(glb, binary + 4 * 24 + 12);
  EXPECT_GT(red, 0.0F);
  EXPECT_LE(red, 1.0F);
  EXPECT_EQ(At<float>(glb, binary + 4 * 24 + 16), 0.0F);
}

TEST_F(ExportMeshTest, ZUpIsTurnedToYUpInGltfOnly) {
  MeshOptions options;
  options.z_up = false;
  WriteGltf(Leaves(), Census(), options, Path("y.gltf"));
  const std::vector<double> as_it_is =
      nlohmann::json::parse(Content("y.gltf"))["nodes"][0]["matrix"];
  EXPECT_EQ(as_it_is[5], 1);
  EXPECT_EQ(as_it_is[10], 1);
  options.z_up = true;
  WriteGltf(Leaves(), Census(), options, Path("z.gltf"));
  const auto gltf = nlohmann::json::parse(Content("z.gltf"));
  const std::vector<double> m = gltf["nodes"][0]["matrix"];
  // Column-major: Z goes to Y, Y to -Z.
  EXPECT_EQ(m[9], 1);
  EXPECT_EQ(m[6], -1);
  EXPECT_EQ(m[13], as_it_is[14]);
  EXPECT_EQ(m[14], -as_it_is[13]);
  EXPECT_EQ(gltf["buffers"][0]["uri"], "z.bin");
  EXPECT_EQ(gltf["buffers"][0]["byteLength"], Content("z.bin").size());
}

// In map coordinates a step of single precision is half a metre.
TEST_F(ExportMeshTest, PlacesAreExactFarFromTheOrigin) {
  const Vec3 away = {4.3e5, 5.4e6, 120};
  for (auto& leaves : cells_) {
    for (LeafElement& leaf : leaves) {
      for (Point3& corner : leaf.corners) {
        corner = corner + away;
      }
    }
  }
  WritePly(Leaves(), Census(), {}, Path("a.ply"));
  const std::string ply = Content("a.ply");
  const size_t second = ply.find("end_header\n") + 11 + 24 + 3 + 24;
  EXPECT_EQ(At<double>(ply, second), away.x + 1);

  WriteVtu(Leaves(), Census(), {}, Path("a.vtu"));
  const std::string vtu = Content("a.vtu");
  const size_t points = vtu.find("encoding=\"raw\">\n_") + 17 + 8;
  EXPECT_EQ(At<double>(vtu, points + 24), away.x + 1);

  WriteGltf(Leaves(), Census(), {}, Path("a.gltf"));
  const auto gltf = nlohmann::json::parse(Content("a.gltf"));
  const std::vector<double> matrix = gltf["nodes"][0]["matrix"];
  EXPECT_NEAR(matrix[12] + static_cast<double>(At<float>(Content("a.bin"), 24)),
              away.x + 1,
              1e-6);
}

TEST_F(ExportMeshTest, GltfNamesItsBinaryByAUri) {
  WriteGltf(Leaves(), Census(), {}, Path("my 50%.gltf"));
  const auto gltf = nlohmann::json::parse(Content("my 50%.gltf"));
  EXPECT_EQ(gltf["buffers"][0]["uri"], "my%2050%25.bin");
  EXPECT_GT(Content("my 50%.bin").size(), 0U);
}

// The text of 1,000 elements fits under the limit, their vertices do not.
TEST_F(ExportMeshTest, GltfWhoseBinaryFailsLeavesNeither) {
  cells_[0].resize(1000, cells_[0][0]);
  for (const bool replaces : {false, true}) {
    if (replaces) {
      WriteGltf(LeavesOf(source_), Census(), {}, Path("a.gltf"));
    }
    const std::string text = replaces ? Content("a.gltf") : "";
    const std::string binary = replaces ? Content("a.bin") : "";
    std::string error;
    try {
      const FileSizeLimit limit(32 << 10);
      WriteGltf(LeavesOf(source_), Census(), {}, Path("a.gltf"));
    } catch (const DiskError& e) {
      error = e.what();
    }
    EXPECT_NE(error.find("a.bin"), std::string::npos) << error;
    EXPECT_EQ(FilesInFolder(), replaces ? 2U : 0U);
    if (replaces) {
      EXPECT_LT(text.size(), 32U << 10);
      EXPECT_GT(binary.size(), 32U << 10);
      EXPECT_EQ(Content("a.gltf"), text);
      EXPECT_EQ(Content("a.bin"), binary);
    }
  }
}

// Of the two names, that of the text is taken here.
TEST_F(ExportMeshTest, GltfWhoseTextFailsLeavesNeither) {
  std::filesystem::create_directory(Path("a.gltf"));
  EXPECT_THROW(WriteGltf(Leaves(), Census(), {}, Path("a.gltf")), DiskError);
  EXPECT_EQ(FilesInFolder(), 1U) << "the folder of that name";
}

TEST_F(ExportMeshTest, VtuArraysLieAtTheirOffsets) {
  WriteVtu(Leaves(), Census(), {}, Path("a.vtu"));
  const std::string vtu = Content("a.vtu");
  const size_t data = vtu.find("encoding=\"raw\">\n_") + 17;
  const auto array = [&](const std::string& name) {
    const size_t at = vtu.find("Name=\"" + name + "\"");
    const size_t offset = vtu.find("offset=\"", at) + 8;
    return data + std::stoul(vtu.substr(offset));
  };
  EXPECT_EQ(At<uint64_t>(vtu, array("Points")), 7U * 24);
  EXPECT_EQ(At<uint64_t>(vtu, array("connectivity")), 7U * 8);
  EXPECT_EQ(At<int64_t>(vtu, array("connectivity") + 8 + 6 * 8), 6);
  EXPECT_EQ(At<int64_t>(vtu, array("offsets") + 8), 4);
  EXPECT_EQ(At<int64_t>(vtu, array("offsets") + 16), 7);
  EXPECT_EQ(At<uint8_t>(vtu, array("types") + 8), 9);
  EXPECT_EQ(At<uint8_t>(vtu, array("types") + 9), 5);
  EXPECT_EQ(At<float>(vtu, array("radiosity") + 8 + 12), 2.0F);
  EXPECT_EQ(At<uint32_t>(vtu, array("cell") + 12), 1U);
  EXPECT_EQ(At<uint32_t>(vtu, array("patch") + 8), 3U);
  EXPECT_NE(vtu.find("</AppendedData>", array("patch") + 16),
            std::string::npos);
}

TEST_F(ExportMeshTest, CsvHasTheMeansOfEveryPatch) {
  FakeBuilding building;
  const MaterialId wall = building.AddMaterial({.5, .5, .25}, {});
  const MaterialId lamp = building.AddMaterial({}, {7, 0, 0});
  building.Add({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, wall);
  building.AddCell();
  building.Add({0, 0, 5}, {2, 0, 0}, {0, 3, 0}, lamp, PatchShape::kTriangle);
  BuildingView view = building.View();
  // The quarter of the square that gets 6 W/m2 and the rest that gets 2.
  view.for_each_mean = [](CellId cell,
                          std::span<const PatchId> patches,
                          const std::function<void(const LeafMean&)>& visit) {
    for (const PatchId patch : patches) {
      if (cell.value == 0) {
        visit({patch, {}, 0.75, {2, 2, 2}});
        visit({patch, {}, 0.25, {6, 6, 6}});
      } else {
        visit({patch, {}, 3, {1, 1, 1}});
      }
    }
  };
  MemoryBudget budget(1 << 20);
  uint64_t bytes = 0;
  EXPECT_EQ(WriteCsv(view, {}, budget, Path("a.csv"), &bytes), 2U);
  const std::string csv = Content("a.csv");
  EXPECT_EQ(csv.size(), bytes);
  EXPECT_NE(
      csv.find("\n0,0,m0,0,1,0,0,0,1,0,0,1,1,0,0,1,0,1.5,1.5,0.75,3,3,3\n"),
      std::string::npos)
      << csv;
  EXPECT_NE(csv.find("\n1,0,m1,1,3,0,0,5,2,0,5,0,3,5,,,,7,0,0,1,1,1\n"),
            std::string::npos)
      << csv;
}

TEST_F(ExportMeshTest, PlacesInACsvAreExactFarFromTheOrigin) {
  const Point3 corner = {430123.0625 + 1.0 / 3, 5400000.123456789, 120.1};
  FakeBuilding building;
  const MaterialId wall = building.AddMaterial({.5, .5, .5}, {});
  building.Add(corner, {1, 0, 0}, {0, 1, 0}, wall);
  BuildingView view = building.View();
  view.for_each_mean = [](CellId,
                          std::span<const PatchId>,
                          const std::function<void(const LeafMean&)>&) {};
  MemoryBudget budget(1 << 20);
  uint64_t bytes = 0;
  WriteCsv(view, {}, budget, Path("a.csv"), &bytes);
  const std::string csv = Content("a.csv");
  std::istringstream row(csv.substr(csv.find('\n') + 1));
  std::vector<std::string> columns;
  for (std::string column; std::getline(row, column, ',');) {
    columns.push_back(column);
  }
  ASSERT_GT(columns.size(), 8U);
  EXPECT_EQ(std::stod(columns[5]), corner.x);
  EXPECT_EQ(std::stod(columns[6]), corner.y);
  EXPECT_EQ(std::stod(columns[7]), corner.z);
}

TEST_F(ExportMeshTest, AFailedExportLeavesWhatWasThere) {
  std::ofstream(Path("a.ply")) << "old";
  const auto fail_in_cell_1 =
      [this](CellId cell,
             const std::function<void(const LeafElement&)>& visit) {
        if (cell.value == 1) {
          throw DamagedStoreError("torn");
        }
        visit(cells_[0][0]);
      };
  const MeshCensus census = Census();
  source_.for_each_leaf = fail_in_cell_1;
  EXPECT_THROW(WritePly(Leaves(), census, {}, Path("a.ply")),
               DamagedStoreError);
  EXPECT_EQ(Content("a.ply"), "old");
  EXPECT_EQ(FilesInFolder(), 1U);
}

TEST_F(ExportMeshTest, AMissingFolderIsADiskError) {
  EXPECT_THROW(WritePly(Leaves(), Census(), {}, Path("no/a.ply")), DiskError);
}

}  // namespace
}  // namespace enfilade
