#include "formats/numbered_file.h"

#include <gtest/gtest.h>

namespace heddle {
namespace {

TEST(NumberedFile, TheLastRunBecomesTheFrame) {
  EXPECT_EQ(numbered_path("out/drape_####.exr", 7), "out/drape_0007.exr");
  EXPECT_EQ(numbered_path("a#.obj", 123), "a123.obj");
  EXPECT_EQ(numbered_path("take#2_##.obj", 5), "take#2_05.obj");
  EXPECT_EQ(numbered_path("####.png", 12), "0012.png");
  EXPECT_EQ(numbered_path("##", 3), "03");
  EXPECT_EQ(with_number_as("out/drape_####.exr", "sheet"), "out/drape_sheet.exr");
}

TEST(NumberedFile, FoldersHaveNoNumbers) {
  EXPECT_TRUE(is_numbered("shot#/a_#.obj"));
  EXPECT_FALSE(is_numbered("shot#/a.obj"));
  EXPECT_EQ(numbered_path("shot#/a_#.obj", 2), "shot#/a_2.obj");
}

}  // namespace
}  // namespace heddle
