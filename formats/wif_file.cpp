#include "formats/wif_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "formats/atomic_file.h"
#include "formats/input_error.h"
#include "formats/utf8_text.h"

namespace heddle {
namespace {

constexpr std::size_t kMaxDraftBytes = std::size_t{1} << 26;
// The largest draft has some 40,000; private sections may have more.
constexpr std::size_t kMaxDraftLines = 1'000'000;
// What [WARP] and [WEFT] may claim; only threads that are used are kept.
constexpr int kMaxClaimedThreads = 1'000'000;
constexpr std::size_t kMaxWarnings = 30;
constexpr double kMmPerInch = 25.4;
constexpr std::string_view kBlanks = " \t\v\f";

using Color = std::array<double, 3>;

struct WifEntry {
  std::string_view key;
  std::string_view value;
  std::size_t line;
};

struct WifSection {
  std::size_t line = 0;  // of its first heading; 0: there is none
  std::vector<WifEntry> entries;
};

std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return result;
}

// Numbers and booleans may have a comment behind them.
std::string_view without_comment(std::string_view value) {
  return trimmed(value.substr(0, value.find(';')));
}

/// A table of bits: which shafts each treadle, pick or end takes.
class ShaftSets {
 public:
  ShaftSets(const std::vector<std::vector<int>>& lists, int shafts)
      : words_(static_cast<std::size_t>(shafts) / 64 + 1), bits_(lists.size() * words_, 0) {
    for (std::size_t row = 0; row < lists.size(); ++row) {
      for (const int shaft : lists[row])
        bits_[row * words_ + static_cast<std::size_t>(shaft) / 64] |= std::uint64_t{1}
                                                                      << (shaft % 64);
    }
  }
  /// The union of the sets that each list names, counted from 1.
  static ShaftSets united(const ShaftSets& sets, const std::vector<std::vector<int>>& lists) {
    ShaftSets result({}, 0);
    result.words_ = sets.words_;
    result.bits_.assign(lists.size() * sets.words_, 0);
    for (std::size_t row = 0; row < lists.size(); ++row) {
      for (const int member : lists[row]) {
        const auto from = static_cast<std::size_t>(member - 1) * sets.words_;
        for (std::size_t w = 0; w < sets.words_; ++w)
          result.bits_[row * sets.words_ + w] |= sets.bits_[from + w];
      }
    }
    return result;
  }
  bool meets(std::size_t row, const ShaftSets& other, std::size_t other_row) const {
    for (std::size_t w = 0; w < words_; ++w) {
      if ((bits_[row * words_ + w] & other.bits_[other_row * words_ + w]) != 0) return true;
    }
    return false;
  }
  friend bool operator==(const ShaftSets&, const ShaftSets&) = default;

 private:
  std::size_t words_;
  std::vector<std::uint64_t> bits_;  // [row][word]
};

class WifReader {
 public:
  WifReader(std::string_view bytes, const std::string& name) : name_(name) { split(bytes); }

  WifDraft read(std::optional<bool> rising_shed) {
    for (const char* required : {"wif", "weaving", "warp", "weft", "threading"}) {
      if (section(required).line == 0)
        fail(0, fmt::format("expected a section [{}]", upper_case(required)));
    }
    if (const WifEntry* title = find("text", "title")) draft_.title = utf8_of(title->value);
    read_shed(rising_shed);
    draft_.shafts = integer("weaving", "shafts", 1, kMaxDraftThreads);
    read_plan();
    draw_down();
    read_palette();
    read_threads("warp", draft_.ends(), draft_.warp);
    read_threads("weft", draft_.picks(), draft_.weft);
    for (const WifEntry& entry : section("contents").entries) {
      const std::string listed = lower_case(entry.key);
      if (is_known(listed) && section(listed).line == 0 && truth(entry))
        warn(entry.line, fmt::format("[{}] is listed and missing", upper_case(listed)));
    }
    return std::move(draft_);
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& message) const {
    const std::string place = line == 0 ? "" : fmt::format(":{}", line);
    throw FileError(fmt::format("{}{}: {}", name_, place, message));
  }
  void warn(std::size_t line, const std::string& message) {
    if (draft_.warnings.size() == kMaxWarnings)
      draft_.warnings.push_back("more warnings are left out");
    if (draft_.warnings.size() > kMaxWarnings) return;
    draft_.warnings.push_back(fmt::format("{}:{}: {}", name_, line, message));
  }

