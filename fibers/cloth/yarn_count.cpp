#include "fibers/cloth/yarn_count.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "fibers/math/vector.h"

namespace heddle {
namespace {

constexpr double kTexTimesNe = 590.54;
constexpr double kTexTimesNm = 1000;
constexpr int kMostPlies = 12;
constexpr double kMostTex = 1e5;

void skip_spaces(std::string_view& text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
}

template <class Number>
std::optional<Number> take_number(std::string_view& text) {
  skip_spaces(text);
  Number value{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc()) return {};
  text.remove_prefix(static_cast<std::size_t>(result.ptr - text.data()));
  skip_spaces(text);
  return value;
}

bool take(std::string_view& text, std::string_view word) {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

/// "/2" or "x2"; 1 where nothing is there.
int take_plies(std::string_view& text, char sign) {
  if (!take(text, std::string_view(&sign, 1))) return 1;
  return take_number<int>(text).value_or(0);
}

}  // namespace

YarnCount parse_yarn_count(std::string_view text) {
  const std::string_view whole = text;
  YarnCount count;
  skip_spaces(text);
  const bool is_ne = take(text, "Ne");
  if (is_ne || take(text, "Nm")) {
    const double number = take_number<double>(text).value_or(0);
    count.ply_tex = (is_ne ? kTexTimesNe : kTexTimesNm) / number;
    count.plies = take_plies(text, '/');
  } else {
    const double number = take_number<double>(text).value_or(0);
    if (take(text, "tex")) {
      count.ply_tex = number;
    } else if (take(text, "dtex")) {
      count.ply_tex = number * kTexPerDtex;
    } else if (take(text, "den")) {
      count.ply_tex = number * kTexPerDenier;
    }
    skip_spaces(text);
    count.plies = take_plies(text, 'x');
  }
  skip_spaces(text);
  if (!text.empty() || !(count.ply_tex > 0 && count.ply_tex <= kMostTex) || count.plies < 1 ||
      count.plies > kMostPlies) {
    throw std::invalid_argument(
        "expected a count such as \"20 tex\", \"167 dtex\", \"75 den\", \"Nm 60\", \"Ne 40\", or "
        "plied "
        "\"Ne 40/2\", \"20 tex x2\", found \"" +
        std::string(whole.substr(0, 40)) + "\"");
  }
  return count;
}

double section_area_mm2(double tex, double density_g_cm3) {
  return 1e-3 * tex / density_g_cm3;
}

double fiber_tex(double radius_mm, double density_g_cm3) {
  return 1e3 * kPi * radius_mm * radius_mm * density_g_cm3;
}

double fiber_radius_mm(double tex, double density_g_cm3) {
  return std::sqrt(section_area_mm2(tex, density_g_cm3) / kPi);
}

}  // namespace heddle
