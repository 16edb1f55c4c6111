#include "fibers/cloth/weave.h"

#include <charconv>
#include <numeric>
#include <stdexcept>

namespace heddle {
namespace {

// "A/B" as two integers in [1, 64], or false.
bool parse_pair(std::string_view text, int& a, int& b) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return false;
  auto whole_number = [](std::string_view t, int& out) {
    const auto result = std::from_chars(t.data(), t.data() + t.size(), out);
    return result.ec == std::errc() && result.ptr == t.data() + t.size() && out >= 1 && out <= 64;
  };
  return whole_number(text.substr(0, slash), a) && whole_number(text.substr(slash + 1), b);
}

}  // namespace

Weave parse_weave(std::string_view notation, WeaveFace face) {
  Weave weave;
  weave.notation = std::string(notation);
  int a = 0;
  int b = 0;
  int ups = 0;  // warp-up crossings per pick, at the start of the pattern
  if (notation == "plain") {
    ups = 1;
    weave.ends = 2;
  } else if (notation.starts_with("twill ") && parse_pair(notation.substr(6), a, b)) {
    ups = a;
    weave.ends = a + b;
  } else if (notation.starts_with("satin ") && parse_pair(notation.substr(6), a, b)) {
    if (a < 5 || b < 2 || b > a - 2 || std::gcd(a, b) != 1) {
      throw std::invalid_argument(
          "a satin of n ends with step s needs n >= 5, 2 <= s <= n - 2, n and s without common "
          "divisor, such as "
          "\"satin 5/2\" or \"satin 8/3\"");
    }
    weave.ends = a;
    weave.step = b;
    ups = face == WeaveFace::kWarp ? a - 1 : 1;
  } else {
    throw std::invalid_argument("expected \"plain\", \"twill UP/DOWN\" or \"satin ENDS/STEP\"");
  }
  weave.face = 2 * ups >= weave.ends ? WeaveFace::kWarp : WeaveFace::kWeft;
  weave.picks = weave.ends;
  for (int pick = 0; pick < weave.picks; ++pick) {
    for (int end = 0; end < weave.ends; ++end) {
      const int place = ((end - pick * weave.step) % weave.ends + weave.ends) % weave.ends;
      weave.warp_up.push_back(place < ups ? 1 : 0);
    }
  }
  return weave;
}

}  // namespace heddle