  static std::string upper_case(std::string text) {
    for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    return text;
  }

  static bool is_known(const std::string& section) {
    static constexpr std::string_view kSections[] = {
        "wif",          "contents",       "weaving",       "warp",        "weft",
        "text",         "threading",      "tieup",         "treadling",   "liftplan",
        "warp colors",  "color palette",  "color table",   "weft colors", "warp spacing",
        "weft spacing", "warp thickness", "weft thickness"};
    return std::find(std::begin(kSections), std::end(kSections), section) != std::end(kSections);
  }

  // --- lines

  void split(std::string_view bytes) {
    if (bytes.size() > kMaxDraftBytes)
      fail(0, fmt::format("{} bytes; a draft has at most {}", bytes.size(), kMaxDraftBytes));
    if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
    WifSection* section = nullptr;  // none yet, or one that is skipped
    bool is_text = true;
    bool before_any = true;
    for (std::size_t line = 1; !bytes.empty(); ++line) {
      const std::size_t end = std::min(bytes.find_first_of("\r\n"), bytes.size());
      const std::string_view whole = bytes.substr(0, end);
      bytes.remove_prefix(bytes.substr(end).starts_with("\r\n") ? end + 2
                                                                : std::min(end + 1, bytes.size()));
      if (line > kMaxDraftLines)
        fail(line, fmt::format("a draft has at most {} lines", kMaxDraftLines));
      if (whole.find('\0') != std::string_view::npos) fail(line, "expected text, found a byte 0");
      const std::string_view text = trimmed(whole);
      if (text.empty() || text.front() == ';') continue;
      if (text.front() == '[' && is_heading(text, line, is_text)) {
        const std::string title = lower_case(trimmed(text.substr(1, text.find(']') - 1)));
        before_any = false;
        section = is_known(title) ? &sections_[title] : nullptr;
        is_text = section == nullptr || title == "text";
        if (section == nullptr) continue;
        if (section->line != 0)
          warn(line, fmt::format("[{}] comes twice", upper_case(title)));
        else
          section->line = line;
        continue;
      }
      if (before_any) warn(line, "text before the first section is left out");
      if (section == nullptr) continue;
      const std::size_t sign = text.find('=');
      if (sign == std::string_view::npos) {
        if (!is_text)
          warn(line, fmt::format("left out: expected KEY=VALUE, found {}", quoted_excerpt(text)));
        continue;
      }
      section->entries.push_back(
          {trimmed(text.substr(0, sign)), trimmed(text.substr(sign + 1)), line});
    }
  }

  // A line that begins with '['. In text it may be anything.
  bool is_heading(std::string_view text, std::size_t line, bool is_text) const {
    const std::size_t close = text.find(']');
    if (close != std::string_view::npos && without_comment(text.substr(close + 1)).empty())
      return true;
    if (is_text && !sections_.empty()) return false;
    fail(line, fmt::format("expected [SECTION] alone on its line, found {}", quoted_excerpt(text)));
  }

  const WifSection& section(const std::string& name) const {
    static const WifSection none;
    const auto found = sections_.find(name);
    return found == sections_.end() ? none : found->second;
  }

  const WifEntry* find(const std::string& name, std::string_view key) {
    const WifEntry* first = nullptr;
    for (const WifEntry& entry : section(name).entries) {
      if (lower_case(entry.key) != key) continue;
      if (first == nullptr) {
        first = &entry;
      } else if (entry.value != first->value) {
        warn(entry.line,
             fmt::format("'{}' is stated on line {} already, which holds", key, first->line));
      }
    }
    return first;
  }

  // --- values

