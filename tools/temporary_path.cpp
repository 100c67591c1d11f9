#include "tools/temporary_path.h"

#include "base/error.h"

#include <system_error>

#include <fmt/format.h>

namespace enfilade {

std::filesystem::path TemporaryPath() {
  std::error_code failed;
  std::filesystem::path path = std::filesystem::temp_directory_path(failed);
  if (failed) {
    throw DiskError(
        fmt::format("temporary files need a folder: the environment variable "
                    "TMPDIR names none ({}); let it name one",
                    failed.message()));
  }
  return path;
}

}  // namespace enfilade
