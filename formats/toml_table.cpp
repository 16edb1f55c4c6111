#include "formats/toml_table.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "formats/atomic_file.h"
#include "formats/content_hash.h"
#include "formats/input_error.h"
#include "formats/srgb_color.h"

namespace heddle {

namespace {

// Hand-written configs take a few kilobytes. A document takes up to 140 times its size in memory.
constexpr std::size_t kMaxDocumentBytes = std::size_t{1} << 20;
// How deep tables and arrays may be nested. Ours need fewer than ten. toml++ and this file walk
// them by recursion.
constexpr std::size_t kMaxDepth = 64;

struct Unit {
  std::string_view suffix;
  std::string_view spelled;
};
// A suffix that ends another one comes after it ("_per_mm" before "_mm").
constexpr Unit kUnits[] = {
    {"_per_mm", "per millimetre"},
    {"_per_cm", "per centimetre"},
    {"_per_m", "per metre"},
    {"_per_inch", "per inch"},
    {"_nm", "nanometres"},
    {"_um", "micrometres"},
    {"_mm", "millimetres"},
    {"_cm", "centimetres"},
    {"_m", "metres"},
    {"_inch", "inches"},
    {"_deg", "degrees"},
    {"_rad", "radians"},
    {"_tex", "tex"},
    {"_dtex", "decitex"},
    {"_percent", "percent"},
    {"_px", "pixels"},
    {"_seconds", "seconds"},
    {"_s", "seconds"},
    {"_ms", "milliseconds"},
    {"_mfp", "mean free paths"},
};

const Unit* unit_of(std::string_view key) {
  for (const Unit& unit : kUnits) {
    if (key.size() > unit.suffix.size() && key.ends_with(unit.suffix)) return &unit;
  }
  return nullptr;
}

std::string_view stem_of(std::string_view key) {
  const Unit* unit = unit_of(key);
  return unit == nullptr ? key : key.substr(0, key.size() - unit->suffix.size());
}

bool differ_by_unit_only(std::string_view a, std::string_view b) {
  return a != b && stem_of(a) == stem_of(b);
}

/// Insertions, deletions, substitutions and swaps of neighbours (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min(
          {d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

/// The candidate for which `word` is most likely a misspelling; empty if none is close.
template <class Range>
std::string nearest(std::string_view word, const Range& candidates) {
  if (word.size() > 64) return {};
  std::size_t best_distance = word.size() < 5 ? 2 : 3;
  std::string best;
  for (const auto& candidate : candidates) {
    const std::string_view text(candidate);
    const std::size_t distance = text.size() > 64 || text == word ? 64 : edit_distance(word, text);
    if (distance < best_distance) {
      best_distance = distance;
      best = text;
    }
  }
  return best;
}

std::string printable(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = c == '\t' ? '\t' : '?';
  }
  return result;
}

bool continues_code_point(char c) {
  return (static_cast<unsigned char>(c) & 0xC0) == 0x80;
}

std::string shortened(std::string_view text) {
  constexpr std::size_t kLength = 40;
  if (text.size() <= kLength) return std::string(text);
  std::size_t end = kLength;
  while (end > 0 && continues_code_point(text[end])) --end;
  return std::string(text.substr(0, end)) + "...";
}

/// The source line and a caret under the column, which counts code points from 1. Of a long line
/// only a part.
std::string excerpt(std::string_view line, std::size_t column) {
  constexpr std::size_t kWidth = 120;
  // of these to the left of the caret, where the beginning is left out
  constexpr std::size_t kBefore = 60;
  const std::size_t first = column > kWidth ? column - 1 - kBefore : 0;
  std::string source = first > 0 ? "..." : "";
  std::string caret(source.size(), ' ');
  std::size_t code_point = 0;  // of the next character
  for (const char c : line) {
    if (!continues_code_point(c) && ++code_point > first + kWidth) {
      source += "...";
      break;
    }
    if (code_point <= first) continue;
    source += c;
    if (code_point < column && !continues_code_point(c)) caret += c == '\t' ? '\t' : ' ';
  }
  return "\n  " + printable(source) + "\n  " + caret + "^";
}

/// Finds where tables and arrays are nested deeper than kMaxDepth, before toml++ builds them. Names
/// of a header, dots of keys, and brackets count; those in strings and comments do not. Exact up to
/// the first syntax error, which toml++ reports.
class DepthScan {
 public:
  explicit DepthScan(std::string_view text) : text_(text) {}

