#ifndef HEDDLE_FORMATS_SRGB_COLOR_H_
#define HEDDLE_FORMATS_SRGB_COLOR_H_
// Colours as people write them, as linear rgb (IEC 61966-2-1). Tested in
// tests/formats/toml_table_test.cpp.

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>

namespace heddle {

/// A value of the sRGB transfer curve, 0 .. 1, as linear light.
inline double linear_of_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// "#rrggbb" as bytes; nothing where the text is not one.
inline std::optional<std::array<std::uint8_t, 3>> bytes_of_hex(std::string_view text) {
  if (text.size() != 7 || text[0] != '#') return {};
  std::array<std::uint8_t, 3> bytes{};
  for (std::size_t i = 0; i < 3; ++i) {
    const char* first = text.data() + 1 + 2 * i;
    const auto result = std::from_chars(first, first + 2, bytes[i], 16);
    if (result.ec != std::errc() || result.ptr != first + 2) return {};
  }
  return bytes;
}

/// "#rrggbb" as linear rgb; nothing where the text is not one.
inline std::optional<std::array<double, 3>> color_of_hex(std::string_view text) {
  const auto bytes = bytes_of_hex(text);
  if (!bytes) return {};
  std::array<double, 3> color{};
  for (std::size_t i = 0; i < 3; ++i) color[i] = linear_of_srgb((*bytes)[i] / 255.0);
  return color;
}

}  // namespace heddle

#endif  // HEDDLE_FORMATS_SRGB_COLOR_H_
