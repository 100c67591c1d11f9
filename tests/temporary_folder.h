// A folder of its own for a test. Tests run side by side, so a file of a fixed
// name outside the folder would be another test's file as well.

#pragma once

#include "base/check.h"

#include <cstdlib>
#include <filesystem>
#include <string>

namespace enfilade {

// A fresh folder that is removed with its owner.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name =
        (std::filesystem::temp_directory_path() / "enfilade_XXXXXX").string();
    ENFILADE_CHECK(mkdtemp(name.data()) != nullptr, "{}", name);
    path_ = name;
  }

  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  TemporaryFolder(TemporaryFolder&&) = delete;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;

  [[nodiscard]] std::filesystem::path Path() const { return path_; }

  [[nodiscard]] std::string operator/(const std::string& name) const {
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

}  // namespace enfilade
