// Radiosity in flatland, between two line segments: form factor matrices in
// wavelet bases, as in S, figures 3 to 5.
//
//   paper                    here
//   G_ij                     matrix entry, of basis functions of norm 1
//   P_0 + Q_0 + ... (eq. 8)  kStandard: all levels of the rows, then all of
//                            the columns
//   P_i G Q_i, Q_i G P_i,    kNonstandard: one level of both, then again of
//   Q_i G Q_i                the smooth quarter (S, section 2.4.8)
//
// Haar has one vanishing moment, the flatlets F2 have two; the functions of
// both are constant on boxes. The functions of F2 extend over four boxes. Its
// smooth functions are constant on pairs of boxes; its wavelets are
// (1,-1,-1,1)/2 and (1,-3,3,-1)/sqrt(20), which are orthogonal to linear
// functions but not to the smooth functions. As in S, only these primal
// functions are used under the integral.

#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace enfilade {

enum class FlatlandScene {
  kParallel,  // unit segments face to face, 1 m apart
  kCorner,    // unit segments at a right angle that share an end
};

enum class FlatlandBasis { kHaar, kFlatlets };

enum class FlatlandForm { kNodal, kStandard, kNonstandard };

struct SquareMatrix {
  size_t size = 0;
  std::vector<double> values;  // [row][column]

  double& At(size_t row, size_t column) { return values[row * size + column]; }

  [[nodiscard]] double At(size_t row, size_t column) const {
    return values[row * size + column];
  }
};

// Exact form factors (Hottel's crossed strings) from each of `elements` equal
// parts of one segment to those of the other.
SquareMatrix FlatlandFormFactors(FlatlandScene scene, size_t elements);

// The matrix in a wavelet basis. Its size must be a power of two, at least 4.
// In rows and columns, smooth functions come first and wavelets of the finest
// level last. Each level of the nonstandard form takes the place of the smooth
// quarter that it was made of.
SquareMatrix InWaveletBasis(SquareMatrix matrix,
                            FlatlandBasis basis,
                            FlatlandForm form);

// How many entries are larger in magnitude than `threshold` times the largest.
size_t CountLarge(const SquareMatrix& matrix, double threshold);

// Draws a dot per entry, with an area proportional to the entry's magnitude;
// dots of a radius below 0.1 pixels are left out. Throws DiskError.
void WriteDots(const SquareMatrix& matrix, const std::filesystem::path& svg);

}  // namespace enfilade
