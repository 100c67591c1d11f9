#include "base/error.h"

#include <cmath>

#include "tests/budgets.h"
#include "tests/store/file_size_limit.h"
#include "tests/tools/export_fixture.h"
#include "tests/tools/verify_fake_building.h"
#include "tools/export/camera_choice.h"
#include "tools/export/export.h"
#include "tools/export/image.h"
#include "tools/export/render_picture.h"
#include "tools/export/render_tone.h"
#include <png.h>

namespace enfilade {
namespace {

// A room of 6 x 4 x 3 m seen from inside, whose radiosity is 1 + x.
class PictureTest : public ExportFixture {
 protected:
  PictureTest() {
    building_.AddRoom({6, 4, 3}, building_.AddMaterial({.5, .5, .5}, {}));
    const auto field = [](const Patch&, Point3 p) {
      return Rgb{1 + p.x, 1 + p.x, 1 + p.x};
    };
    building_.SetRadiosity(field);
    building_.SetIrradiance(field);
  }

  Picture Render(const Camera& camera, uint32_t width, uint32_t height) {
    RenderOptions options;
    options.width = width;
    options.height = height;
    return RenderPicture(building_.View(), camera, options, budget_);
  }

  FakeBuilding building_;
  MemoryBudget budget_{kModest};
};

TEST(ExportOptions, RefuseNumbersThatNoPictureHas) {
  const auto expect_refused = [](const auto& set) {
    ExportOptions options;
    EXPECT_NO_THROW(options.Validate());
    set(options);
    EXPECT_THROW(options.Validate(), UsageError);
  };
  using Options = ExportOptions;
  expect_refused([](Options& o) { o.exposure_stops = NAN; });
  expect_refused([](Options& o) { o.exposure_stops = 1000; });
  expect_refused([](Options& o) { o.camera.plan_cut_m = NAN; });
  expect_refused([](Options& o) { o.camera.eye = Point3{1e200, 0, 0}; });
  expect_refused([](Options& o) { o.camera.target = Point3{0, NAN, 0}; });
  expect_refused([](Options& o) {
    o.camera.eye = Point3{1, 1, 1};
    o.camera.target = Point3{1, 1, 1 + 1e-9};
  });
}

TEST_F(PictureTest, PerspectiveHitsWhereItLooks) {
  const Camera camera =
      PerspectiveCamera({1, 2, 1}, {6, 2, 1}, {0, 0, 1}, 2, 1);
  const Picture picture = Render(camera, 3, 3);
  const Pixel middle = picture.Row(1)[1];
  EXPECT_EQ(middle.front, 1);
  EXPECT_NEAR(middle.radiosity[0], 7, 1e-4);
}

// Right in the picture is right of the camera, up is up: from (3, 0.1) looking
// along +y with z up, +x is to the right.
TEST_F(PictureTest, PerspectiveIsNotMirrored) {
  const Camera camera =
      PerspectiveCamera({3, .1, 1.5}, {3, 4, 1.5}, {0, 0, 1}, 60, 1.5);
  const std::vector<Pixel> row = Render(camera, 30, 20).Row(10);
  EXPECT_GT(row[29].radiosity[0], row[0].radiosity[0] + 3);
  EXPECT_GT(camera.direction_y.z, 0);
}

TEST_F(PictureTest, PlanShowsTheFloorTrueToScale) {
  const Camera camera =
      PlanCamera(building_.View().scene->bounds, UpAxis::kZ, 1.8, 1.5);
  const Picture picture = Render(camera, 60, 40);
  const std::vector<Pixel> row = picture.Row(20);
  EXPECT_EQ(row[0].front + row[0].back, 0);  // the margin
  // 6 m are 60 / 1.04 pixels. The middle of the room, where the radiosity is 4,
  // lies between pixels 29 and 30. Only single precision is left.
  constexpr double kPixelM = 6 * 1.04 / 60;
  EXPECT_NEAR(row[30].radiosity[0], 4 + 0.5 * kPixelM, 1e-5);
  EXPECT_NEAR(row[40].radiosity[0] - row[20].radiosity[0], 20 * kPixelM, 1e-5);
}

TEST_F(PictureTest, ThePictureDoesNotDependOnTheBand) {
  const Camera camera =
      PerspectiveCamera({1, 1, 1}, {5, 3, 2}, {0, 0, 1}, 60, 1.5);
  const Picture all = Render(camera, 60, 40);
  MemoryBudget tight(5 << 20);
  RenderOptions options;
  options.width = 60;
  options.height = 40;
  const Picture banded =
      RenderPicture(building_.View(), camera, options, tight);
  for (uint32_t row = 0; row < 40; ++row) {
    const auto a = all.Row(row);
    const auto b = banded.Row(row);
    for (size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(a[i].radiosity, b[i].radiosity);
    }
  }
}

// One row of the picture, 1,000 pixels of 16 x 16 samples, takes more than the
// budget.
TEST_F(PictureTest, ARowNeedNotFitIntoMemory) {
  const Camera camera =
      PerspectiveCamera({1, 2, 1}, {6, 2, 1}, {0, 0, 1}, 60, 1000);
  RenderOptions options;
  options.width = 1000;
  options.height = 1;
  options.samples = 16;
  MemoryBudget small(16 << 20);
  const Picture picture =
      RenderPicture(building_.View(), camera, options, small);
  MemoryBudget large(512 << 20);
  const Picture same = RenderPicture(building_.View(), camera, options, large);
  EXPECT_LT(small.PeakBytes(), 16U << 20);
  for (uint32_t column = 0; column < options.width; ++column) {
    EXPECT_EQ(picture.Row(0)[column].radiosity, same.Row(0)[column].radiosity);
  }
}

TEST_F(PictureTest, TheChosenCameraStandsInTheRoomAndSeesItsLength) {
  const Camera camera =
      ChooseCamera(building_.View(), CameraOptions{}, 1.5, budget_);
  const Box3& box = building_.View().scene->bounds;
  EXPECT_TRUE(box.Contains(camera.origin));
  EXPECT_NEAR(camera.origin.z, 1.6, 1e-9);
  EXPECT_GT(std::abs(camera.direction.x), std::abs(camera.direction.y));
  EXPECT_EQ(budget_.UsedBytes(), 0U);
}

TEST_F(PictureTest, ThePlanIsCutAboveTheLitFloor) {
  CameraOptions options;
  options.view = CameraView::kPlan;
  EXPECT_NEAR(ChooseCamera(building_.View(), options, 1.5, budget_).origin.z,
              1.8,
              1e-9);
}

TEST_F(PictureTest, PngHoldsTheTonesOfThePicture) {
  const Camera camera =
      PlanCamera(building_.View().scene->bounds, UpAxis::kZ, 1.8, 1.5);
  ImageOptions options;
  options.white_background = true;
  WritePng(Render(camera, 60, 40), options, Path("a.png"));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&image, Path("a.png").c_str()), 0);
  image.format = PNG_FORMAT_RGB;
  std::vector<uint8_t> rgb(PNG_IMAGE_SIZE(image));
  ASSERT_NE(png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr), 0);
  ASSERT_EQ(image.width, 60U);
  ASSERT_EQ(image.height, 40U);
  const auto at = [&](size_t x, size_t y) { return rgb[(y * 60 + x) * 3]; };
  EXPECT_EQ(at(0, 0), 255);
  EXPECT_GT(at(55, 20), at(5, 20) + 30);
  EXPECT_GT(at(30, 20), 100);  // a middle tone
  EXPECT_LT(at(30, 20), 220);
}