  std::optional<long long> parse_integer(std::string_view text) const {
    if (text.starts_with('+')) text.remove_prefix(1);
    long long value = 0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || result.ec != std::errc() || result.ptr != text.data() + text.size())
      return {};
    return value;
  }

  int checked_integer(std::size_t line, std::string_view text, const std::string& what, int min,
                      int max) const {
    const std::optional<long long> value = parse_integer(trimmed(text));
    if (!value || *value < min || *value > max) {
      fail(line, fmt::format("expected {} from {} to {}, found {}", what, min, max,
                             quoted_excerpt(trimmed(text))));
    }
    return static_cast<int>(*value);
  }

  int integer(const std::string& name, std::string_view key, int min, int max) {
    const WifEntry* entry = find(name, key);
    if (entry == nullptr)
      fail(section(name).line, fmt::format("[{}]: expected a key '{}'", upper_case(name), key));
    return checked_integer(entry->line, without_comment(entry->value), "'" + std::string(key) + "'",
                           min, max);
  }

  /// "a, b, ..." as integers; a blank value is none.
  std::vector<int> integers(const WifEntry& entry, const std::string& what, int min,
                            int max) const {
    std::vector<int> values;
    std::string_view rest = without_comment(entry.value);
    while (!rest.empty()) {
      const std::size_t comma = rest.find(',');
      values.push_back(checked_integer(entry.line, rest.substr(0, comma), what, min, max));
      if (comma == std::string_view::npos) break;
      rest.remove_prefix(comma + 1);
    }
    return values;
  }

  bool truth(const WifEntry& entry) const {
    const std::string value = lower_case(without_comment(entry.value));
    for (const char* word : {"true", "on", "yes", "1"}) {
      if (value == word) return true;
    }
    for (const char* word : {"false", "off", "no", "0", ""}) {
      if (value == word) return false;
    }
    fail(entry.line, fmt::format("expected true, on, yes, 1, false, off, no or 0, found {}",
                                 quoted_excerpt(value)));
  }

  bool is_listed(std::string_view name) {
    const WifEntry* entry = find("contents", name);
    return entry != nullptr && truth(*entry);
  }

  // --- the plan

  void read_shed(std::optional<bool> asked) {
    const WifEntry* entry = find("weaving", "rising shed");
    const bool stated = entry != nullptr && truth(*entry);
    if (entry == nullptr && !asked) {
      warn(section("weaving").line,
           "no 'Rising Shed': a sinking shed by the standard, though many programs mean a rising "
           "one; rising_shed in the config settles it");
    }
    draft_.rising_shed = asked.value_or(stated);
  }

  /// [index] the numbers from 1 to `most` that stand behind each index from 1 to `count`.
  std::vector<std::vector<int>> lists(const std::string& name, int count, const std::string& item,
                                      const std::string& member, int most) {
    std::vector<std::vector<int>> result;
    std::vector<std::size_t> line_of;
    for (const WifEntry& entry : section(name).entries) {
      const int index =
          checked_integer(entry.line, entry.key, "the number of a " + item, 1, kMaxClaimedThreads);
      std::vector<int> values = integers(entry, "the number of a " + member, 0, most);
      std::sort(values.begin(), values.end());
      values.erase(std::unique(values.begin(), values.end()), values.end());
      std::erase(values, 0);
      if (index > count) {
        if (!values.empty()) fail(entry.line, fmt::format("{} {} of {}", item, index, count));
        continue;
      }
      if (values.empty()) continue;
      if (index > kMaxDraftThreads) {
        fail(entry.line, fmt::format("{} {}: a draft has at most {} x {} threads", item, index,
                                     kMaxDraftThreads, kMaxDraftThreads));
      }
      const auto at = static_cast<std::size_t>(index) - 1;
      if (result.size() <= at) {
        result.resize(at + 1);
        line_of.resize(at + 1, 0);
      }
      if (line_of[at] != 0) {
        if (result[at] != values)
          warn(entry.line, fmt::format("{} {} is stated on line {} already, which holds", item,
                                       index, line_of[at]));
        continue;
      }
      line_of[at] = entry.line;
      result[at] = std::move(values);
    }
    return result;
  }

