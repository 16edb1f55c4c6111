#include "render/tone_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace heddle {

namespace {

/// Hable's curve without its scales: shoulder 0.15, linear 0.5 at angle 0.1, toe 0.2, 0.02 / 0.3.
double hable(double x) {
  return (x * (0.15 * x + 0.1 * 0.5) + 0.2 * 0.02) / (x * (0.15 * x + 0.5) + 0.2 * 0.3) -
         0.02 / 0.3;
}

constexpr double kHableWhite = 11.2;
/// hable(kGreyScale * 0.18) / hable(kHableWhite) = 0.18
constexpr double kGreyScale = 2.9275228;

std::uint8_t srgb_byte(double linear) {
  const double clipped = std::clamp(linear, 0.0, 1.0);
  const double encoded =
      clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * std::pow(clipped, 1.0 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255.0 * encoded));
}

}  // namespace

double filmic(double linear) {
  return std::min(1.0, hable(kGreyScale * std::max(0.0, linear)) / hable(kHableWhite));
}

std::map<std::string, std::string> ScreenLook::text() const {
  return {{"Software", "heddle"},
          {"heddle.exposure_stops", fmt::format("{}", exposure_stops)},
          {"heddle.transform", std::string(kTransformNames[static_cast<std::size_t>(transform)])}};
}

std::vector<std::uint8_t> tone_map(const std::vector<Rgb>& colors, const ScreenLook& look) {
  const double scale = std::exp2(look.exposure_stops);
  const bool is_filmic = look.transform == ScreenTransform::kFilmic;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(3 * colors.size());
  for (const Rgb& color : colors) {
    for (int c = 0; c < 3; ++c) {
      const double exposed = scale * static_cast<double>(color[c]);
      bytes.push_back(srgb_byte(is_filmic ? filmic(exposed) : exposed));
    }
  }
  return bytes;
}

}  // namespace heddle
