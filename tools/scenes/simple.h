// The small scenes. Most are from Willmott & Heckbert 1997, section 3.1, and
// have few polygons; two have a closed form. scenes/*.md give the expected
// values. Each function throws UsageError for a parameter out of its range.

#pragma once

#include <cstdint>

#include "tools/scenes/obj_writer.h"

namespace enfilade {

// Two unit squares face to face, `separation` metres apart: a black emitter
// above (exitance 1 W/m2) and a receiver of reflectance 0.5 below. 2 polygons.
struct ParallelOptions {
  double separation = 1;  // (0, 100]
};

void WriteParallel(const ParallelOptions& options, ObjWriter& out);

// The same two squares at a right angle. The emitter stands upright, parallel
// to an edge of the receiver and `separation` metres away from it. 2 polygons.
struct PerpendicularOptions {
  double separation = 0;  // [0, 100]
};

void WritePerpendicular(const PerpendicularOptions& options, ObjWriter& out);

// A light 0.6 x 0.6, 2 m above a receiver 2 x 2, and between them a blocker
// 0.4 x 0.4, `height` metres above the receiver, reflective on top and black
// below. The umbra vanishes at height 4/3. 3 polygons.
struct BlockerOptions {
  double height = 0.7;  // (0, 2)
};

void WriteBlocker(const BlockerOptions& options, ObjWriter& out);

// A box 2 x 2 x 2 with an open front, a red left and a blue right wall. A light
// 0.5 x 0.5 of exitance 10 / reflectance is set into the ceiling. 9 polygons.
struct BoxOptions {
  double reflectance = 0.5;  // (0, 1)
};

void WriteBox(const BoxOptions& options, ObjWriter& out);

// A tube 0.5 x 0.5 x 8. A black light (exitance 10) closes one end; the other
// end is open. 5 polygons, which make 260 patches of edge 0.25.
struct TubeOptions {
  double reflectance = 0.5;  // [0, 1)
};

void WriteTube(const TubeOptions& options, ObjWriter& out);

// A closed room 4 x 4 x 2.7 with a table, lit by two bulbs of exitance 1000. A
// bulb is a ball of radius 0.03 with 2 n slices around and n from pole to pole,
// 4 n (n - 1) triangles. 36 + 8 n (n - 1) polygons. Not from the paper.
struct BulbsOptions {
  uint32_t slices = 6;  // n, 2 to 1000
};

void WriteBulbs(const BulbsOptions& options, ObjWriter& out);

// A closed room 6 x 5 x 2.8 with a table top, lit by n downlights in rows. A
// downlight is a white tube of eight sides, radius 0.05 and height 0.1, that
// hangs from the ceiling and is open below. A black octahedron of radius 0.02
// and exitance 3000 is in its middle. 12 + 16 n polygons. Not from the paper.
struct DownlightsOptions {
  uint32_t count = 12;  // n, 1 to 400
};

void WriteDownlights(const DownlightsOptions& options, ObjWriter& out);

}  // namespace enfilade