  void warn_of_unused(const std::string& system, const std::string& item, std::size_t used,
                      int claimed) {
    if (used < static_cast<std::size_t>(claimed)) {
      warn(section(system).line,
           fmt::format("{} of {} {}s are used; the others are left out", used, claimed, item));
    }
  }

  void read_plan() {
    const int ends = integer("warp", "threads", 1, kMaxClaimedThreads);
    const int picks = integer("weft", "threads", 1, kMaxClaimedThreads);
    draft_.threading = lists("threading", ends, "end", "shaft", draft_.shafts);
    if (draft_.threading.empty())
      fail(section("threading").line, "[THREADING]: expected an end on a shaft, END=SHAFT");
    warn_of_unused("warp", "end", draft_.threading.size(), ends);
    const auto idle = std::count_if(draft_.threading.begin(), draft_.threading.end(),
                                    [](const auto& shafts) { return shafts.empty(); });
    if (idle > 0)
      warn(section("threading").line,
           fmt::format("{} ends among the others are on no shaft: none ever moves", idle));

    const bool has_plan = section("liftplan").line != 0;
    const bool has_tieup = section("tieup").line != 0 && section("treadling").line != 0;
    if (!has_plan && !has_tieup) {
      fail(section("weaving").line,
           "expected the sections [TIEUP] and [TREADLING], or [LIFTPLAN]; the draft has neither");
    }
    if (has_plan) draft_.liftplan = lists("liftplan", picks, "pick", "shaft", draft_.shafts);
    if (has_tieup) {
      draft_.treadles = integer("weaving", "treadles", 1, kMaxDraftThreads);
      draft_.tieup = lists("tieup", draft_.treadles, "treadle", "shaft", draft_.shafts);
      draft_.tieup.resize(static_cast<std::size_t>(draft_.treadles));
      draft_.treadling = lists("treadling", picks, "pick", "treadle", draft_.treadles);
    }
    const bool by_plan = has_plan && (!has_tieup || is_listed("liftplan"));
    if (has_plan && has_tieup) {
      if (!(ShaftSets(draft_.liftplan, draft_.shafts) == lifted_by_treadles())) {
        warn(section("liftplan").line,
             fmt::format("[LIFTPLAN] differs from tie-up and treadling; {} holds",
                         by_plan ? "it" : "the treadling"));
      }
    }
    const char* plan = by_plan ? "liftplan" : "treadling";
    if (by_plan) {
      draft_.treadles = 0;
      draft_.tieup.clear();
      draft_.treadling.clear();
    } else {
      draft_.liftplan.clear();
    }
    if (draft_.picks() == 0)
      fail(section(plan).line, fmt::format("[{}]: expected at least one pick", upper_case(plan)));
    warn_of_unused("weft", "pick", static_cast<std::size_t>(draft_.picks()), picks);
  }

  ShaftSets lifted_by_treadles() const {
    return ShaftSets::united(ShaftSets(draft_.tieup, draft_.shafts), draft_.treadling);
  }

  void draw_down() {
    const ShaftSets moved =
        draft_.treadling.empty() ? ShaftSets(draft_.liftplan, draft_.shafts) : lifted_by_treadles();
    const ShaftSets threaded(draft_.threading, draft_.shafts);
    const auto ends = draft_.threading.size();
    const auto picks = static_cast<std::size_t>(draft_.picks());
    draft_.warp_up.reserve(ends * picks);
    for (std::size_t pick = 0; pick < picks; ++pick) {
      for (std::size_t end = 0; end < ends; ++end)
        draft_.warp_up.push_back(threaded.meets(end, moved, pick) == draft_.rising_shed ? 1 : 0);
    }
  }

  // --- colours and sizes

