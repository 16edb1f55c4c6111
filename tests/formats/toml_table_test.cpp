#include "formats/toml_table.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "formats/input_error.h"
#include "tests/support/mutations.h"

namespace heddle {
namespace {

template <class Function>
std::string message_of(Function function) {
  try {
    function();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TomlTable parse(const std::string& text) {
  return TomlTable::parse(text, "dir/f.toml");
}

constexpr const char* kFabric =
    "# a fabric\n"
    "name = \"x\"\n"
    "\n"
    "[yarn.warp]\n"
    "radius_um = 120 # thin\n"
    "\tply = 'two'\n"
    "face = \"up\"\n"
    "[[light]]\n"
    "axis = [0, 0.5, 1]\n"
    "[[light]]\n"
    "axis = [1, 0, 0]\n";

TEST(TomlTableTest, ReadsValuesOfEveryType) {
  const TomlTable t = parse(
      "i = -3\nn = 2.5\nwhole = 4\nb = true\ns = \"text\"\np = [1, 2.5]\nv = [1, 2, 3]\n[sub]\nk = "
      "1\n[[list]]\nk = 2\n");
  EXPECT_EQ(t.integer("i", -5, 5), -3);
  EXPECT_EQ(t.number("n", {0, 10}), 2.5);
  EXPECT_EQ(t.number("whole", {0, 10}), 4.0);
  EXPECT_TRUE(t.boolean("b"));
  EXPECT_EQ(t.string("s"), "text");
  EXPECT_EQ(t.choice("s", {"other", "text"}), "text");
  EXPECT_EQ(t.number2("p", {}), (std::array<double, 2>{1, 2.5}));
  EXPECT_EQ(t.number3("v", {}), (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(t.table("sub").integer("k", 0, 9), 1);
  ASSERT_EQ(t.tables("list").size(), 1u);
  EXPECT_EQ(t.tables("list")[0].integer("k", 0, 9), 2);
  EXPECT_TRUE(t.has("sub"));
  EXPECT_FALSE(t.has("none"));
  EXPECT_NO_THROW(t.finish());
}

TEST(TomlTableTest, ReadsArraysOfAnyLengthInARange) {
  const TomlTable t = parse("a = [1, 2.5, -3]\nb = []\nc = [1, 20]\n");
  EXPECT_EQ(t.numbers("a", {-5, 5}, 1, 3), (std::vector<double>{1, 2.5, -3}));
  EXPECT_TRUE(t.numbers("b", {}, 0, 4).empty());
  EXPECT_THROW(t.numbers("a", {-5, 5}, 1, 2), ConfigError);
  EXPECT_THROW(t.numbers("b", {}, 1, 4), ConfigError);
  EXPECT_THROW(t.numbers("c", {0, 10}, 1, 4), ConfigError);
  EXPECT_THROW(t.numbers("d", {}, 0, 4), ConfigError);
}

TEST(TomlTable, ReadsStringsAndColours) {
  const TomlTable t = parse(
      "a = [\"x\", \"y z\"]\nb = [\"x\", 1]\nc = [0.25, 1, 0]\n"
      "d = \"#ff0080\"\ne = \"#ff008\"\nf = \"#ff00g0\"\ng = [0, 0, 2]");
  EXPECT_EQ(t.strings("a", 1, 2), (std::vector<std::string>{"x", "y z"}));
  EXPECT_THROW(t.strings("a", 3, 4), ConfigError);
  EXPECT_THROW(t.strings("b", 1, 2), ConfigError);
  EXPECT_EQ(t.color("c"), (std::array<double, 3>{0.25, 1, 0}));
  // 0x80 / 255 = 0.50196 of sRGB is 0.21586 of linear light.
  const std::array<double, 3> hex = t.color("d");
  EXPECT_EQ(hex[0], 1);
  EXPECT_EQ(hex[1], 0);
  EXPECT_NEAR(hex[2], 0.21586, 1e-5);
  for (const char* key : {"e", "f", "g"}) EXPECT_THROW(t.color(key), ConfigError) << key;
}

TEST(TomlTableTest, AbsentKeysGiveFallbacks) {
  const TomlTable t = parse("");
  EXPECT_EQ(t.integer("i", -5, 5, 2), 2);
  EXPECT_EQ(t.number("n", {0, 10}, 1.5), 1.5);
  EXPECT_FALSE(t.optional_number("o", {}).has_value());
  EXPECT_FALSE(t.boolean("b", false));
  EXPECT_EQ(t.string("s", "text"), "text");
  EXPECT_EQ(t.choice("c", {"a", "b"}, "b"), "b");
  EXPECT_EQ(t.number2("p", {}, {{1, 2}}), (std::array<double, 2>{1, 2}));
  EXPECT_EQ(t.number3("v", {}, {{1, 2, 3}}), (std::array<double, 3>{1, 2, 3}));
  EXPECT_FALSE(t.optional_table("t").has_value());
  EXPECT_TRUE(t.tables("list").empty());
  EXPECT_TRUE(parse("list = []\n").tables("list").empty());
}

TEST(TomlTableTest, ErrorShowsPlaceLineAndCaret) {
  const TomlTable warp = parse(kFabric).table("yarn").table("warp");
  EXPECT_EQ(message_of([&] {
              warp.number("radius_um", {0, 100, true});
            }),
            "dir/f.toml:5:13: 'radius_um': expected a number in (0, 100], found the integer 120\n"
            "  radius_um = 120 # thin\n"
            "              ^");
  // A tab before the value stays a tab before the caret, so that the two line up.
  EXPECT_EQ(message_of([&] { warp.integer("ply", 1, 9); }),
            "dir/f.toml:6:8: 'ply': expected an integer in [1, 9], found the string \"two\"\n"
            "  \tply = 'two'\n"
            "  \t      ^");
  EXPECT_EQ(message_of([&] {
              warp.choice("face", {"face", "both"});
            }),
            "dir/f.toml:7:8: 'face': expected one of \"face\", \"both\", found the string \"up\"\n"
            "  face = \"up\"\n"
            "         ^");
}

TEST(TomlTableTest, CaretCountsCodePoints) {
  EXPECT_EQ(message_of([] { parse("k = ['\xC3\xA9\xC3\xA9', 1]").number2("k", {}); }),
            "dir/f.toml:1:6: 'k': expected a number, found the string \"\xC3\xA9\xC3\xA9\"\n"
            "  k = ['\xC3\xA9\xC3\xA9', 1]\n"
            "       ^");
  EXPECT_EQ(message_of([] { parse("k = [\"\xC3\xA9\", nan]").number2("k", {}); }).substr(0, 15),
            "dir/f.toml:1:6:");
  EXPECT_EQ(message_of([] { parse("k = [2, 'x']  # \xC3\xA9").number2("k", {}); }).substr(0, 15),
            "dir/f.toml:1:9:");
  EXPECT_EQ(message_of([] { parse("t = { '\xC3\xA9' = 1, b = 2 }").table("t").string("b"); }),
            "dir/f.toml:1:20: 'b': expected a string, found the integer 2\n"
            "  t = { '\xC3\xA9' = 1, b = 2 }\n"
            "                     ^");
}

TEST(TomlTableTest, WrongTypesSayWhatWasExpectedAndFound) {
  const TomlTable t = parse("a = true\nb = 1.5\nc = [1, 2]\nd = 1979-05-27\n[e]\n");
  const auto first_line = [&](auto function) {
    const std::string message = message_of(function);
    return message.substr(0, message.find('\n'));
  };
  EXPECT_EQ(first_line([&] { t.number("a", {}); }),
            "dir/f.toml:1:5: 'a': expected a number, found the boolean true");
  EXPECT_EQ(first_line([&] { t.optional_number("a", {}); }),
            "dir/f.toml:1:5: 'a': expected a number, found the boolean true");
  EXPECT_EQ(first_line([&] { t.integer("b", 0, 9); }),
            "dir/f.toml:2:5: 'b': expected an integer in [0, 9], found the number 1.5");
  EXPECT_EQ(first_line([&] { t.number3("c", {}); }),
            "dir/f.toml:3:5: 'c': expected an array of 3 numbers, found an array of 2");
  EXPECT_EQ(first_line([&] { t.boolean("d"); }),
            "dir/f.toml:4:5: 'd': expected true or false, found a date or time");
  EXPECT_EQ(first_line([&] { t.string("e"); }),
            "dir/f.toml:5:1: 'e': expected a string, found a table");
  EXPECT_EQ(first_line([&] { t.table("a"); }),
            "dir/f.toml:1:5: 'a': expected a table, found the boolean true");
  EXPECT_EQ(first_line([&] { t.tables("e"); }),
            "dir/f.toml:5:1: 'e': expected an array of tables ([[e]]), found a table");
  EXPECT_EQ(first_line([&] { t.tables("c"); }),
            "dir/f.toml:3:5: 'c': expected an array of tables ([[c]]), found an array of 2");
}

TEST(TomlTableTest, RangesAreClosedUnlessSaidOtherwise) {
  const TomlTable t = parse("zero = 0\none = 1.0\nbelow = -1e-300\nv = [0, 2, 0]\n");
  EXPECT_EQ(t.number("zero", {0, 1}), 0);
  EXPECT_EQ(t.number("one", {0, 1}), 1);
  EXPECT_NE(message_of([&] {
              t.number("zero", {0, 1, true});
            }).find("in (0, 1]"),
            std::string::npos);
  EXPECT_NE(message_of([&] { t.number("below", {.min = 0}); }).find("a number >= 0, found"),
            std::string::npos);
  EXPECT_NE(message_of([&] { t.number("one", {.max = 0.5}); }).find("a number <= 0.5, found"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              t.number("zero", {.min = 0, .exclusive_min = true});
            }).find("a number > 0, found"),
            std::string::npos);
  EXPECT_EQ(message_of([&] { t.number3("v", {0, 1}); }).substr(0, 16), "dir/f.toml:4:9: ");
  EXPECT_NE(message_of([&] {
              t.integer("zero", 1, std::numeric_limits<std::int64_t>::max());
            }).find("integer >= 1"),
            std::string::npos);
}

TEST(TomlTableTest, NonFiniteNumbersAreRefusedWithTheirPlace) {
  for (const char* text : {"k = nan", "k = +nan", "k = inf", "k = -inf"}) {
    const std::string message = message_of([&] { parse(text).number("k", {}); });
    EXPECT_EQ(message.substr(0, 15), "dir/f.toml:1:5:") << message;
    EXPECT_NE(message.find("finite"), std::string::npos) << message;
  }
  EXPECT_EQ(message_of([] { parse("k = [0, inf, 1]").number3("k", {}); }).substr(0, 15),
            "dir/f.toml:1:9:");
  EXPECT_NE(message_of([] { parse("k = inf").optional_number("k", {}); }), "no error");
}

TEST(TomlTableTest, MissingKeyNamesKeyUnitAndTable) {
  const TomlTable warp = parse(kFabric).table("yarn").table("warp");
  EXPECT_EQ(message_of([&] {
              warp.number("pitch_mm", {0, 9, true});
            }),
            "dir/f.toml:4:1: missing key 'pitch_mm' in [yarn.warp]: expected a number in (0, 9], "
            "in millimetres\n"
            "  [yarn.warp]\n"
            "  ^");
  EXPECT_EQ(message_of([&] { parse("\nx = 1\n").table("weave"); }).substr(0, 74),
            "dir/f.toml:1:1: missing key 'weave' at the top level: expected a table\n  \n");
  // In an array of tables the place is the element's own header.
  EXPECT_EQ(
      message_of([] { parse(kFabric).tables("light")[1].string("kind"); }),
      "dir/f.toml:10:1: missing key 'kind' in [[light]]: expected a string\n  [[light]]\n  ^");
  EXPECT_NE(message_of([] {
              parse("raduis_um = 3\n").number("radius_um", {});
            }).find("is 'raduis_um' on line 1 meant for it?"),
            std::string::npos);
}

TEST(TomlTableTest, WrongUnitPointsAtTheKeyAndNamesTheExpectedOne) {
  EXPECT_EQ(message_of([] {
              parse("[a]\nradius_mm = 1\n").table("a").number("radius_um", {0, 9});
            }),
            "dir/f.toml:2:1: wrong unit: the expected key is 'radius_um' (a number in [0, 9], in "
            "micrometres), "
            "found 'radius_mm'\n  radius_mm = 1\n  ^");
  EXPECT_NE(message_of([] {
              parse("radius = 1\n").number("radius_um", {});
            }).find("expected key is 'radius_um'"),
            std::string::npos);
  // The same for a key that has a default, found by finish().
  EXPECT_EQ(
      message_of([] {
        const TomlTable t = parse("radius_mm = 1\n");
        t.number("radius_um", {}, 3.0);
        t.finish();
      }),
      "dir/f.toml:1:1: unknown key 'radius_mm' at the top level; wrong unit: the expected key is "
      "'radius_um'\n"
      "  radius_mm = 1\n  ^");
  // Another quantity with another unit is not the same key.
  EXPECT_NE(
      message_of([] { parse("length_mm = 1\n").number("radius_um", {}); }).find("missing key"),
      std::string::npos);
}

TEST(TomlTableTest, FinishFindsTheFirstUnknownKeyInFileOrder) {
  const auto finish = [](auto ask) {
    return message_of([&] {
      const TomlTable t = parse(kFabric);
      ask(t);
      t.finish();
    });
  };
  EXPECT_EQ(finish([](const TomlTable&) {}).substr(0, 51),
            "dir/f.toml:2:1: unknown key 'name' at the top level");
  // A table nobody asked for, and a table whose parent alone was asked for.
  EXPECT_EQ(finish([](const TomlTable& t) { t.string("name"); }).substr(0, 35),
            "dir/f.toml:4:2: unknown key 'yarn' ");
  EXPECT_EQ(finish([](const TomlTable& t) {
              t.string("name");
              t.table("yarn");
            }).substr(0, 44),
            "dir/f.toml:4:7: unknown key 'warp' in [yarn]");
  // Inside the second element of an array of tables.
  EXPECT_EQ(finish([](const TomlTable& t) {
              t.string("name");
              const TomlTable warp = t.table("yarn").table("warp");
              warp.number("radius_um", {});
              warp.string("ply");
              warp.string("face");
              t.tables("light")[0].number3("axis", {});
            }),
            "dir/f.toml:11:1: unknown key 'axis' in [[light]]\n  axis = [1, 0, 0]\n  ^");
}

TEST(TomlTableTest, UnknownKeySuggestsTheNearest) {
  const auto message = [](const std::string& text) {
    return message_of([&] {
      const TomlTable t = parse(text);
      t.number("gloss", {}, 1);
      t.number("twist_per_mm", {}, 1);
      t.finish();
    });
  };
  EXPECT_NE(message("glos = 1\n").find("did you mean 'gloss'?"), std::string::npos);
  EXPECT_NE(message("glsos = 1\n").find("did you mean 'gloss'?"), std::string::npos);
  EXPECT_NE(message("twsit_per_mm = 1\n").find("did you mean 'twist_per_mm'?"), std::string::npos);
  EXPECT_NE(message("twist_per_cm = 1\n").find("the expected key is 'twist_per_mm'"),
            std::string::npos);
  EXPECT_NE(message("colour = 1\n").find("known here: gloss, twist_per_mm"), std::string::npos);
}

TEST(TomlTableTest, FailPointsAtKeyOrTable) {
  const TomlTable light = parse(kFabric).tables("light")[1];
  EXPECT_EQ(message_of([&] { light.fail("axis", "must point up"); }),
            "dir/f.toml:11:1: 'axis': must point up\n  axis = [1, 0, 0]\n  ^");
  EXPECT_EQ(message_of([&] { light.fail("absent", "is needed"); }),
            "dir/f.toml:10:1: 'absent': is needed\n  [[light]]\n  ^");
  EXPECT_EQ(message_of([&] { light.fail("", "a light needs more"); }),
            "dir/f.toml:10:1: a light needs more\n  [[light]]\n  ^");
}

TEST(TomlTableTest, SyntaxErrorsHaveTheirPlace) {
  const auto place = [](const std::string& text) {
    const std::string message = message_of([&] { parse(text); });
    return message.substr(0, message.find(' '));
  };
  EXPECT_EQ(place("a = 1\nb = = 2\n"), "dir/f.toml:2:5:");
  EXPECT_EQ(place("a = 1\na = 2\n").substr(0, 13), "dir/f.toml:2:");
  EXPECT_EQ(place("[a\n").substr(0, 13), "dir/f.toml:1:");
  EXPECT_EQ(place("a = \"\xff\"\n"), "dir/f.toml:1:5:");
  EXPECT_NE(message_of([] { parse(std::string(100000, '[')); }), "no error");
  EXPECT_NE(message_of([] { parse("a = " + std::string(100000, '[')); }), "no error");
  EXPECT_NE(message_of([] { parse("a = 1e400\n").number("a", {}); }), "no error");
  EXPECT_NE(message_of([] { parse("a = 99999999999999999999\n"); }), "no error");
}

std::string repeated(const std::string& text, int count) {
  std::string result;
  for (int k = 0; k < count; ++k) result += text;
  return result;
}

TEST(TomlTableTest, TablesAndArraysWithinEachOtherAreAtMost64) {
  const auto place = [](const std::string& text) {
    const std::string message = message_of([&] { parse(text).canonical_text(); });
    return message.substr(
        0, message.find(": syntax: more than 64 tables and arrays within each other"));
  };
  // Each form at the limit, and one deeper: the place is that of the dot or bracket that goes too
  // deep.
  EXPECT_EQ(place("a" + repeated(".a", 64) + " = 1\n"), "no error");
  EXPECT_EQ(place("a" + repeated(".a", 65) + " = 1\n"), "dir/f.toml:1:130");
  EXPECT_EQ(place("[a" + repeated(".a", 63) + "]\n"), "no error");
  EXPECT_EQ(place("\n[a" + repeated(" . a", 64) + "]\n"), "dir/f.toml:2:256");
  EXPECT_EQ(place("[[a" + repeated(".a", 62) + "]]\n"), "no error");
  EXPECT_EQ(place("[[a" + repeated(".a", 63) + "]]\n"), "dir/f.toml:1:128");
  EXPECT_EQ(place("a = " + repeated("[", 64) + repeated("]", 64)), "no error");
  EXPECT_EQ(place("a = " + repeated("[", 65) + repeated("]", 65)), "dir/f.toml:1:69");
  EXPECT_EQ(place("a = " + repeated("{a=", 64) + "1" + repeated("}", 64)), "no error");
  EXPECT_EQ(place("a = " + repeated("{a=", 65) + "1" + repeated("}", 65)), "dir/f.toml:1:197");
  // Headers, keys, inline tables and arrays add up.
  const std::string header = "[h" + repeated(".h", 29) + "]\n";
  EXPECT_EQ(place(header + "k" + repeated(".k", 10) + " = [{x" + repeated(".x", 22) + " = 1}]\n"),
            "no error");
  EXPECT_EQ(place(header + "k" + repeated(".k", 10) + " = [{x" + repeated(".x", 23) + " = 1}]\n"),
            "dir/f.toml:2:72");
  EXPECT_EQ(place(header + "k = 1\n[b]\nk" + repeated(".k", 63) + " = 1\n"), "no error");
}

TEST(TomlTableTest, DepthIsRefusedBeforeItIsBuilt) {
  for (const int depth : {30'000, 100'000}) {
    for (const std::string& text :
         {"a" + repeated(".a", depth) + " = 1", "[a" + repeated(".a", depth) + "]",
          "[[a" + repeated(".a", depth) + "]]", "a = {a" + repeated(".a", depth) + " = 1}",
          "a = " + repeated("[", depth), "a = " + repeated("{a.b = [", depth)}) {
      const std::string message = message_of([&] { parse(text); });
      EXPECT_NE(message.find("more than 64 tables and arrays within each other"), std::string::npos)
          << message;
      EXPECT_LT(message.size(), 400u) << "an excerpt, not the whole line";
    }
  }
}

TEST(TomlTableTest, WhatOnlyLooksNestedIsNot) {
  const std::string dots = repeated(".", 500);
  const std::string brackets = repeated("[{", 500);
  for (const std::string& text :
       {"# " + dots + brackets + "\na = 1 # " + brackets,
        "a = \"" + dots + brackets + "\\\"" + brackets + "\"",
        "a = '" + brackets + "\\'  # '" + brackets,
        "a = \"\"\"\n" + brackets + "\"\"\\\"\"\"" + brackets + "\"\"\"\"\"",
        "a = \'\'\'\n" + brackets + "''\n\'\'\'\'\'", "\"" + dots + "\".'" + brackets + "' = 1",
        "[\"" + dots + "\".'" + brackets + "']", "a = [" + repeated("1.5, ", 500) + "]",
        "a = [\n" + repeated("{x.y = 1.5}, # [[\n", 500) + "]",
        std::string("a = {x.y = 1.5, x.z = 2.5}"), repeated("[[a.b]]\nk.l = 07:32:00.999\n", 500),
        repeated("[[a.b]]\nk = [[1.5], [2.5]]\n", 500)}) {
    EXPECT_EQ(message_of([&] { parse(text); }), "no error") << text.substr(0, 60);
  }
}

TEST(TomlTableTest, LongLinesAreQuotedInPart) {
  const std::string long_text = std::string("'").append(500, 'x').append("'");
  EXPECT_EQ(message_of([&] { parse("k = " + long_text).number("k", {}); }),
            "dir/f.toml:1:5: 'k': expected a number, found the string \"" + std::string(40, 'x') +
                "...\"\n  k = '" + std::string(115, 'x') + "...\n      ^");
  EXPECT_EQ(message_of([&] {
              parse("a = [" + long_text + ", " + long_text + ", 3]").numbers("a", {}, 0, 2);
            }).substr(0, 16),
            "dir/f.toml:1:5: ");
  EXPECT_EQ(
      message_of([&] {
        parse("t = {a = " + long_text + ", b = 2, c = " + long_text + "}").table("t").string("b");
      }),
      "dir/f.toml:1:518: 'b': expected a string, found the integer 2\n  ..." +
          std::string(53, 'x') + "', b = 2, c = '" + std::string(52, 'x') + "...\n     " +
          std::string(60, ' ') + "^");
  // A long name in titles, and in the message about itself.
  const std::string name(100'000, 'n');
  std::string text = "[" + name + "]\n";
  for (int k = 0; k < 10'000; ++k) text.append("k").append(std::to_string(k)).append(" = {}\n");
  const std::string message = message_of([&] { parse(text).finish(); });
  EXPECT_NE(message.find("unknown key '" + name.substr(0, 40) + "...'"), std::string::npos)
      << message.substr(0, 300);
  EXPECT_LT(message.size(), 400u);
}

TEST(TomlTableTest, DocumentsAreAtMostOneMebibyte) {
  const auto of_size = [](std::size_t size) { return std::string(size - 1, ' ') + "\n"; };
  EXPECT_EQ(message_of([&] { parse(of_size(1 << 20)); }), "no error");
  EXPECT_EQ(message_of([&] { parse(of_size((1 << 20) + 1)); }),
            "dir/f.toml: 1048577 bytes; a config has at most 1048576");
  // The size alone is asked of a file, nothing is read: this one is sparse.
  const auto path = std::filesystem::path(testing::TempDir()) / "toml_table_sparse.toml";
  std::ofstream(path) << "";
  std::filesystem::resize_file(path, std::uintmax_t{100} << 30);
  EXPECT_EQ(message_of([&] { TomlTable::load(path); }),
            path.string() + ": 107374182400 bytes; a config has at most 1048576");
  std::filesystem::remove(path);
}

TEST(TomlTableTest, ControlCharactersDoNotReachTheTerminal) {
  const std::string message = message_of([] { parse("a = \"\\u001b[31m\"\n").number("a", {}); });
  EXPECT_EQ(message.find('\x1b'), std::string::npos) << message;
}

TEST(TomlTableTest, UnreadableFileIsAConfigError) {
  EXPECT_EQ(message_of([] { TomlTable::load("/nonexistent/f.toml"); }),
            "/nonexistent/f.toml: cannot open: No such file or directory");
  EXPECT_NE(message_of([] { TomlTable::load(std::filesystem::temp_directory_path()); }),
            "no error");
}

TEST(TomlTableTest, FilesAreRelativeToTheDocument) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "toml_table_files";
  std::filesystem::create_directories(folder / "meshes");
  std::ofstream(folder / "meshes" / "a.obj") << "v 0 0 0\n";
  std::ofstream(folder / "scene.toml")
      << "mesh = \"meshes/a.obj\"\nother = \"meshes/b.obj\"\nfolder = \"meshes\"\n";
  const TomlTable t = TomlTable::load(folder / "scene.toml");
  EXPECT_EQ(t.document_name(), (folder / "scene.toml").string());
  EXPECT_EQ(t.existing_file("mesh"), folder / "meshes/a.obj");
  const std::string message = message_of([&] { t.existing_file("other"); });
  EXPECT_NE(message.find("scene.toml:2:9: 'other': there is no file '"), std::string::npos)
      << message;
  EXPECT_NE(message_of([&] { t.existing_file("folder"); }).find(":3:10:"), std::string::npos);
}

TEST(TomlTableTest, TableNamesComeInFileOrder) {
  const TomlTable t = parse("[fiber.zinc]\n[other]\n[fiber.alpha]\n[fiber.mid]\nx = 1\n");
  EXPECT_EQ(t.table("fiber").table_names(), (std::vector<std::string>{"zinc", "alpha", "mid"}));
}

TEST(TomlTableTest, AskedKeysDescribeTheReader) {
  const TomlTable t = parse("[fiber.silk]\n[fiber.wool]\n[[light]]\n[[light]]\n[yarn]\n");
  const TomlTable fibers = t.table("fiber");
  for (const std::string& name : fibers.table_names()) {
    const TomlTable fiber = fibers.table(name);
    fiber.number("beta_deg", {0, 90, true}, 5.5);
  }
  for (const TomlTable& light : t.tables("light")) light.number3("axis", {}, {{0, 0, 1}});
  const TomlTable yarn = t.table("yarn");
  yarn.choice("side", {"face", "both"}, "face");
  yarn.optional_number("gap_mm", {0});
  EXPECT_THROW(yarn.integer("count", 1, 9), ConfigError);

  std::vector<std::string> lines;
  for (const AskedKey& key : t.asked_keys()) {
    lines.push_back(key.path + "; " + key.type + "; " + key.range + "; " + key.default_value);
  }
  EXPECT_EQ(lines, (std::vector<std::string>{
                       "fiber; table; ; required",
                       "fiber.NAME; table; ; required",
                       "fiber.NAME.beta_deg; number; (0, 90]; 5.5",
                       "light[]; table[]; ; optional",
                       "light[].axis; number[3]; ; [0, 0, 1]",
                       "yarn; table; ; required",
                       "yarn.count; integer; [1, 9]; required",
                       "yarn.gap_mm; number; >= 0; optional",
                       "yarn.side; string; face | both; face",
                   }));
}

TEST(TomlTableTest, CanonicalTextDependsOnContentOnly) {
  const std::string text =
      parse("b = 1.0\na = \"q\\\"\\n\"\n[t]\ny = [1, 0x10]\nx = 0.1\n").canonical_text();
  EXPECT_EQ(text, R"({"a":"q\"\u000a","b":1,"t":{"x":0.1,"y":[1,16]}})");
  EXPECT_EQ(text, parse("# comment\nt.y = [ 1,\n  16 ]\na = '''\nq\"\n'''\nb = 1\nt.x = 1e-1\n")
                      .canonical_text());
  for (const char* other : {"b = 1.0\na = \"q\\\"\\n\"\n[t]\ny = [16, 1]\nx = 0.1\n",
                            "b = 1.0\na = \"q\\\"\\n\"\n[t]\ny = [1, 16]\nx = 0.1000000000000001\n",
                            "b = true\na = \"q\\\"\\n\"\n[t]\ny = [1, 16]\nx = 0.1\n",
                            "b = '1'\na = \"q\\\"\\n\"\n[t]\ny = [1, 16]\nx = 0.1\n"}) {
    EXPECT_NE(text, parse(other).canonical_text()) << other;
  }
  EXPECT_NE(parse("d = 1979-05-27\n").canonical_text(), parse("d = 1979-05-28\n").canonical_text());
  EXPECT_EQ(parse("a = 1\n[t]\nk = 2\n").table("t").canonical_text(), R"({"k":2})");
}

TEST(TomlTableTest, DamagedDocumentsEndInValuesOrAnErrorWithItsPlace) {
  const std::string whole =
      std::string(kFabric) + "t = {a.b = \"\"\"x\"\"\", c = [[1.5], ['y']]} # end\n";
  int damaged = 0;
  for_each_mutation(
      whole, 1, std::string_view("\0\n\"'[]{}.,=#\\\xff", 14), [&](const std::string& text) {
        const std::string message = message_of([&] {
          const TomlTable t = parse(text);
          EXPECT_FALSE(t.canonical_text().empty());
          t.finish();
        });
        const bool holds_nothing = text.find_first_not_of("# abcfir\n") == std::string::npos;
        EXPECT_EQ(message.substr(0, 11), holds_nothing ? "no error" : "dir/f.toml:") << text;
        ++damaged;
      });
  EXPECT_GT(damaged, 2000);
}

}  // namespace
}  // namespace heddle
