// The small scenes, most of Willmott & Heckbert 1997, section 3.1, with few
// polygons and, for two of them, a closed form: see scenes/*.md for expected
// values. Each throws UsageError for a parameter out of its range.

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

// The same at a right angle: the emitter stands `separation` metres beside an
// edge of the receiver, parallel to it. 2 polygons.
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

// A box 2 x 2 x 2 with an open front, red left and blue right wall, and a light
// 0.5 x 0.5 let into the ceiling, its exitance 10 / reflectance. 9 polygons.
struct BoxOptions {
  double reflectance = 0.5;  // (0, 1)
};

void WriteBox(const BoxOptions& options, ObjWriter& out);

// A tube 0.5 x 0.5 x 8: a black light (exitance 10) closes one end, the other
// is open. 5 polygons, 260 patches of edge 0.25.
struct TubeOptions {
  double reflectance = 0.5;  // [0, 1)
};

void WriteTube(const TubeOptions& options, ObjWriter& out);

// A closed room 4 x 4 x 2.7 with a table, lit by two bulbs: balls of radius
// 0.03 in 2 n slices around and n from pole to pole, 4 n (n - 1) triangles
// each, exitance 1000. 36 + 8 n (n - 1) polygons. Not of the paper.
struct BulbsOptions {
  uint32_t slices = 6;  // n, 2 to 1000
};

void WriteBulbs(const BulbsOptions& options, ObjWriter& out);

// A closed room 6 x 5 x 2.8 with a table top, lit by n downlights in rows:
// white tubes of eight sides, radius 0.05 and 0.1 high, that hang from the
// ceiling and are open below, with a black octahedron of radius 0.02 and
// exitance 3000 in the middle of each. 12 + 16 n polygons. Not of the paper.
struct DownlightsOptions {
  uint32_t count = 12;  // n, 1 to 400
};

void WriteDownlights(const DownlightsOptions& options, ObjWriter& out);

}  // namespace enfilade
