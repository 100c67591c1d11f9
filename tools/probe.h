// Probe: irradiance at given points, streamed from a CSV file to another.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>

namespace enfilade {

struct ProbeOptions {
  uint64_t seed = 1;

  // Rays over the hemisphere of a point in free space, rounded up to a square.
  uint32_t gather_rays = 4096;

  // Called with the number of points done; may be empty; may throw to stop.
  std::function<void(uint64_t points)> progress;

  // Throws UsageError with what is wrong.
  void Validate() const;
};

struct ProbeSummary {
  uint64_t points = 0;
  uint64_t on_patches = 0;  // answered by the solution itself
  uint64_t gathered = 0;    // free points, by final gathering
  double seconds = 0;
};

// Reads lines `x,y,z,nx,ny,nz[,more]` (metres; the normal need not be of unit
// length) and writes each with `,irradiance_r,irradiance_g,irradiance_b`
// appended, in W/m2 (lux if the scene is photometric), in the same order. A
// first line that does not begin with a number is a header and is kept and
// extended; without one the output has the default header. Empty lines and
// lines that begin with '#' are dropped.
//
// If a point is within 1 mm of a reflecting patch and their normals are within
// 5 degrees, the point gets the solution's irradiance there. Any other point is
// gathered: cosine-weighted rays meet the solution's radiosity, and luminaires
// are sampled as well.
//
// Throws InputError naming `name` and the line for a line that has fewer than
// six numbers, a number that is not finite, or a zero normal; lines before it
// may have been written by then. Throws DiskError if writing fails.
ProbeSummary Probe(const BlockStorage& store,
                   std::istream& points,
                   const std::string& name,
                   std::ostream& out,
                   const ProbeOptions& options,
                   MemoryBudget& budget);

}  // namespace enfilade