  void read_palette() {
    int low = 0;
    int high = 255;
    if (const WifEntry* form = find("color palette", "form")) {
      const std::string value = lower_case(without_comment(form->value));
      if (!value.empty() && value != "rgb")
        fail(form->line, fmt::format("expected Form=RGB, found {}", quoted_excerpt(value)));
    }
    if (const WifEntry* range = find("color palette", "range")) {
      const std::vector<int> bounds = integers(*range, "a bound of 'range'", 0, 65535);
      if (bounds.size() != 2 || bounds[0] >= bounds[1])
        fail(range->line, "expected Range=LOW,HIGH with LOW < HIGH");
      low = bounds[0];
      high = bounds[1];
    } else if (section("color table").line != 0) {
      warn(section("color table").line,
           "no Range in [COLOR PALETTE]: colours are read from 0 to 255");
    }
    low_ = low;
    high_ = high;
    for (const WifEntry& entry : section("color table").entries) {
      const int index =
          checked_integer(entry.line, entry.key, "the number of a colour", 1, 1 << 20);
      const std::vector<int> values = integers(entry, "a colour's part", low, high);
      if (values.empty()) continue;
      if (values.size() != 3)
        fail(entry.line, fmt::format("expected COLOUR=R,G,B, found {} numbers", values.size()));
      palette_.emplace(index, color_of(values, 0));
    }
  }

  Color color_of(const std::vector<int>& values, std::size_t first) const {
    Color color;
    for (std::size_t c = 0; c < 3; ++c)
      color[c] = static_cast<double>(values[first + c] - low_) / (high_ - low_);
    return color;
  }

  /// NUMBER, or NUMBER,R,G,B. Nothing where the value is blank or 0.
  std::optional<Color> color(const WifEntry& entry) {
    const std::vector<int> values = integers(entry, "a colour's number", 0, 1 << 20);
    if (values.size() == 4) {
      for (std::size_t c = 1; c < 4; ++c) {
        if (values[c] < low_ || values[c] > high_)
          fail(entry.line, fmt::format("expected parts of a colour from {} to {}", low_, high_));
      }
      return color_of(values, 1);
    }
    if (values.size() > 1) fail(entry.line, "expected a colour's number, or NUMBER,R,G,B");
    if (values.empty()) return {};
    if (values[0] == 0) {
      warn(entry.line, "colour 0 is none of the palette; the default holds");
      return {};
    }
    const auto found = palette_.find(values[0]);
    if (found == palette_.end()) {
      fail(entry.line, section("color table").line == 0
                           ? fmt::format("colour {}: expected a section [COLOR TABLE]", values[0])
                           : fmt::format("colour {} is not in [COLOR TABLE], which has {}",
                                         values[0], palette_.size()));
    }
    return found->second;
  }

  /// set(thread, entry) for the entries of a section that belong to threads that are used.
  template <class Set>
  void for_threads(const std::string& name, int count, Set&& set) {
    std::vector<bool> seen(static_cast<std::size_t>(count));
    for (const WifEntry& entry : section(name).entries) {
      const int index =
          checked_integer(entry.line, entry.key, "the number of a thread", 1, kMaxClaimedThreads);
      if (index > count) continue;
      const auto at = static_cast<std::size_t>(index) - 1;
      if (seen[at]) {
        warn(entry.line, fmt::format("thread {} is stated already; the first holds", index));
      } else {
        seen[at] = true;
        set(at, entry);
      }
    }
  }

  void read_threads(const std::string& system, int count, WifThreads& threads) {
    read_colors(system, count, threads.color);
    // No unit is a failure only where a length needs it.
    threads.spacing_mm = lengths(system, "spacing", count);
    threads.thickness_mm = lengths(system, "thickness", count);
    const auto mean = [](const std::vector<double>& values) {
      double sum = 0;
      for (const double value : values) sum += value;
      return sum / static_cast<double>(values.size());
    };
    if (threads.spacing_mm.empty() || threads.thickness_mm.empty()) return;
    const double thickness = mean(threads.thickness_mm);
    const double spacing = mean(threads.spacing_mm);
    if (thickness > spacing) {
      warn(section(system).line,
           fmt::format("[{}]: a thickness of {:.3g} mm on a spacing of {:.3g} mm is more than has "
                       "room: programs write such numbers by default, without having measured",
                       upper_case(system), thickness, spacing));
    }
  }