  /// The place of the dot or bracket that goes too deep; nothing if none does.
  std::optional<toml::source_position> first_too_deep() {
    for (std::size_t next = 0; at_ < text_.size(); at_ = next) {
      next = at_ + token_length();
      if (!take(text_[at_])) return position();
    }
    return {};
  }

 private:
  /// One open bracket, or the document.
  struct Level {
    std::size_t depth;  // tables and arrays around what it holds
    bool is_array;
    bool in_value = false;  // past a '=': a dot is no new table
    std::size_t dots = 0;   // of the key before
  };

  /// Strings and comments are one token, everything else is read by the character.
  std::size_t token_length() const {
    const char c = text_[at_];
    if (c == '#') return std::min(text_.find('\n', at_), text_.size()) - at_;
    if (c != '"' && c != '\'') return 1;
    const std::string quotes(3, c);
    const bool is_long = text_.substr(at_).starts_with(quotes);
    for (std::size_t k = at_ + (is_long ? 3 : 1); k < text_.size(); ++k) {
      if (c == '"' && text_[k] == '\\') {
        ++k;
      } else if (is_long && text_.substr(k).starts_with(quotes)) {
        k += 3;
        // Up to two more quotes belong to the text.
        for (int more = 0; more < 2 && k < text_.size() && text_[k] == c; ++more) ++k;
        return k - at_;
      } else if (!is_long && (text_[k] == c || text_[k] == '\n')) {
        return k + (text_[k] == c ? 1 : 0) - at_;
      }
    }
    return text_.size() - at_;
  }

  /// False where it goes too deep.
  bool take(char c) {
    Level& level = levels_.back();
    const bool at_top = levels_.size() == 1;
    if (c == '\n' && at_top) {
      level.in_value = false;
      level.dots = header_ = 0;
      return true;
    }
    switch (c) {
      case '.':
        if (!level.in_value) ++level.dots;
        return level.depth + header_ + level.dots <= kMaxDepth;
      case '=':
        level.in_value = true;
        return true;
      case ',':
        level.in_value = level.is_array;
        level.dots = 0;
        return true;
      case '[':
        if (at_top && !level.in_value) {  // a header; two brackets: an array of tables
          if (++header_ == 1) level.depth = 0;
          return header_ <= kMaxDepth;
        }
        [[fallthrough]];
      case '{': {
        const std::size_t depth = level.depth + level.dots + 1;
        levels_.push_back({depth, c == '[', c == '['});
        return depth <= kMaxDepth;
      }
      case ']':
      case '}':
        if (!at_top) {
          levels_.pop_back();
        } else if (header_ > 0) {
          level.depth = header_ + level.dots;
          level.dots = header_ = 0;
        }
        return true;
      default:
        return true;
    }
  }

