#ifndef HEDDLE_RENDER_TILE_PREVIEW_H_
#define HEDDLE_RENDER_TILE_PREVIEW_H_
// A picture of the fibers at a glance, in a second or two: one eye ray and one shadow ray per
// sample, no scattered light. It shows the geometry, and colours only roughly. Tested in
// tests/render/tile_preview_test.cpp.

#include <vector>

#include "fibers/math/vector.h"
#include "fibers/tracing/tile_scene.h"

namespace heddle {

/// The face of the cloth seen straight from above, `width_mm` wide and as high; weft to the right,
/// warp upwards, from the tile's origin on. Colour of each of pixels x pixels, rows from the top:
/// the diffusive reflectance of the fiber's color_tt (see dyed_fiber) times a lamp from the upper
/// left, with its highlight and shadow, and darker towards the back. Gaps are black.
std::vector<Rgb> preview_tile(const TileScene& tile, double width_mm, int pixels);

}  // namespace heddle

#endif  // HEDDLE_RENDER_TILE_PREVIEW_H_
