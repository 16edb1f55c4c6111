#include "fibers/cloth/weave.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <numeric>
#include <stdexcept>

namespace heddle {
namespace {

constexpr const char* kNotations =
    "expected \"plain\", \"warp rib N/M\", \"weft rib N/M\", \"basket N/M\", \"twill UP/DOWN\", "
    "\"herringbone UP/DOWN\", \"pointed UP/DOWN\", \"satin ENDS/STEP\" or \"UP/DOWN satin\"";

// "A/B/..." as integers of at least 1 that add up to at most kMaxWeaveExtent; empty if it is
// nothing of the kind.
std::vector<int> parse_numbers(std::string_view text) {
  std::vector<int> numbers;
  int sum = 0;
  for (;;) {
    const std::size_t slash = std::min(text.find('/'), text.size());
    int number = 0;
    const auto result = std::from_chars(text.data(), text.data() + slash, number);
    if (result.ec != std::errc() || result.ptr != text.data() + slash || number < 1 ||
        number > kMaxWeaveExtent || (sum += number) > kMaxWeaveExtent)
      return {};
    numbers.push_back(number);
    if (slash == text.size()) return numbers;
    text.remove_prefix(slash + 1);
  }
}

// The numbers after `word`; empty if the notation is another.
std::vector<int> numbers_after(std::string_view notation, std::string_view word) {
  if (!notation.starts_with(word)) return {};
  return parse_numbers(notation.substr(word.size()));
}

void fill(Weave& weave, int ends, int picks, const std::function<bool(int, int)>& is_up) {
  weave.ends = ends;
  weave.picks = picks;
  weave.warp_up.reserve(static_cast<std::size_t>(ends) * static_cast<std::size_t>(picks));
  for (int pick = 0; pick < picks; ++pick) {
    for (int end = 0; end < ends; ++end) weave.warp_up.push_back(is_up(end, pick) ? 1 : 0);
  }
  find_face(weave);
}

bool is_counter(int step, int ends) {
  return ends >= 5 && step >= 2 && step <= ends - 2 && std::gcd(ends, step) == 1;
}

// A crossing of one shaft of a twill or satin: `pattern` moves by `step` from pick to pick.
bool up_on_shaft(const std::vector<std::uint8_t>& pattern, int shaft, int pick, int step) {
  const auto shafts = static_cast<std::int64_t>(pattern.size());
  const std::int64_t place = (shaft - static_cast<std::int64_t>(pick) * step) % shafts;
  return pattern[static_cast<std::size_t>((place + shafts) % shafts)] != 0;
}

void fill_satin(Weave& weave, int ups, int ends, int step) {
  if (!is_counter(step, ends)) {
    throw std::invalid_argument(
        "a satin of n ends with step s needs n >= 5, 2 <= s <= n - 2, n and s without common "
        "divisor, such as \"satin 5/2\" or \"satin 8/3\"");
  }
  std::vector<std::uint8_t> pattern(static_cast<std::size_t>(ends), 0);
  std::fill_n(pattern.begin(), ups, std::uint8_t{1});
  fill(weave, ends, ends, [&](int end, int pick) { return up_on_shaft(pattern, end, pick, step); });
}

// Shaft of each end of a herringbone or a point, which runs up for `width` ends and down again.
std::vector<int> turning_shafts(bool pointed, int width, int shafts) {
  std::vector<int> of_end;
  for (int end = 0; end < width; ++end) of_end.push_back(end);
  // A herringbone goes on half a repeat away from where it stopped, so that warp meets weft.
  const int top = pointed ? width : width - 1 + shafts / 2;
  for (int end = 0; end < width; ++end) of_end.push_back(top - end);
  return of_end;
}

void fill_twill(Weave& weave, std::string_view kind, const std::vector<int>& runs,
                const WeaveChoices& choices) {
  if (runs.size() % 2 != 0) {
    throw std::invalid_argument(
        "a twill needs an even number of counts, up and down in turn, such as \"twill 2/2\" or "
        "\"twill 3/1/1/2\"");
  }
  std::vector<std::uint8_t> pattern;
  for (std::size_t k = 0; k < runs.size(); ++k)
    pattern.insert(pattern.end(), static_cast<std::size_t>(runs[k]), k % 2 == 0 ? 1 : 0);
  const auto shafts = static_cast<int>(pattern.size());
  const int step = choices.step.value_or(1);
  if (step < 1 || step >= shafts) {
    throw std::invalid_argument(
        fmt::format("a twill of {} ends needs a step from 1 to {}", shafts, shafts - 1));
  }
  std::vector<int> shaft_of;
  if (kind == "twill ") {
    for (int end = 0; end < shafts; ++end) shaft_of.push_back(end);
  } else {
    if (choices.width < 2 || choices.width > kMaxWeaveExtent / 2) {
      throw std::invalid_argument(
          fmt::format("expected a width from 2 to {}, the ends after which "
                      "the twill turns",
                      kMaxWeaveExtent / 2));
    }
    shaft_of = turning_shafts(kind == "pointed ", choices.width, shafts);
  }
  if (choices.direction == TwillDirection::kS) std::reverse(shaft_of.begin(), shaft_of.end());
  fill(weave, static_cast<int>(shaft_of.size()), shafts / std::gcd(shafts, step),
       [&](int end, int pick) {
         return up_on_shaft(pattern, shaft_of[static_cast<std::size_t>(end)], pick, step);
       });
}

}  // namespace

void find_face(Weave& weave) {
  const auto ups = std::count(weave.warp_up.begin(), weave.warp_up.end(), std::uint8_t{1});
  weave.face = 2 * static_cast<std::size_t>(ups) >= weave.warp_up.size() ? WeaveFace::kWarp
                                                                         : WeaveFace::kWeft;
}

Weave parse_weave(std::string_view notation, WeaveFace face, const WeaveChoices& choices) {
  Weave weave;
  weave.notation = std::string(notation);
  if (notation == "plain") {
    fill(weave, 2, 2, [](int end, int pick) { return end == pick; });
    return weave;
  }
  const auto pair_after = [&](std::string_view word) {
    std::vector<int> numbers = numbers_after(notation, word);
    return numbers.size() == 2 ? numbers : std::vector<int>();
  };
  if (const auto n = pair_after("warp rib "); !n.empty()) {
    fill(weave, 2, n[0] + n[1], [&](int end, int pick) { return (pick < n[0]) == (end == 0); });
  } else if (const auto m = pair_after("weft rib "); !m.empty()) {
    // The weft is over where the warp is not.
    fill(weave, m[0] + m[1], 2, [&](int end, int pick) { return (end < m[0]) != (pick == 0); });
  } else if (const auto b = pair_after("basket "); !b.empty()) {
    fill(weave, b[0] + b[1], b[0] + b[1],
         [&](int end, int pick) { return (end < b[0]) == (pick < b[0]); });
  } else if (const auto s = pair_after("satin "); !s.empty()) {
    fill_satin(weave, face == WeaveFace::kWarp ? s[0] - 1 : 1, s[0], s[1]);
  } else if (notation.ends_with(" satin")) {
    const std::vector<int> shares = parse_numbers(notation.substr(0, notation.size() - 6));
    if (shares.size() != 2) throw std::invalid_argument(kNotations);
    const int ends = shares[0] + shares[1];
    int step = choices.step.value_or(2);
    while (!choices.step && step < ends && !is_counter(step, ends)) ++step;
    fill_satin(weave, shares[0], ends, step);
  } else {
    for (const std::string_view kind : {"twill ", "herringbone ", "pointed "}) {
      const std::vector<int> runs = numbers_after(notation, kind);
      if (runs.size() < 2) continue;
      fill_twill(weave, kind, runs, choices);
      return weave;
    }
    throw std::invalid_argument(kNotations);
  }
  return weave;
}

Weave parse_weave_matrix(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  std::vector<std::string_view> rows;
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
    if (text.empty()) break;
    rows.push_back(text.substr(0, text.find_first_of(kBlank)));
    text.remove_prefix(rows.back().size());
  }
  const std::size_t ends = rows.empty() ? 0 : rows[0].size();
  if (rows.empty() || rows.size() > kMaxWeaveExtent || ends > kMaxWeaveExtent) {
    throw std::invalid_argument(
        fmt::format("expected 1 to {0} rows of 1 to {0} crossings", kMaxWeaveExtent));
  }
  Weave weave;
  weave.notation = "matrix";
  weave.ends = static_cast<int>(ends);
  weave.picks = static_cast<int>(rows.size());
  weave.warp_up.reserve(ends * rows.size());
  for (std::size_t row = rows.size(); row-- > 0;) {
    if (rows[row].size() != ends || rows[row].find_first_not_of("01") != std::string_view::npos) {
      throw std::invalid_argument(
          fmt::format("row {} from the top: expected {} crossings, as in the row at the top, each "
                      "0 (weft on top) or 1 (warp on top), such as \"10 01\": rows of equal length",
                      row + 1, ends));
    }
    for (const char crossing : rows[row]) weave.warp_up.push_back(crossing == '1' ? 1 : 0);
  }
  find_face(weave);
  return weave;
}

}  // namespace heddle
