// A fake solution of a few elements, and files to write it to.

#pragma once

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/temporary_folder.h"
#include "tools/export/elements.h"
#include <gtest/gtest.h>

namespace enfilade {

// Two cells: a unit square with radiosity rising along x, and a triangle.
class ExportFixture : public ::testing::Test {
 protected:
  ExportFixture() {
    LeafElement quad;
    quad.patch = PatchId(3U);
    quad.corners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    quad.radiosity = {{1, 1, 1}, {2, 2, 2}, {2, 2, 2}, {1, 1, 1}};
    quad.irradiance = {{2, 2, 2}, {4, 4, 4}, {4, 4, 4}, {2, 2, 2}};
    LeafElement triangle;
    triangle.patch = PatchId(1U);
    triangle.corners = {{0, 0, 5}, {2, 0, 5}, {0, 3, 5}};
    triangle.radiosity = {{.5, 0, 0}, {.5, 0, 0}, {.5, 0, 0}};
    triangle.irradiance = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    cells_ = {{quad}, {triangle}};
    source_.cells = cells_.size();
    source_.for_each_leaf =
        [this](CellId cell,
               const std::function<void(const LeafElement&)>& visit) {
          for (const LeafElement& leaf : cells_.at(cell.Index())) {
            visit(leaf);
          }
        };
  }

  [[nodiscard]] std::filesystem::path Path(const std::string& name) const {
    return folder_ / name;
  }

  [[nodiscard]] std::string Content(const std::string& name) const {
    std::ifstream file(Path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  [[nodiscard]] size_t FilesInFolder() const {
    return static_cast<size_t>(
        std::distance(std::filesystem::directory_iterator(folder_.Path()), {}));
  }

  template <typename T>
  static T At(const std::string& bytes, size_t offset) {
    T value;
    EXPECT_LE(offset + sizeof value, bytes.size());
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
  }

  std::vector<std::vector<LeafElement>> cells_;
  ElementSource source_;
  TemporaryFolder folder_;
};

}  // namespace enfilade
