// Radiosity in flatland, between two line segments: form factor matrices in
// wavelet bases, as S shows them (figures 3 to 5).
//
//   paper                    here
//   G_ij                     matrix entry, of basis functions of norm 1
//   P_0 + Q_0 + ... (eq. 8)  kStandard: all levels of the rows, then all of
//                            the columns
//   P_i G Q_i, Q_i G P_i,    kNonstandard: one level of both, then again of
//   Q_i G Q_i                the smooth quarter (S, section 2.4.8)
//
// Haar has one vanishing moment, the flatlets F2 two; both are constant on
// boxes. F2 is of four boxes: its smooth functions are pairs of them, its
// wavelets (1,-1,-1,1)/2 and (1,-3,3,-1)/sqrt(20), which are orthogonal to
// linear functions but not to its smooth functions: S keeps only these primal
// functions under the integral, and so does this.

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

// The matrix in a wavelet basis. Requires a size that is a power of two, at
// least 4. Smooth functions come first in rows and columns, wavelets of the
// finest level last; nonstandard blocks stand where the quarters were that they
// were made of.
SquareMatrix InWaveletBasis(SquareMatrix matrix,
                            FlatlandBasis basis,
                            FlatlandForm form);

// How many entries are larger than `threshold` times the largest.
size_t CountLarge(const SquareMatrix& matrix, double threshold);

// A dot per entry, its area as the entry's size. Throws DiskError.
void WriteDots(const SquareMatrix& matrix, const std::filesystem::path& svg);

}  // namespace enfilade
