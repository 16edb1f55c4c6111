#include "pipeline/json_file.h"

#include <gtest/gtest.h>

#include <string>

#include "formats/json_text.h"
#include "pipeline/accuracy/accuracy_table.h"
#include "pipeline/warnings.h"
#include "tests/formats/file_fixture.h"

namespace heddle {
namespace {

class JsonFileFormat : public FileFixture {
 protected:
  static std::string nested(int depth) {
    const auto brackets = static_cast<std::size_t>(depth);
    return std::string(brackets, '[') + std::string(brackets, ']');
  }
};

TEST_F(JsonFileFormat, NestedDeeperThanTheLimitIsRefusedByName) {
  EXPECT_EQ(read_json(put("a.json", nested(kMaxJsonDepth))).dump(), nested(kMaxJsonDepth));
  for (const int depth : {kMaxJsonDepth + 1, 70'000, 1'000'000}) {
    const auto path = put("deep.json", nested(depth));
    for (const std::string& error :
         {error_of([&] { read_json(path); }), error_of([&] { read_accuracy(path); }),
          error_of([&] { read_warnings(path); })}) {
      EXPECT_EQ(error, path.string() + ": JSON nested deeper than 64");
    }
  }
}

TEST_F(JsonFileFormat, WhatIsNoJsonIsRefusedByName) {
  for (const char* text : {"", "{", "[1,]", "{\"a\":1e999}", "\"\xff\"", "{} {}"}) {
    const auto path = put("broken.json", text);
    EXPECT_EQ(error_of([&] { read_json(path); }).find(path.string() + ": not JSON: "), 0U) << text;
  }
}

TEST_F(JsonFileFormat, WarningsOfAPicturesReportAreReadBack) {
  EXPECT_TRUE(read_warnings(put("r.json", "{}")).empty());
  const auto path = put(
      "r.json",
      R"({"warnings":[{"subject":"s","what":"w","expected_relative_error":0.5,"instead":"i"}]})");
  ASSERT_EQ(read_warnings(path).size(), 1U);
  EXPECT_EQ(read_warnings(path)[0].what, "w");
  for (const char* text :
       {"[]", "3", R"({"warnings":3})", R"({"warnings":[3]})", R"({"warnings":[{"subject":"s"}]})",
        R"({"warnings":[{"subject":1,"what":"w","expected_relative_error":0.5,"instead":"i"}]})"}) {
    EXPECT_EQ(error_of([&] {
                read_warnings(put("r.json", text));
              }).find((folder_ / "r.json").string() + ": no picture's report"),
              0U)
        << text;
  }
}

}  // namespace
}  // namespace heddle
