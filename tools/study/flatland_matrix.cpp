#include "tools/study/flatland_matrix.h"

#include "base/check.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tools/export/file.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

struct Point2 {
  double x = 0;
  double y = 0;
};

double Distance(Point2 a, Point2 b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

// The point at parameter t of the second segment.
Point2 OnOther(FlatlandScene scene, double t) {
  return scene == FlatlandScene::kParallel ? Point2{t, 1} : Point2{0, t};
}

// Numbers in a matrix at equal distance `stride`: a row or a column.
struct Line {
  double* first;
  size_t stride;

  double& operator[](size_t i) const { return first[i * stride]; }
};

// One level of the transform: replaces the first `count` numbers by count / 2
// smooth coefficients followed by count / 2 wavelet coefficients.
void SplitOnce(Line line, size_t count, FlatlandBasis basis) {
  std::vector<double> out(count);
  const size_t half = count / 2;
  for (size_t i = 0; i < half; ++i) {
    out[i] = (line[2 * i] + line[2 * i + 1]) * std::sqrt(0.5);
    if (basis == FlatlandBasis::kHaar) {
      out[half + i] = (line[2 * i] - line[2 * i + 1]) * std::sqrt(0.5);
    }
  }
  for (size_t i = 0; basis == FlatlandBasis::kFlatlets && i < half; i += 2) {
    const double a = line[2 * i];
    const double b = line[2 * i + 1];
    const double c = line[2 * i + 2];
    const double d = line[2 * i + 3];
    out[half + i] = (a - b - c + d) / 2;
    out[half + i + 1] = (a - 3 * b + 3 * c - d) / std::sqrt(20.0);
  }
  for (size_t i = 0; i < count; ++i) {
    line[i] = out[i];
  }
}

Line RowOf(SquareMatrix& matrix, size_t i) {
  return {&matrix.values[i * matrix.size], 1};
}

Line ColumnOf(SquareMatrix& matrix, size_t i) {
  return {&matrix.values[i], matrix.size};
}

}  // namespace

SquareMatrix FlatlandFormFactors(FlatlandScene scene, size_t elements) {
  SquareMatrix matrix{elements, std::vector<double>(elements * elements)};
  const double step = 1.0 / static_cast<double>(elements);
  for (size_t i = 0; i < elements; ++i) {
    const Point2 a = {static_cast<double>(i) * step, 0};
    const Point2 b = {static_cast<double>(i + 1) * step, 0};
    for (size_t j = 0; j < elements; ++j) {
      const Point2 c = OnOther(scene, static_cast<double>(j) * step);
      const Point2 d = OnOther(scene, static_cast<double>(j + 1) * step);
      // The crossed strings less the uncrossed ones. The order of the ends
      // decides which pair is the crossed one, so only the magnitude matters.
      const double strings =
          Distance(a, d) + Distance(b, c) - Distance(a, c) - Distance(b, d);
      matrix.At(i, j) = std::abs(strings) / (2 * step);
    }
  }
  return matrix;
}

SquareMatrix InWaveletBasis(SquareMatrix matrix,
                            FlatlandBasis basis,
                            FlatlandForm form) {
  ENFILADE_CHECK(std::has_single_bit(matrix.size) && matrix.size >= 4,
                 "{} elements",
                 matrix.size);
  const size_t n = matrix.size;
  const size_t least = basis == FlatlandBasis::kHaar ? 2 : 4;
  if (form == FlatlandForm::kStandard) {
    for (size_t i = 0; i < n; ++i) {
      for (size_t count = n; count >= least; count /= 2) {
        SplitOnce(RowOf(matrix, i), count, basis);
      }
    }
    for (size_t i = 0; i < n; ++i) {
      for (size_t count = n; count >= least; count /= 2) {
        SplitOnce(ColumnOf(matrix, i), count, basis);
      }
    }
  } else if (form == FlatlandForm::kNonstandard) {
    for (size_t count = n; count >= least; count /= 2) {
      for (size_t i = 0; i < count; ++i) {
        SplitOnce(RowOf(matrix, i), count, basis);
      }
      for (size_t i = 0; i < count; ++i) {
        SplitOnce(ColumnOf(matrix, i), count, basis);
      }
    }
  }
  return matrix;
}

size_t CountLarge(const SquareMatrix& matrix, double threshold) {
  double largest = 0;
  for (const double v : matrix.values) {
    largest = std::max(largest, std::abs(v));
  }
  return static_cast<size_t>(
      std::count_if(matrix.values.begin(), matrix.values.end(), [&](double v) {
        return std::abs(v) > threshold * largest;
      }));
}

void WriteDots(const SquareMatrix& matrix, const std::filesystem::path& svg) {
  double largest = 0;
  for (const double v : matrix.values) {
    largest = std::max(largest, std::abs(v));
  }
  constexpr double kPixels = 640;
  const double pitch = kPixels / static_cast<double>(matrix.size);
  OutputFile file(svg);
  SectionWriter out(file, 0);
  out.PutText(
      fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" "
                  "height=\"{0}\">\n"
                  "<rect width=\"{0}\" height=\"{0}\" fill=\"white\"/>\n",
                  kPixels));
  for (size_t i = 0; i < matrix.size; ++i) {
    for (size_t j = 0; j < matrix.size; ++j) {
      const double radius =
          0.5 * pitch * std::sqrt(std::abs(matrix.At(i, j)) / largest);
      constexpr double kLeastRadius = 0.1;  // pixels
      if (radius >= kLeastRadius) {
        out.PutText(
            fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" "
                        "r=\"{:.2f}\"/>\n",
                        (static_cast<double>(j) + 0.5) * pitch,
                        (static_cast<double>(i) + 0.5) * pitch,
                        radius));
      }
    }
  }
  out.PutText("</svg>\n");
  out.Flush();
  file.Finish();
}

}  // namespace enfilade