  toml::source_position position() const {
    const std::string_view before = text_.substr(0, at_);
    const std::size_t line_begin = before.rfind('\n') + 1;  // 0 if there is no line before
    const auto code_points =
        std::count_if(before.begin() + static_cast<std::ptrdiff_t>(line_begin), before.end(),
                      [](char c) { return !continues_code_point(c); });
    return {static_cast<toml::source_index>(std::count(before.begin(), before.end(), '\n') + 1),
            static_cast<toml::source_index>(code_points + 1)};
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::vector<Level> levels_ = {{0, false}};
  std::size_t header_ = 0;  // open brackets of a header
};

std::string describe(const toml::node& node) {
  if (const auto* value = node.as_string()) return "the string \"" + shortened(value->get()) + "\"";
  if (const auto* value = node.as_integer()) return fmt::format("the integer {}", value->get());
  if (const auto* value = node.as_floating_point())
    return fmt::format("the number {}", value->get());
  if (const auto* value = node.as_boolean()) return fmt::format("the boolean {}", value->get());
  if (const auto* value = node.as_array()) return fmt::format("an array of {}", value->size());
  return node.is_table() ? "a table" : "a date or time";
}

std::string range_text(const NumberRange& range) {
  const NumberRange unbounded;
  const bool below = range.min > unbounded.min;
  const bool above = range.max < unbounded.max;
  if (below && above)
    return fmt::format("{}{}, {}]", range.exclusive_min ? "(" : "[", range.min, range.max);
  if (below) return fmt::format("{} {}", range.exclusive_min ? ">" : ">=", range.min);
  return above ? fmt::format("<= {}", range.max) : "";
}

std::string range_text(std::int64_t min, std::int64_t max) {
  const bool below = min > std::numeric_limits<std::int64_t>::min();
  const bool above = max < std::numeric_limits<std::int64_t>::max();
  if (below && above) return fmt::format("[{}, {}]", min, max);
  if (below) return fmt::format(">= {}", min);
  return above ? fmt::format("<= {}", max) : "";
}

/// "a number in (0, 10]", "an integer >= 1", "a number".
std::string with_range(const std::string& what, const std::string& range) {
  if (range.empty()) return what;
  const bool interval = range.front() == '[' || range.front() == '(';
  return what + (interval ? " in " : " ") + range;
}

bool contains(const NumberRange& range, double value) {
  return std::isfinite(value) && value <= range.max &&
         (range.exclusive_min ? value > range.min : value >= range.min);
}

[[noreturn]] void fail_size(const std::string& name, std::uintmax_t size) {
  throw ConfigError(
      fmt::format("{}: {} bytes; a config has at most {}", name, size, kMaxDocumentBytes));
}

/// What stands in the canonical text in place of a value.
using Replacements = std::map<const toml::node*, std::string>;

/// Minimal JSON-like text of a value; toml++ keeps the keys of a table sorted.
void append_canonical(std::string& out, const toml::node& node, const Replacements& replacements);

void append_quoted(std::string& out, std::string_view text) {
  out += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  out += '"';
}

void append_canonical(std::string& out, const toml::node& node, const Replacements& replacements) {
  const char* separator = "";
  if (const auto replacement = replacements.find(&node); replacement != replacements.end()) {
    append_quoted(out, replacement->second);
    return;
  }
  if (const auto* table = node.as_table()) {
    out += '{';
    for (const auto& [key, value] : *table) {
      out += separator;
      separator = ",";
      append_quoted(out, key.str());
      out += ':';
      append_canonical(out, value, replacements);
    }
    out += '}';
  } else if (const auto* array = node.as_array()) {
    out += '[';
    for (const toml::node& value : *array) {
      out += separator;
      separator = ",";
      append_canonical(out, value, replacements);
    }
    out += ']';
  } else if (const auto* text = node.as_string()) {
    append_quoted(out, text->get());
  } else if (const auto* integer = node.as_integer()) {
    out += fmt::format("{}", integer->get());
  } else if (const auto* number = node.as_floating_point()) {
    out +=
        // 1.0 gives "1", as the integer 1 does: they mean the same number
        fmt::format("{}", number->get());
  } else if (const auto* boolean = node.as_boolean()) {
    out += boolean->get() ? "true" : "false";
  } else {
    std::ostringstream stream;
    node.visit([&stream](const auto& value) {
      if constexpr (toml::is_date<decltype(value)> || toml::is_time<decltype(value)> ||
                    toml::is_date_time<decltype(value)>) {
        stream << value.get();
      }
    });
    out += stream.str();
  }
}

}  // namespace

/// A table of the file, and what was asked of it. Asking does not change the document, so the
/// records are mutable.
struct TomlTable::Node {
  const toml::table* values = nullptr;
  // for messages: "[yarn.warp]", "[[light]]"; empty for the whole document
  std::string title;
  std::string full_name;          // "yarn.warp"
  toml::source_position place{};  // of the table's name
  std::map<std::string, std::unique_ptr<Node>, std::less<>> tables;
  std::map<std::string, std::vector<std::unique_ptr<Node>>, std::less<>> table_arrays;

