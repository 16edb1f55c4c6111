#ifndef HEDDLE_FIBERS_TRACING_SEGMENT_ORIGINS_H_
#define HEDDLE_FIBERS_TRACING_SEGMENT_ORIGINS_H_
// Where on a segment its visibility and its indirect light are measured, and how much of the sky it
// sees.
//
// Khungurn 2017 (section 4.1) measures at the midpoint of the segment's axis. In dense yarns the
// gaps between fibers are narrower than a fiber. The axis then sees far less of the sky than the
// surface points that an eye can see. On flat cotton, single scattering by the axis' visibility is
// 24 % too dark, with 29 % RMSE over views and lights.
//
// So we measure just under the surface, at half the segment's length, on its most exposed side.
// That is the direction across the fiber in which open sky lies, averaged over points all around
// and along the segment. It has the same cost and storage, and errors of 0.5 % and 7 %. The
// figures, and the paper's choice beside ours, are in docs/decisions.md. Tested in
// tests/fibers/tracing/segment_origins_test.cpp.

#include <cstdint>
#include <vector>

#include "fibers/tracing/tile_scene.h"

namespace heddle {

enum class OriginChoice : std::uint8_t {
  kExposed,   // just under the surface, most exposed side
  kMidpoint,  // on the axis, as printed
};

// Distance of the exposed origin from the axis, in radii. An eye sees the flanks of a fiber too,
// which lie deeper than its most exposed side. Single scattering on flat gabardine, 41 views x 12
// lights, in % of all light:
//   radii   1      0.9    0.8    0.5
//   mean    +3.7   +1.3   -1.5   -11
//   RMSE    3.5    2.4    1.6    2.0
inline constexpr float kExposedDepth = 0.8F;

struct SegmentOrigins {
  std::vector<Vec3> position;  // [segment] fabric space
  // [segment] share of the sky, 0 .. 1, that the segment's surface sees, cosine-weighted
  std::vector<float> openness;
};

/// Sky: the face's hemisphere, or the whole sphere where light comes from both sides. Independent
/// of thread count.
SegmentOrigins find_segment_origins(const TileScene& scene, bool both_sides, OriginChoice choice,
                                    std::uint64_t seed);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_TRACING_SEGMENT_ORIGINS_H_
