// Files whose corners are off by a tenth of a millimetre: no light is lost
// between surfaces that are nearly in one plane.

#include "base/vec.h"

#include <array>
#include <cstddef>
#include <fstream>
#include <string>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using Quad = std::array<Point3, 4>;

// A sheet lies five centimetres above the ground in a box of sky, turned in
// plan by eleven degrees. Each corner is off by up to 0.15 mm on its own: no
// quadrilateral is planar, and the plane of one half of the ground lies in
// front of the other half by up to a fraction of a millimetre.
constexpr Quad kSheet{{{-0.2371575, -0.3516343, -0.2500045},
                       {-1.8782743, 8.0901131, -0.2499512},
                       {8.5270364, 10.1129162, -0.2500381},
                       {10.1680837, 1.6707763, -0.2499094}}};
constexpr Quad kGround{{{-6.3264766, -9.3795152, -0.2999885},
                        {19.1958159, -4.4185477, -0.2999839},
                        {14.6164369, 19.1405265, -0.2999090},
                        {-10.9059057, 14.1796663, -0.3000493}}};
constexpr std::array<Quad, 5> kSky{{{{{19.1956392, -4.4183655, -0.2999086},
                                      {-6.3265619, -9.3796113, -0.3000909},
                                      {-6.3265050, -9.3795521, 10.0001354},
                                      {19.1957878, -4.4185453, 10.0000466}}},
                                    {{{14.6163035, 19.1407267, -0.2998771},
                                      {19.1957657, -4.4184122, -0.2999406},
                                      {19.1958529, -4.4183126, 9.9998585},
                                      {14.6163038, 19.1406274, 9.9999413}}},
                                    {{{-10.9059346, 14.1794399, -0.2998860},
                                      {14.6163530, 19.1404819, -0.2999512},
                                      {14.6162891, 19.1405057, 9.9999951},
                                      {-10.9060700, 14.1794759, 10.0001097}}},
                                    {{{-6.3264860, -9.3796357, -0.2999166},
                                      {-10.9061063, 14.1795128, -0.2998787},
                                      {-10.9059253, 14.1795048, 9.9999632},
                                      {-6.3265788, -9.3796014, 10.0001500}}},
                                    {{{-10.9060952, 14.1795398, 10.0000739},
                                      {14.6163147, 19.1407411, 9.9999236},
                                      {19.1959050, -4.4183379, 10.0000511},
                                      {-6.3264287, -9.3795053, 10.0000994}}}}};

class SceneFile {
 public:
  explicit SceneFile(const std::filesystem::path& folder)
      : obj_(folder / "a.obj") {
    WriteFile(folder / "a.mtl",
              "newmtl concrete\nKd .45 .45 .45\n"
              "newmtl ground\nKd .25 .25 .25\n"
              "newmtl sky\nKd 0 0 0\nKe 7 8 10\n");
    obj_ << std::fixed << "mtllib a.mtl\n";
    obj_.precision(7);
  }

  void Add(const std::string& material, const Quad& quad) {
    obj_ << "usemtl " << material << '\n';
    for (const Point3 p : quad) {
      obj_ << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    }
    obj_ << "f -4 -3 -2 -1\n";
  }

 private:
  std::ofstream obj_;
};

TEST(NoisyCorners, ASheetOverTheGroundIsSolved) {
  const TemporaryFolder folder;
  {
    SceneFile file(folder.Path());
    file.Add("concrete", kSheet);
    file.Add("ground", kGround);
    for (const Quad& quad : kSky) {
      file.Add("sky", quad);
    }
  }
  const ProgramResult solved =
      SolveScene(folder.Path(), "a", {"--error", "0.1"});
  ASSERT_EQ(solved.exit_code, 0) << solved.err;
  const auto report = nlohmann::json::parse(ReadFile(folder / "a.json"));
  EXPECT_LT(report["links"], 20'000);  // lost light takes ever more links
  const ProgramResult verified = RunProgram({"verify",
                                             folder / "a.enf",
                                             "--seconds",
                                             "20",
                                             "--report",
                                             folder / "v.json"});
  ASSERT_EQ(verified.exit_code, 0) << verified.err;
  const auto measured = nlohmann::json::parse(ReadFile(folder / "v.json"));
  EXPECT_EQ(measured["meets_request"], true) << measured["error_high"];
}

}  // namespace
}  // namespace enfilade