  mutable std::string asked_path;   // as in AskedKey::path
  mutable bool enumerated = false;  // table_names() was called
  mutable std::map<std::string, AskedKey, std::less<>> asked;

  const toml::key* find_key(std::string_view key) const {
    const auto it = values->find(key);
    return it == values->end() ? nullptr : &it->first;
  }
  const toml::node* find(std::string_view key) const { return values->get(key); }

  std::string in_title() const { return title.empty() ? "at the top level" : "in " + title; }

  std::string path_of(std::string_view key) const {
    const bool named_by_user = enumerated && tables.contains(key);
    const std::string_view name = named_by_user ? "NAME" : key;
    return asked_path.empty() ? std::string(name) : asked_path + "." + std::string(name);
  }

  void record(std::string_view key, const std::string& type, const std::string& range,
              const std::string& default_value) const {
    asked[std::string(key)] = {path_of(key), type, range, default_value};
  }
};

struct TomlTable::Document {
  std::string name;
  std::vector<std::string> lines;
  toml::table values;
  Node root;
  Replacements contents;  // of files asked for by content_file()

  [[noreturn]] void fail_at(const toml::source_position& place, const std::string& message) const {
    fail_at(name, lines, place, message);
  }

  /// Throws "name:line:col: message", the source line, and a caret under the column.
  [[noreturn]] static void fail_at(const std::string& name, const std::vector<std::string>& lines,
                                   const toml::source_position& place, const std::string& message) {
    const std::size_t line = std::max<std::size_t>(place.line, 1);
    const std::size_t column = std::max<std::size_t>(place.column, 1);
    std::string text = fmt::format("{}:{}:{}: {}", name, line, column, printable(message));
    if (line <= lines.size()) text += excerpt(lines[line - 1], column);
    throw ConfigError(text);
  }

  static void build(Node& node, const toml::table& values) {
    node.values = &values;
    for (const auto& [key, value] : values) {
      const std::string key_text(key.str());
      const auto make_child = [&, &key = key](const toml::table& child, std::string_view open,
                                              std::string_view close) {
        auto result = std::make_unique<Node>();
        result->full_name = node.full_name.empty() ? shortened(key_text)
                                                   : node.full_name + "." + shortened(key_text);
        result->title = fmt::format("{}{}{}", open, result->full_name, close);
        result->place = child.source().begin.line > 0 ? child.source().begin : key.source().begin;
        build(*result, child);
        return result;
      };
      if (const toml::table* table = value.as_table()) {
        node.tables[key_text] = make_child(*table, "[", "]");
      } else if (const toml::array* array = value.as_array();
                 array != nullptr && !array->empty() &&
                 array->is_homogeneous(toml::node_type::table)) {
        for (const toml::node& element : *array) {
          node.table_arrays[key_text].push_back(make_child(*element.as_table(), "[[", "]]"));
        }
      }
    }
  }

  /// A required key that is absent. Points at a key that differs in its unit only, else at the
  /// table.
  [[noreturn]] void fail_missing(const Node& node, std::string_view key,
                                 const std::string& expected) const {
    const Unit* unit = unit_of(key);
    const std::string what =
        unit == nullptr ? expected : fmt::format("{}, in {}", expected, unit->spelled);
    std::vector<std::string_view> unasked;
    for (const auto& [present, value] : *node.values) {
      if (node.asked.contains(present.str())) continue;
      if (differ_by_unit_only(present.str(), key)) {
        fail_at(present.source().begin,
                fmt::format("wrong unit: the expected key is '{}' ({}), found '{}'", key, what,
                            present.str()));
      }
      unasked.push_back(present.str());
    }
    const std::string similar = nearest(key, unasked);
    const std::string hint = similar.empty()
                                 ? ""
                                 : fmt::format("; is '{}' on line {} meant for it?", similar,
                                               node.find_key(similar)->source().begin.line);
    fail_at(node.place,
            fmt::format("missing key '{}' {}: expected {}{}", key, node.in_title(), what, hint));
  }

