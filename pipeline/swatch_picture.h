#ifndef HEDDLE_PIPELINE_SWATCH_PICTURE_H_
#define HEDDLE_PIPELINE_SWATCH_PICTURE_H_
// Pictures of a fabric without a scene: a shaded preview of its tile, and a path-traced swatch on a
// table under a lamp and a soft light. Tested in tests/pipeline/swatch_picture_test.cpp.

#include <filesystem>
#include <functional>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/tracing/tile_scene.h"
#include "render/lights.h"

namespace heddle {

/// A lamp and a soft light, under which a white surface shows about 0.8. They are soft, so that
/// paths find them by escaping: as little noise as with shadow rays, and 2.7 times as many paths in
/// the same time (white cotton). With both_sides, one more from below.
std::vector<Light> swatch_lights(bool both_sides);

struct SwatchView {
  double width_mm = 0;
  int pixels = 256;
  int spp = 16;
};

/// Flat cloth without end, seen 30 degrees off its normal, on a black table. Cloth that light
/// passes (both_sides) hangs before a bright sky instead.
std::vector<Rgb> trace_swatch(const TileScene& tile, bool both_sides, const SwatchView& view,
                              std::uint64_t seed, const std::function<void(double)>& progress);

/// Writes colours of pixels x pixels as a PNG, atomically.
void write_swatch(const std::filesystem::path& path, const std::vector<Rgb>& colors, int pixels);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_SWATCH_PICTURE_H_
