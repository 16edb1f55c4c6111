#include "render/tone_map.h"

#include <algorithm>
#include <cmath>

namespace heddle {

namespace {

std::uint8_t srgb_byte(double linear) {
  const double clipped = std::clamp(linear, 0.0, 1.0);
  const double encoded =
      clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * std::pow(clipped, 1.0 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255.0 * encoded));
}

}  // namespace

std::vector<std::uint8_t> tone_map(const std::vector<Rgb>& colors, double exposure_stops) {
  const double scale = std::exp2(exposure_stops);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(3 * colors.size());
  for (const Rgb& color : colors) {
    for (int c = 0; c < 3; ++c) bytes.push_back(srgb_byte(scale * static_cast<double>(color[c])));
  }
  return bytes;
}

}  // namespace heddle
