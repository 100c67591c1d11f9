// The candidate of store_layout.h: segment files beside a SQLite catalogue.

#pragma once

#include <filesystem>
#include <memory>

#include "bench/store_layout.h"

namespace enfilade::bench {

// Makes the catalogue of a new layout in an empty folder.
void CreateSegmentCatalogue(const std::filesystem::path& folder);

// If `reuse`, the extents of replaced frames are used for new frames.
std::unique_ptr<Layout> OpenSegmentLayout(const std::filesystem::path& folder,
                                          bool reuse);

}  // namespace enfilade::bench
