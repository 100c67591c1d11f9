// The files that an OBJ names: material files and the pieces of instances.

#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace enfilade {

// The names after the keyword mtllib; nullopt for any other line.
std::optional<std::string_view> NamesAfterMtllib(std::string_view line);

// The names after a mtllib as paths. If a file is named by the whole rest of
// the line, blanks included, then that one; otherwise one path per word. A name
// that no file has may be one with backslashes for slashes.
std::vector<std::filesystem::path> MaterialPaths(
    const std::filesystem::path& obj, std::string_view names);

// What an OBJ draws on: its material files, its pieces and their material
// files.
struct ObjFiles {
  std::vector<std::filesystem::path> existing;  // once each, as first named
  bool some_missing = false;                    // of those that are named
};

// The OBJ is read to its end; `visit` gets its text: each line (LineStream) and
// then a line feed.
ObjFiles FilesBehindObj(
    const std::filesystem::path& obj,
    const std::function<void(std::span<const char>)>& visit);

}  // namespace enfilade