  void read_colors(const std::string& system, int count, std::vector<Color>& colors) {
    const std::string table = system + " colors";
    const WifEntry* entry = find(system, "color");
    if (entry == nullptr && section(table).entries.empty()) return;
    std::vector<std::optional<Color>> found(static_cast<std::size_t>(count));
    for_threads(table, count, [&](std::size_t at, const WifEntry& own) { found[at] = color(own); });
    std::optional<Color> fallback = entry == nullptr ? std::nullopt : color(*entry);
    const auto missing = std::count(found.begin(), found.end(), std::nullopt);
    if (missing > 0 && !fallback) {
      if (palette_.empty()) return;
      fallback = palette_.begin()->second;
      warn(section(system).line, fmt::format("no colour is stated for {} threads of the {}: they "
                                             "take the first of the palette",
                                             missing, system));
    }
    for (const std::optional<Color>& own : found) colors.push_back(own ? *own : *fallback);
  }

  std::optional<double> mm_per_unit(const std::string& system) {
    const WifEntry* entry = find(system, "units");
    const std::string unit = entry == nullptr ? "" : lower_case(without_comment(entry->value));
    if (unit.empty()) return {};
    if (unit == "decipoints") return kMmPerInch / 720;
    if (unit == "inches") return kMmPerInch;
    if (unit == "centimeters" || unit == "centimetres") return 10;
    fail(entry->line,
         fmt::format("expected Decipoints, Inches or Centimeters, found {}", quoted_excerpt(unit)));
  }

  /// Millimetres of each thread, or nothing where they are not stated for all.
  std::vector<double> lengths(const std::string& system, const std::string& what, int count) {
    const std::string table = system + " " + what;
    const WifEntry* entry = find(system, what);
    if (entry == nullptr && section(table).entries.empty()) return {};
    const std::optional<double> unit = mm_per_unit(system);
    const std::size_t line = entry == nullptr ? section(table).line : entry->line;
    if (!unit) {
      warn(line, fmt::format("[{}] states no Units: the {} is left out", upper_case(system), what));
      return {};
    }
    const auto length = [&](const WifEntry& from) { return length_mm(from, what, *unit); };
    const double fallback = entry == nullptr ? 0 : length(*entry);
    std::vector<double> result(static_cast<std::size_t>(count), fallback);
    for_threads(table, count, [&](std::size_t at, const WifEntry& own) {
      if (const double own_length = length(own); own_length > 0) result[at] = own_length;
    });
    if (std::count(result.begin(), result.end(), 0.0) == 0) return result;
    warn(line,
         fmt::format("no {} is stated for some threads of the {}: all are left out", what, system));
    return {};
  }

  /// 0 where the value is blank or 0.
  double length_mm(const WifEntry& entry, const std::string& what, double unit) const {
    std::string_view text = without_comment(entry.value);
    if (text.empty()) return 0;
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    const double mm = value * unit;
    const bool is_number = result.ec == std::errc() && result.ptr == text.data() + text.size();
    if (is_number && value == 0) return 0;
    if (!is_number || !(mm >= 1e-3 && mm <= 100)) {
      fail(entry.line,
           fmt::format("expected a {} from 0.001 to 100 mm, found {}", what, quoted_excerpt(text)));
    }
    return mm;
  }

  std::string name_;
  std::map<std::string, WifSection> sections_;
  WifDraft draft_;
  std::map<int, Color> palette_;
  int low_ = 0;
  int high_ = 255;
};

}  // namespace

WifDraft parse_wif(std::string_view bytes, const std::string& name,
                   std::optional<bool> rising_shed) {
  return WifReader(bytes, name).read(rising_shed);
}

WifDraft read_wif(const std::filesystem::path& path, std::optional<bool> rising_shed) {
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  if (!ignored && size > kMaxDraftBytes) {
    throw FileError(
        fmt::format("{}: {} bytes; a draft has at most {}", path.string(), size, kMaxDraftBytes));
  }
  const std::vector<std::byte> bytes = read_whole_file(path);
  return parse_wif({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path.string(),
                   rising_shed);
}

}  // namespace heddle
