// Where temporary files go.

#pragma once

#include <filesystem>

namespace enfilade {

// The folder that the environment variable TMPDIR names, or /tmp. Throws
// DiskError if it is no folder.
std::filesystem::path TemporaryPath();

}  // namespace enfilade