  [[noreturn]] void fail_wrong_value(std::string_view key, const toml::node& value,
                                     const std::string& expected) const {
    fail_at(value.source().begin,
            fmt::format("'{}': expected {}, found {}", key, expected, describe(value)));
  }

  double checked_number(std::string_view key, const toml::node& value,
                        const NumberRange& range) const {
    const auto* integer = value.as_integer();
    const auto* number = value.as_floating_point();
    const std::string expected = with_range("a number", range_text(range));
    if (integer == nullptr && number == nullptr) fail_wrong_value(key, value, expected);
    const double result = integer != nullptr ? static_cast<double>(integer->get()) : number->get();
    if (!std::isfinite(result))
      fail_wrong_value(key, value, "a finite number" + expected.substr(8));
    if (!contains(range, result)) fail_wrong_value(key, value, expected);
    return result;
  }

  template <std::size_t N>
  std::array<double, N> numbers(const Node& node, std::string_view key, const NumberRange& range,
                                const std::optional<std::array<double, N>>& fallback) const {
    const std::string expected =
        fmt::format("an array of {} numbers{}", N, with_range("", range_text(range)));
    node.record(key, fmt::format("number[{}]", N), range_text(range),
                fallback ? fmt::format("[{}]", fmt::join(*fallback, ", ")) : "required");
    const toml::node* value = node.find(key);
    if (value == nullptr) {
      if (fallback) return *fallback;
      fail_missing(node, key, expected);
    }
    const toml::array* array = value->as_array();
    if (array == nullptr || array->size() != N) fail_wrong_value(key, *value, expected);
    std::array<double, N> result;
    for (std::size_t i = 0; i < N; ++i) result[i] = checked_number(key, (*array)[i], range);
    return result;
  }

  struct UnknownKey {
    const Node* node;
    const toml::key* key;
    auto place() const { return std::pair(key->source().begin.line, key->source().begin.column); }
  };

  static void find_unknown(const Node& node, std::optional<UnknownKey>& first) {
    for (const auto& [key, value] : *node.values) {
      if (!node.asked.contains(key.str())) {
        const UnknownKey unknown{&node, &key};
        if (!first || unknown.place() < first->place()) first = unknown;
        continue;
      }
      if (const auto it = node.tables.find(key.str()); it != node.tables.end())
        find_unknown(*it->second, first);
      if (const auto it = node.table_arrays.find(key.str()); it != node.table_arrays.end()) {
        for (const auto& element : it->second) find_unknown(*element, first);
      }
    }
  }

