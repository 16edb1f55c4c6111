#ifndef HEDDLE_RENDER_TONE_MAP_H_
#define HEDDLE_RENDER_TONE_MAP_H_
// Scene-linear colours to 8-bit sRGB: scaled by 2^exposure, made fit for a screen, then the
// transfer curve of IEC 61966-2-1, rounded. Each colour channel on its own. What is fit for a
// screen:
//   srgb    clipped at 1
//   filmic  the curve of Hable 2010 ("Filmic tonemapping operators") with its published constants,
//           in place of the clip. Its input is scaled so that middle grey, 0.18, stays 0.18. White
//           is then at 3.83 (4.4 stops above middle grey) and not at 1.
// Tested in tests/render/tone_map_test.cpp.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

enum class ScreenTransform : std::uint8_t { kSrgb, kFilmic };
inline constexpr std::string_view kTransformNames[] = {"srgb", "filmic"};

/// How a picture becomes one for the screen.
struct ScreenLook {
  double exposure_stops = 0;
  ScreenTransform transform = ScreenTransform::kSrgb;

  bool operator==(const ScreenLook&) const = default;
  /// What a PNG says of itself.
  std::map<std::string, std::string> text() const;
};

/// [pixel][3] bytes.
std::vector<std::uint8_t> tone_map(const std::vector<Rgb>& colors, const ScreenLook& look);

/// The filmic curve, from scene-linear to linear in [0, 1].
double filmic(double linear);

}  // namespace heddle

#endif  // HEDDLE_RENDER_TONE_MAP_H_
