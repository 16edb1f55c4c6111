#ifndef HEDDLE_RENDER_TONE_MAP_H_
#define HEDDLE_RENDER_TONE_MAP_H_
// Scene-linear colours to 8-bit sRGB (IEC 61966-2-1): scaled by 2^exposure, clipped at 1, transfer
// curve, rounded. Tested in tests/render/tone_map_test.cpp.

#include <cstdint>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

/// [pixel][3] bytes.
std::vector<std::uint8_t> tone_map(const std::vector<Rgb>& colors, double exposure_stops);

}  // namespace heddle

#endif  // HEDDLE_RENDER_TONE_MAP_H_
