#include "scene/obj_files.h"

#include "scene/input_file.h"
#include "scene/instance_line.h"
#include "scene/number_text.h"

#include <algorithm>
#include <istream>
#include <limits>
#include <set>
#include <string>
#include <utility>

namespace enfilade {
namespace {

// A list of files without duplicates. Names of files that do not exist are not
// kept, so that they take no memory.
class FileList {
 public:
  bool Add(const std::filesystem::path& path) {
    if (!IsFile(path)) {
      files_.some_missing = true;
      return false;
    }
    const bool is_new = known_.insert(path).second;
    if (is_new) {
      files_.existing.push_back(path);
    }
    return is_new;
  }

  ObjFiles Take() { return std::move(files_); }

 private:
  ObjFiles files_;
  std::set<std::filesystem::path> known_;
};

void ReadLines(const std::filesystem::path& path,
               const LineStream::LineCheck& visit) {
  InputFile file(path);
  LineStream lines(file, visit);
  std::istream stream(&lines);
  stream.exceptions(std::ios::badbit);
  while (stream.ignore(std::numeric_limits<std::streamsize>::max()) &&
         !stream.eof()) {
  }
}

void AddMaterialFiles(const std::filesystem::path& obj,
                      std::string_view line,
                      FileList& files) {
  if (const auto names = NamesAfterMtllib(line)) {
    for (const auto& path : MaterialPaths(obj, *names)) {
      files.Add(path);
    }
  }
}

// The path of a name in a folder; of one written with the separators of
// Windows, if there is no file of that very name but one with those of here.
std::filesystem::path PathIn(const std::filesystem::path& folder,
                             std::string_view name) {
  std::filesystem::path as_named = folder / name;
  if (name.find('\\') == std::string_view::npos || Exists(as_named)) {
    return as_named;
  }
  std::string with_slashes(name);
  std::replace(with_slashes.begin(), with_slashes.end(), '\\', '/');
  return Exists(folder / with_slashes) ? folder / with_slashes : as_named;
}

}  // namespace

std::vector<std::filesystem::path> MaterialPaths(
    const std::filesystem::path& obj, std::string_view names) {
  const std::filesystem::path folder = obj.parent_path();
  if (const auto whole = PathIn(folder, names); Exists(whole)) {
    return {whole};
  }
  std::vector<std::filesystem::path> paths;
  for (const std::string_view name : Words(names)) {
    paths.push_back(PathIn(folder, name));
  }
  return paths;
}

std::optional<std::string_view> NamesAfterMtllib(std::string_view line) {
  constexpr std::string_view kKey = "mtllib";
  const size_t first = line.find_first_not_of(" \t");
  if (first == std::string_view::npos ||
      line.substr(first, kKey.size()) != kKey) {
    return std::nullopt;
  }
  const size_t name = line.find_first_not_of(" \t", first + kKey.size());
  return name == std::string_view::npos ? std::string_view()
                                        : line.substr(name);
}

ObjFiles FilesBehindObj(
    const std::filesystem::path& obj,
    const std::function<void(std::span<const char>)>& visit) {
  FileList files;
  ReadLines(obj, [&](std::string_view line) {
    visit(line);
    visit(std::string_view("\n"));
    AddMaterialFiles(obj, line, files);
    const auto words = WordsAfterInstance(line);
    const auto instance =
        words ? ReadInstance(*words).instance : std::optional<Instance>();
    if (!instance) {
      return;
    }
    const auto piece = obj.parent_path() / instance->piece;
    if (files.Add(piece)) {
      ReadLines(piece, [&](std::string_view piece_line) {
        AddMaterialFiles(piece, piece_line, files);
      });
    }
  });
  return files.Take();
}

}  // namespace enfilade
