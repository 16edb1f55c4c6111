#ifndef HEDDLE_PRECOMPUTE_SEGMENT_CELLS_H_
#define HEDDLE_PRECOMPUTE_SEGMENT_CELLS_H_
// Which segments share a transfer matrix.
//
// Khungurn 2017 (section 4.2) cuts the tile into equal cubes. A shared matrix costs accuracy by the
// spread of its segments, as far as an eye sees them. Half of all cubes hold fibers that hardly any
// eye sees.
//
// So here cells are the leaves of a tree. It starts from all segments. The cell with the largest
// spread is cut in two, across the direction of its spread, until there are as many cells as cubes
// would have been. Spread is the sum over segments of openness times the squared distance from
// their mean. Distance is in position and (scaled) in the direction of the exposed side, since the
// two flanks of a yarn see different fibers. Deterministic; O(segments log cells). Tested in
// tests/precompute/segment_cells_test.cpp.

#include <cstdint>
#include <vector>

#include "fibers/cloth/exemplar.h"
#include "fibers/tracing/segment_origins.h"

namespace heddle {

struct SegmentCells {
  std::vector<std::uint32_t> cell_of_segment;  // [segment]
  std::uint32_t count = 0;                     // every cell has a segment
};

/// As many cells as cubes of this edge (in whole numbers along the tile) would hold midpoints of
/// segments.
SegmentCells make_segment_cells(const Exemplar& exemplar, const SegmentOrigins& origins,
                                float edge_mm);

}  // namespace heddle

#endif  // HEDDLE_PRECOMPUTE_SEGMENT_CELLS_H_
