// The files that an OBJ names: material files and the pieces of instances.

#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace enfilade {

// What follows the word mtllib; nullopt for any other line.
std::optional<std::string_view> NamesAfterMtllib(std::string_view line);

// The names after a mtllib as paths, most likely reading first: the whole rest
// of the line is one name with blanks in it if there is such a file.
std::vector<std::filesystem::path> MaterialPaths(
    const std::filesystem::path& obj, std::string_view names);

// The files that an OBJ draws on: its material files, its pieces and theirs, in
// its order and once each; those that exist. The OBJ is read to its end;
// `visit` sees its text: each line (LineStream) and a line feed after it.
std::vector<std::filesystem::path> FilesBehindObj(
    const std::filesystem::path& obj,
    const std::function<void(std::span<const char>)>& visit);

}  // namespace enfilade