// The picture is so large that libpng itself meets the limit, and not only the
// last flush.
TEST_F(PictureTest, AFullDiskUnderAPngIsOneErrorAndNoWordOfTheLibrarys) {
  constexpr uint32_t kSize = 256;
  Picture noise(kSize, kSize);
  uint32_t random = 1;
  for (uint32_t row = 0; row < kSize; ++row) {
    std::vector<Pixel> pixels(kSize);
    for (Pixel& p : pixels) {
      random = random * 1664525 + 1013904223;
      p.radiosity = {static_cast<float>(random >> 24), 1, 1};
      p.front = static_cast<float>(random >> 16 & 255) / 255;
    }
    noise.SetPixels(uint64_t{row} * kSize, pixels);
  }
  ::testing::internal::CaptureStderr();
  std::string error;
  try {
    const FileSizeLimit limit(1000);
    WritePng(noise, {}, Path("a.png"));
  } catch (const DiskError& e) {
    error = e.what();
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_NE(error.find("a.png': File too large"), std::string::npos) << error;
  EXPECT_EQ(FilesInFolder(), 0U);
}

// The header's fixed parts, and the offset table's last entry.
TEST_F(PictureTest, ExrRowsLieAtTheirOffsets) {
  const Camera camera =
      PerspectiveCamera({1, 2, 1}, {6, 2, 1}, {0, 0, 1}, 2, 1);
  const uint64_t bytes = WriteExr(Render(camera, 4, 3), Path("a.exr"));
  const std::string exr = Content("a.exr");
  ASSERT_EQ(exr.size(), bytes);
  EXPECT_EQ(At<uint32_t>(exr, 0), 20000630U);
  constexpr size_t kRow = 8 + 4 * 4 * 4;
  const size_t first = exr.size() - 3 * kRow;
  EXPECT_EQ(At<uint64_t>(exr, first - 8), exr.size() - kRow);
  EXPECT_EQ(At<uint32_t>(exr, exr.size() - kRow), 2U);
  EXPECT_EQ(At<float>(exr, exr.size() - kRow + 8), 1.0F);        // A
  EXPECT_NEAR(At<float>(exr, exr.size() - kRow + 24), 7, 1e-3);  // B
}

TEST(ToneMapTest, IsMonotonicAndKeepsBlackAndWhite) {
  const ToneMap tone(100, 0);
  EXPECT_EQ(tone.Encoded({0, 0, 0})[0], 0);
  EXPECT_EQ(tone.Encoded({1e6, 1e6, 1e6})[0], 255);
  double previous = -1;
  for (double x = 0; x < 2000; x += 10) {
    const double y = tone.Linear({x, x, x})[0];
    EXPECT_GT(y, previous - (previous == 1 ? 1e-9 : 0));
    previous = y;
  }
  // The key lands on a middle tone whatever its size.
  EXPECT_NEAR(tone.Linear({100, 0, 0})[0], .338, .01);
}

TEST(ToneMapTest, OneStopMoreIsTwiceTheLight) {
  EXPECT_DOUBLE_EQ(ToneMap(1, 1).Linear({.3, 0, 0})[0],
                   ToneMap(1, 0).Linear({.6, 0, 0})[0]);
}

TEST(ExposureMeterTest, KeyIsTheGeometricMeanOfWhatIsLit) {
  ExposureMeter meter;
  EXPECT_EQ(meter.Key(), 1);
  meter.Add({4, 4, 4}, 1);
  meter.Add({16, 16, 16}, 1);
  meter.Add({0, 0, 0}, 50);
  meter.Add({1e-9, 1e-9, 1e-9}, 50);
  // Bins are a quarter of an octave wide: 2^(1/8) either way.
  EXPECT_GT(meter.Key(), 8 / 1.1);
  EXPECT_LT(meter.Key(), 8 * 1.1);
}

TEST(SrgbTest, EncodesKnownValues) {
  EXPECT_EQ(EncodeSrgb(0), 0);
  EXPECT_EQ(EncodeSrgb(1), 255);
  EXPECT_EQ(EncodeSrgb(0.2140), 127);  // middle grey
}

}  // namespace
}  // namespace enfilade