  static void collect_asked(const Node& node, std::vector<AskedKey>& keys) {
    for (const auto& [key, asked] : node.asked) keys.push_back(asked);
    for (const auto& [key, child] : node.tables) collect_asked(*child, keys);
    for (const auto& [key, children] : node.table_arrays) {
      for (const auto& child : children) collect_asked(*child, keys);
    }
  }
};

TomlTable::TomlTable(std::shared_ptr<Document> document, const Node* node)
    : document_(std::move(document)), node_(node) {}

TomlTable TomlTable::load(const std::filesystem::path& path) {
  // Larger files are refused unread.
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  if (!ignored && size > kMaxDocumentBytes) fail_size(path.string(), size);
  std::vector<std::byte> bytes;
  try {
    bytes = read_whole_file(path);
  } catch (const FileError& error) {
    throw ConfigError(error.what());
  }
  return parse({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path.string());
}

TomlTable TomlTable::parse(std::string_view text, const std::string& name) {
  if (text.size() > kMaxDocumentBytes) fail_size(name, text.size());
  auto document = std::make_shared<Document>();
  document->name = name;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    document->lines.emplace_back(line);
    begin = end + 1;
  }
  if (const auto place = DepthScan(text).first_too_deep()) {
    document->fail_at(
        *place, fmt::format("syntax: more than {} tables and arrays within each other", kMaxDepth));
  }
  try {
    document->values = toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    document->fail_at(error.source().begin, "syntax: " + std::string(error.description()));
  }
  document->root.place = {1, 1};
  Document::build(document->root, document->values);
  const Node* root = &document->root;
  return TomlTable(std::move(document), root);
}

bool TomlTable::has(std::string_view key) const {
  return node_->find(key) != nullptr;
}

double TomlTable::number(std::string_view key, NumberRange range,
                         std::optional<double> fallback) const {
  node_->record(key, "number", range_text(range),
                fallback ? fmt::format("{}", *fallback) : "required");
  if (const toml::node* value = node_->find(key))
    return document_->checked_number(key, *value, range);
  if (fallback) return *fallback;
  document_->fail_missing(*node_, key, with_range("a number", range_text(range)));
}

std::optional<double> TomlTable::optional_number(std::string_view key, NumberRange range) const {
  node_->record(key, "number", range_text(range), "optional");
  const toml::node* value = node_->find(key);
  if (value == nullptr) return {};
  return document_->checked_number(key, *value, range);
}

std::int64_t TomlTable::integer(std::string_view key, std::int64_t min, std::int64_t max,
                                std::optional<std::int64_t> fallback) const {
  const std::string range = range_text(min, max);
  node_->record(key, "integer", range, fallback ? fmt::format("{}", *fallback) : "required");
  const std::string expected = with_range("an integer", range);
  const toml::node* value = node_->find(key);
  if (value == nullptr) {
    if (fallback) return *fallback;
    document_->fail_missing(*node_, key, expected);
  }
  const auto* integer = value->as_integer();
  if (integer == nullptr || integer->get() < min || integer->get() > max) {
    document_->fail_wrong_value(key, *value, expected);
  }
  return integer->get();
}

std::optional<std::int64_t> TomlTable::optional_integer(std::string_view key, std::int64_t min,
                                                        std::int64_t max) const {
  const bool present = has(key);
  const std::int64_t value = present ? integer(key, min, max) : 0;
  node_->record(key, "integer", range_text(min, max), "optional");
  return present ? std::optional(value) : std::nullopt;
}

std::optional<bool> TomlTable::optional_boolean(std::string_view key) const {
  const bool present = has(key);
  const bool value = present && boolean(key);
  node_->record(key, "boolean", "", "optional");
  return present ? std::optional(value) : std::nullopt;
}

bool TomlTable::boolean(std::string_view key, std::optional<bool> fallback) const {
  node_->record(key, "boolean", "", fallback ? fmt::format("{}", *fallback) : "required");
  const toml::node* value = node_->find(key);
  if (value == nullptr) {
    if (fallback) return *fallback;
    document_->fail_missing(*node_, key, "true or false");
  }
  const auto* boolean = value->as_boolean();
  if (boolean == nullptr) document_->fail_wrong_value(key, *value, "true or false");
  return boolean->get();
}

std::string TomlTable::string(std::string_view key, std::optional<std::string> fallback) const {
  node_->record(key, "string", "", fallback ? *fallback : "required");
  const toml::node* value = node_->find(key);
  if (value == nullptr) {
    if (fallback) return *fallback;
    document_->fail_missing(*node_, key, "a string");
  }
  const auto* text = value->as_string();
  if (text == nullptr) document_->fail_wrong_value(key, *value, "a string");
  return text->get();
}

std::string TomlTable::choice(std::string_view key, const std::vector<std::string_view>& choices,
                              std::optional<std::string> fallback) const {
  assert(!fallback || std::find(choices.begin(), choices.end(), *fallback) != choices.end());
  node_->record(key, "string", fmt::format("{}", fmt::join(choices, " | ")),
                fallback ? *fallback : "required");
  const std::string expected = fmt::format("one of \"{}\"", fmt::join(choices, "\", \""));
  const toml::node* value = node_->find(key);
  if (value == nullptr) {
    if (fallback) return *fallback;
    document_->fail_missing(*node_, key, expected);
  }
  const auto* text = value->as_string();
  if (text == nullptr || std::find(choices.begin(), choices.end(), text->get()) == choices.end()) {
    document_->fail_wrong_value(key, *value, expected);
  }
  return text->get();
}

std::array<double, 2> TomlTable::number2(std::string_view key, NumberRange range,
                                         std::optional<std::array<double, 2>> fallback) const {
  return document_->numbers<2>(*node_, key, range, fallback);
}

std::array<double, 3> TomlTable::number3(std::string_view key, NumberRange range,
                                         std::optional<std::array<double, 3>> fallback) const {
  return document_->numbers<3>(*node_, key, range, fallback);
}

std::vector<double> TomlTable::numbers(std::string_view key, NumberRange range,
                                       std::size_t min_count, std::size_t max_count) const {
  const std::string expected = fmt::format("an array of {} to {} numbers{}", min_count, max_count,
                                           with_range("", range_text(range)));
  node_->record(key, "number[]", range_text(range), "required");
  const toml::node* value = node_->find(key);
  if (value == nullptr) document_->fail_missing(*node_, key, expected);
  const toml::array* array = value->as_array();
  if (array == nullptr || array->size() < min_count || array->size() > max_count) {
    document_->fail_wrong_value(key, *value, expected);
  }
  std::vector<double> result;
  for (const toml::node& element : *array)
    result.push_back(document_->checked_number(key, element, range));
  return result;
}

std::vector<std::string> TomlTable::strings(std::string_view key, std::size_t min_count,
                                            std::size_t max_count) const {
  const std::string expected = fmt::format("an array of {} to {} strings", min_count, max_count);
  node_->record(key, "string[]", "", "required");
  const toml::node* value = node_->find(key);
  if (value == nullptr) document_->fail_missing(*node_, key, expected);
  const toml::array* array = value->as_array();
  if (array == nullptr || array->size() < min_count || array->size() > max_count)
    document_->fail_wrong_value(key, *value, expected);
  std::vector<std::string> result;
  for (const toml::node& element : *array) {
    const auto* text = element.as_string();
    if (text == nullptr) document_->fail_wrong_value(key, element, "a string");
    result.push_back(text->get());
  }
  return result;
}

std::vector<std::string> TomlTable::optional_strings(std::string_view key, std::size_t min_count,
                                                     std::size_t max_count) const {
  std::vector<std::string> result;
  if (has(key)) result = strings(key, min_count, max_count);
  node_->record(key, "string[]", "", "optional");
  return result;
}

std::array<double, 3> TomlTable::color(std::string_view key) const {
  const std::string expected = "a colour: 3 numbers in [0, 1], or \"#rrggbb\"";
  node_->record(key, "color", "", "required");
  const toml::node* value = node_->find(key);
  if (value == nullptr) document_->fail_missing(*node_, key, expected);
  std::array<double, 3> result{};
  if (const auto* text = value->as_string()) {
    const std::optional<std::array<double, 3>> color = color_of_hex(text->get());
    if (!color) document_->fail_wrong_value(key, *value, expected);
    return *color;
  }
  const toml::array* array = value->as_array();
  if (array == nullptr || array->size() != 3) document_->fail_wrong_value(key, *value, expected);
  for (std::size_t i = 0; i < 3; ++i)
    result[i] = document_->checked_number(key, (*array)[i], {.min = 0, .max = 1});
  return result;
}

std::filesystem::path TomlTable::content_file(std::string_view key) const {
  std::filesystem::path path = existing_file(key);
  document_->contents[node_->find(key)] = "content " + content_hash_of_file(path);
  return path;
}

std::filesystem::path TomlTable::file_name(std::string_view key) const {
  node_->record(key, "file", "", "required");
  const toml::node* value = node_->find(key);
  if (value == nullptr) document_->fail_missing(*node_, key, "the path of a file");
  const auto* text = value->as_string();
  if (text == nullptr) document_->fail_wrong_value(key, *value, "the path of a file");
  return std::filesystem::path(document_->name).parent_path() / text->get();
}

std::filesystem::path TomlTable::existing_file(std::string_view key) const {
  std::filesystem::path path = file_name(key);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    document_->fail_at(node_->find(key)->source().begin,
                       fmt::format("'{}': there is no file '{}'", key, path.string()));
  }
  return path;
}

TomlTable TomlTable::table(std::string_view key) const {
  std::optional<TomlTable> result = optional_table(key);
  node_->record(key, "table", "", "required");
  if (!result) document_->fail_missing(*node_, key, "a table");
  return *result;
}

std::optional<TomlTable> TomlTable::optional_table(std::string_view key) const {
  node_->record(key, "table", "", "optional");
  const toml::node* value = node_->find(key);
  if (value == nullptr) return {};
  const auto it = node_->tables.find(key);
  if (it == node_->tables.end()) document_->fail_wrong_value(key, *value, "a table");
  it->second->asked_path = node_->path_of(key);
  return TomlTable(document_, it->second.get());
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) const {
  node_->record(key, "table[]", "", "optional");
  node_->asked.find(key)->second.path += "[]";
  const toml::node* value = node_->find(key);
  if (value == nullptr) return {};
  const auto it = node_->table_arrays.find(key);
  if (it == node_->table_arrays.end()) {
    const toml::array* array = value->as_array();
    if (array != nullptr && array->empty()) return {};
    document_->fail_wrong_value(key, *value, fmt::format("an array of tables ([[{}]])", key));
  }
  std::vector<TomlTable> result;
  for (const auto& element : it->second) {
    element->asked_path = node_->path_of(key) + "[]";
    result.push_back(TomlTable(document_, element.get()));
  }
  return result;
}

std::vector<std::string> TomlTable::table_names() const {
  node_->enumerated = true;
  std::vector<std::string> names;
  for (const auto& [name, child] : node_->tables) names.push_back(name);
  std::stable_sort(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
    const toml::source_position place_a = node_->find_key(a)->source().begin;
    const toml::source_position place_b = node_->find_key(b)->source().begin;
    return std::tie(place_a.line, place_a.column) < std::tie(place_b.line, place_b.column);
  });
  return names;
}

