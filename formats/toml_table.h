#ifndef HEDDLE_FORMATS_TOML_TABLE_H_
#define HEDDLE_FORMATS_TOML_TABLE_H_
// TOML values that know their line. A reader asks for every key it understands, with unit suffix
// and range. finish() then rejects every key that nobody asked for. Every error is a ConfigError
// "file:line:col: what was expected", followed by the source line and a caret. NaN and infinities
// are never accepted. Every key asked for is recorded (asked_keys), so that a test can compare the
// documentation with the parser. Tested in tests/formats/toml_table_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace heddle {

/// Closed range [min, max]; `exclusive_min` makes it (min, max].
struct NumberRange {
  double min = -1e30;
  double max = 1e30;
  bool exclusive_min = false;
};

/// One key that a reader asked for, e.g. {"yarn.warp.radius_um", "number", "(0, 1000]",
/// "required"}.
struct AskedKey {
  std::string
      // dotted; arrays of tables as "light[].axis"; tables listed by table_names() as "fiber.NAME"
      path;
  // number, integer, boolean, string, file, number[2], number[3], number[], string[], color, table,
  std::string type;
  // table[]
  std::string range;          // "" if none; strings with a fixed set of choices: "face | both"
  std::string default_value;  // "required" if there is none; "optional" for optional_* keys
};

/// A table of a TOML document. Cheap to copy: tables of one document share it. Not for use by
/// several threads at once (asking for a key records it).
class TomlTable {
 public:
  /// Reads and parses a file. Errors: ConfigError (unreadable file, syntax error with its place).
  static TomlTable load(const std::filesystem::path& path);
  /// The same for text; `name` stands for the file name in messages.
  static TomlTable parse(std::string_view text, const std::string& name);

  bool has(std::string_view key) const;

  /// Required when `fallback` is empty. Integers are accepted where a number is expected.
  double number(std::string_view key, NumberRange range, std::optional<double> fallback = {}) const;
  std::optional<double> optional_number(std::string_view key, NumberRange range) const;
  std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max,
                       std::optional<std::int64_t> fallback = {}) const;
  std::optional<std::int64_t> optional_integer(std::string_view key, std::int64_t min,
                                               std::int64_t max) const;
  bool boolean(std::string_view key, std::optional<bool> fallback = {}) const;
  std::optional<bool> optional_boolean(std::string_view key) const;
  std::string string(std::string_view key, std::optional<std::string> fallback = {}) const;
  /// A string out of a fixed set; the error lists the set.
  std::string choice(std::string_view key, const std::vector<std::string_view>& choices,
                     std::optional<std::string> fallback = {}) const;
  std::array<double, 2> number2(std::string_view key, NumberRange range,
                                std::optional<std::array<double, 2>> fallback = {}) const;
  std::array<double, 3> number3(std::string_view key, NumberRange range,
                                std::optional<std::array<double, 3>> fallback = {}) const;
  /// A required array of `min_count` to `max_count` numbers, each in the range.
  std::vector<double> numbers(std::string_view key, NumberRange range, std::size_t min_count,
                              std::size_t max_count) const;
  /// A required array of `min_count` to `max_count` strings.
  std::vector<std::string> strings(std::string_view key, std::size_t min_count,
                                   std::size_t max_count) const;
  /// The same; empty where the key is absent.
  std::vector<std::string> optional_strings(std::string_view key, std::size_t min_count,
                                            std::size_t max_count) const;
  /// Linear rgb: an array of 3 numbers in [0, 1], or a string "#rrggbb", which is sRGB.
  std::array<double, 3> color(std::string_view key) const;
  /// A string taken as a path relative to the folder of the document. The file must exist.
  std::filesystem::path existing_file(std::string_view key) const;
  /// The same for a file that need not exist under this name, as one of many in a sequence.
  std::filesystem::path file_name(std::string_view key) const;
  /// The same for a file whose content belongs to the config: canonical_text() then holds a hash of
  /// the content in place of the path.
  std::filesystem::path content_file(std::string_view key) const;

  /// A required sub-table / an optional one / an array of tables ([[key]]; empty if absent).
  TomlTable table(std::string_view key) const;
  std::optional<TomlTable> optional_table(std::string_view key) const;
  std::vector<TomlTable> tables(std::string_view key) const;
  /// Names of all sub-tables of this table in file order, e.g. the fibers in [fiber.NAME].
  std::vector<std::string> table_names() const;

  /// Throws for the first key of this table (recursively, in file order) that nobody asked for;
  /// names the nearest known key if close. Called on the root it covers the whole document, tables
  /// never asked for included.
  void finish() const;

  /// A ConfigError located at `key` of this table (or at the table itself where the key is absent).
  [[noreturn]] void fail(std::string_view key, const std::string& message) const;

  /// All keys asked for so far in this document, sorted by path, without duplicates.
  std::vector<AskedKey> asked_keys() const;

  /// Path of the document as given to load() / parse().
  const std::string& document_name() const;

  /// Canonical text of the whole table (sorted keys, shortest round-trip numbers, no comments):
  /// equal content, equal text. Used for cache keys. Files asked for by content_file() before stand
  /// in it by their content.
  std::string canonical_text() const;

 private:
  struct Document;
  struct Node;
  TomlTable(std::shared_ptr<Document> document, const Node* node);
  std::shared_ptr<Document> document_;
  const Node* node_;
};

}  // namespace heddle

#endif  // HEDDLE_FORMATS_TOML_TABLE_H_
