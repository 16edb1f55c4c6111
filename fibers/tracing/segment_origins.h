#ifndef HEDDLE_FIBERS_TRACING_SEGMENT_ORIGINS_H_
#define HEDDLE_FIBERS_TRACING_SEGMENT_ORIGINS_H_
// Where on a segment its visibility and its indirect light are measured, and how much of the sky it sees.
//
// Khungurn 2017 (section 4.1) measures at the midpoint of the segment's axis. In dense yarns the gaps between fibers are
// narrower than a fiber, and the axis sees far less of the sky than the surface points that an eye can see: measured on
// flat cotton, single scattering by the axis' visibility is 24 % too dark, with 29 % RMSE over views and lights. So we
// measure on the surface, at half the segment's length, on its most exposed side: the direction across the fiber in which
// open sky lies, averaged over points all around and along the segment. Same cost, same storage; 0.5 % and 7 %.
// The figures, and the paper's choice beside ours, are in docs/decisions.md. Tested in
// tests/fibers/tracing/segment_origins_test.cpp.

#include <cstdint>
#include <vector>

#include "fibers/tracing/tile_scene.h"

namespace heddle {

enum class OriginChoice : std::uint8_t {
  kExposed,   // on the surface, most exposed side
  kMidpoint,  // on the axis, as printed
};

struct SegmentOrigins {
  std::vector<Vec3> position;   // [segment] fabric space
  std::vector<float> openness;  // [segment] share of the sky, 0 .. 1, that the segment's surface sees, cosine-weighted
};

/// Sky: the face's hemisphere, or the whole sphere where light comes from both sides. Independent of thread count.
SegmentOrigins find_segment_origins(const TileScene& scene, bool both_sides, OriginChoice choice, std::uint64_t seed);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_TRACING_SEGMENT_ORIGINS_H_
