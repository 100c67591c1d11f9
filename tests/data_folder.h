// The folder of the real buildings that some tests run on.

#pragma once

#include <cstdlib>
#include <filesystem>

namespace enfilade {

// ENFILADE_DATA, or ../shared/data beside the sources.
inline std::filesystem::path DataFolder() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing sets the environment.
  if (const char* named = std::getenv("ENFILADE_DATA")) {
    return named;
  }
  return std::filesystem::path(ENFILADE_SOURCE_DIR).parent_path() / "shared" /
         "data";
}

}  // namespace enfilade