void TomlTable::finish() const {
  std::optional<Document::UnknownKey> unknown;
  Document::find_unknown(*node_, unknown);
  if (!unknown) return;
  const std::string_view key = unknown->key->str();
  std::vector<std::string> known;
  std::string hint;
  for (const auto& [name, asked] : unknown->node->asked) {
    known.push_back(name);
    if (differ_by_unit_only(name, key))
      hint = fmt::format("; wrong unit: the expected key is '{}'", name);
  }
  if (hint.empty()) {
    const std::string similar = nearest(key, known);
    if (!similar.empty()) hint = fmt::format("; did you mean '{}'?", similar);
  }
  if (hint.empty() && !known.empty() && known.size() <= 24) {
    hint = fmt::format("; known here: {}", fmt::join(known, ", "));
  }
  document_->fail_at(
      unknown->key->source().begin,
      fmt::format("unknown key '{}' {}{}", shortened(key), unknown->node->in_title(), hint));
}

void TomlTable::fail(std::string_view key, const std::string& message) const {
  const toml::key* present = node_->find_key(key);
  const std::string subject = key.empty() ? "" : fmt::format("'{}': ", key);
  document_->fail_at(present != nullptr ? present->source().begin : node_->place,
                     subject + message);
}

std::vector<AskedKey> TomlTable::asked_keys() const {
  std::vector<AskedKey> keys;
  Document::collect_asked(document_->root, keys);
  const auto fields = [](const AskedKey& key) {
    return std::tie(key.path, key.type, key.range, key.default_value);
  };
  std::sort(keys.begin(), keys.end(),
            [&](const auto& a, const auto& b) { return fields(a) < fields(b); });
  keys.erase(std::unique(keys.begin(), keys.end(),
                         [&](const auto& a, const auto& b) { return fields(a) == fields(b); }),
             keys.end());
  return keys;
}

const std::string& TomlTable::document_name() const {
  return document_->name;
}

std::string TomlTable::canonical_text() const {
  std::string text;
  append_canonical(text, *node_->values, document_->contents);
  return text;
}

}  // namespace heddle
