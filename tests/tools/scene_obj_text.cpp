#include "tests/tools/scene_obj_text.h"

#include "base/planar_polygon.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <set>
#include <sstream>
#include <tuple>

namespace enfilade::testing {

namespace {

void ReadMtl(const std::filesystem::path& mtl, ReadScene& scene) {
  std::ifstream file(mtl);
  std::string line;
  std::string name;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    Rgb rgb{};
    if (key == "newmtl") {
      words >> name;
    } else if (words >> rgb[0] >> rgb[1] >> rgb[2]) {
      (key == "Kd" ? scene.reflectance : scene.exitance)[name] = rgb;
    }
  }
}

int64_t Micrometres(double metres) {
  return std::llround(metres * 1e6);
}

bool IsSound(const std::vector<Point3>& v) {
  const Vec3 area = AreaVector(v);
  if (Length(area) < 1e-6) {
    return false;
  }
  const Vec3 normal = Normalize(area);
  for (size_t i = 0; i < v.size(); ++i) {
    const Vec3 a = v[(i + 1) % v.size()] - v[i];
    const Vec3 b = v[(i + 2) % v.size()] - v[(i + 1) % v.size()];
    if (std::abs(Dot(v[i] - v[0], normal)) > 1e-6 ||
        Dot(Cross(a, b), normal) <= 0) {
      return false;
    }
  }
  return true;
}

}  // namespace

ReadScene ReadObj(const std::filesystem::path& obj) {
  ReadScene scene;
  ReadMtl(std::filesystem::path(obj).replace_extension(".mtl"), scene);
  std::ifstream file(obj);
  std::vector<Point3> points;
  ReadPolygon current;
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "v") {
      Point3 p;
      words >> p.x >> p.y >> p.z;
      points.push_back(p);
    } else if (key == "o") {
      words >> current.object;
    } else if (key == "usemtl") {
      words >> current.material;
    } else if (key == "f") {
      current.vertices.clear();
      for (size_t index = 0; words >> index;) {
        current.vertices.push_back(points.at(index - 1));
      }
      scene.polygons.push_back(current);
    }
  }
  return scene;
}

::testing::AssertionResult AllFacesAreSound(const ReadScene& scene) {
  using Key = std::tuple<int64_t, int64_t, int64_t>;
  std::set<std::set<Key>> seen;
  for (const ReadPolygon& polygon : scene.polygons) {
    std::set<Key> key;
    for (const Point3 p : polygon.vertices) {
      key.emplace(Micrometres(p.x), Micrometres(p.y), Micrometres(p.z));
    }
    if (!seen.insert(key).second) {
      return ::testing::AssertionFailure()
             << "two faces on the same vertices in " << polygon.object;
    }
    if (!IsSound(polygon.vertices)) {
      return ::testing::AssertionFailure()
             << "a bent, concave or empty face in " << polygon.object;
    }
  }
  return ::testing::AssertionSuccess();
}

::testing::AssertionResult EdgesCancel(const std::vector<ReadPolygon>& faces) {
  using Line = std::array<int64_t, 3>;  // axis, the two fixed coordinates
  // Where edges begin (+1) and end (-1) along each line.
  std::map<Line, std::map<int64_t, int>> ends;
  for (const ReadPolygon& face : faces) {
    for (size_t i = 0; i < face.vertices.size(); ++i) {
      const Point3 a = face.vertices[i];
      const Point3 b = face.vertices[(i + 1) % face.vertices.size()];
      const size_t axis = a.x != b.x ? 0 : a.y != b.y ? 1 : 2;
      const size_t j = (axis + 1) % 3;
      const size_t k = (axis + 2) % 3;
      if (a[j] != b[j] || a[k] != b[k]) {
        return ::testing::AssertionFailure()
               << "an edge that is not axis-parallel in " << face.object;
      }
      auto& line = ends[{
          static_cast<int64_t>(axis), Micrometres(a[j]), Micrometres(a[k])}];
      ++line[Micrometres(a[axis])];
      --line[Micrometres(b[axis])];
    }
  }
  for (const auto& [line, at] : ends) {
    for (const auto& [position, sum] : at) {
      if (sum != 0) {
        return ::testing::AssertionFailure()
               << "open edge along axis " << line[0] << " at " << position
               << " um, line " << line[1] << " " << line[2];
      }
    }
  }
  return ::testing::AssertionSuccess();
}

double EnclosedVolume(const std::vector<ReadPolygon>& polygons) {
  double volume = 0;
  for (const ReadPolygon& polygon : polygons) {
    const Vec3 to_first = polygon.vertices[0] - Point3{};
    volume += Dot(to_first, AreaVector(polygon.vertices)) / 3;
  }
  return volume;
}

}  // namespace enfilade::testing
