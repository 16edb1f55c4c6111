#include "fibers/cloth/weave_config.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "formats/input_error.h"
#include "tests/support/mutations.h"
#include "tests/support/temporary_folder.h"

namespace heddle {
namespace {

const std::string kDraft =
    "[WIF]\nVersion=1.1\n[WEAVING]\nShafts=2\nTreadles=2\nRising Shed=yes\n"
    "[COLOR PALETTE]\nRange=0,255\n[COLOR TABLE]\n1=255,0,128\n"
    "[WARP]\nThreads=2\nColor=1\nUnits=Centimeters\nSpacing=0.04\n[WEFT]\nThreads=3\n"
    "[THREADING]\n1=1\n2=2\n[TIEUP]\n1=1\n2=2\n[TREADLING]\n1=1\n2=1\n3=2\n";

class WeaveConfig : public testing::Test {
 protected:
  TomlTable table_of(const std::string& keys) const {
    return TomlTable::parse(keys, (folder_.path() / "fabric.toml").string());
  }
  Weave read(const std::string& keys) const {
    const TomlTable table = table_of(keys);
    const Weave weave = read_weave(table);
    table.finish();
    return weave;
  }
  std::string error_of(const std::string& keys) const {
    try {
      read(keys);
    } catch (const ConfigError& error) {
      return error.what();
    } catch (const FileError& error) {
      return std::string("file: ") + error.what();
    }
    return "no error";
  }
  /// A picture of one letter per pixel, the top row first: w white, k black, r red, g green.
  void draw(const std::vector<std::string>& rows) const {
    std::vector<std::uint8_t> rgb;
    for (const std::string& row : rows) {
      for (const char c : row) {
        for (const char part : {'r', 'g', 'b'}) rgb.push_back(c == 'w' || c == part ? 255 : 0);
      }
    }
    write_png(folder_.path() / "paper.png", static_cast<int>(rows[0].size()),
              static_cast<int>(rows.size()), rgb);
  }
  TemporaryFolder folder_;
};

using Ups = std::vector<std::uint8_t>;

TEST_F(WeaveConfig, ReadsNotationsWithTheirKeys) {
  EXPECT_EQ(read("notation = \"plain\"").warp_up, parse_weave("plain").warp_up);
  EXPECT_EQ(read("notation = \"satin 5/2\"\nface = \"weft\"").warp_up,
            parse_weave("satin 5/2", WeaveFace::kWeft).warp_up);
  EXPECT_EQ(read("notation = \"2/3 satin\"\nstep = 3").warp_up,
            parse_weave("2/3 satin", WeaveFace::kWarp, {.step = 3}).warp_up);
  EXPECT_EQ(read("notation = \"herringbone 2/2\"\ndirection = \"S\"\nwidth = 8").warp_up,
            parse_weave("herringbone 2/2", WeaveFace::kWarp,
                        {.direction = TwillDirection::kS, .width = 8})
                .warp_up);
  EXPECT_EQ(read("matrix = \"10 01 11\"").warp_up, (Ups{1, 1, 0, 1, 1, 0}));
}

TEST_F(WeaveConfig, KeysThatMeanNothingToANotationAreRefused) {
  EXPECT_NE(error_of("notation = \"plain\"\nstep = 2").find("step"), std::string::npos);
  EXPECT_NE(error_of("notation = \"twill 2/2\"\nwidth = 8").find("width"), std::string::npos);
  EXPECT_NE(error_of("notation = \"2/3 satin\"\nface = \"warp\"").find("face"), std::string::npos);
  EXPECT_NE(error_of("notation = \"satin 5/2\"").find("missing key 'face'"), std::string::npos);
  EXPECT_NE(error_of("notation = \"pointed 2/2\"").find("missing key 'width'"), std::string::npos);
  EXPECT_NE(error_of("").find("missing key 'notation'"), std::string::npos);
  EXPECT_NE(error_of("notation = \"plain\"\nmatrix = \"10 01\"").find("expected one of the keys"),
            std::string::npos);
  const std::string wide = error_of("matrix = \"" + std::string(3000, '1') + " 0\"");
  EXPECT_NE(wide.find("row 2 from the top: expected 3000 crossings"), std::string::npos) << wide;
  EXPECT_LT(wide.size(), 600U);
}

TEST_F(WeaveConfig, ADraftBringsItsColoursAndSizes) {
  write_bytes(folder_.path() / "d.wif", kDraft);
  const Weave weave = read("draft = \"d.wif\"");
  EXPECT_EQ(weave.notation, "d.wif");
  EXPECT_EQ(weave.warp_up, (Ups{1, 0, 1, 0, 0, 1}));
  ASSERT_EQ(weave.warp.color.size(), 2U);
  EXPECT_FLOAT_EQ(weave.warp.color[1][0], 1.0F);
  EXPECT_NEAR(weave.warp.color[1][2], 0.2158605F, 1e-6F);  // sRGB 128
  EXPECT_TRUE(weave.weft.color.empty());
  EXPECT_NEAR(weave.warp.spacing_mm.at(0), 0.4, 1e-12);
  EXPECT_EQ(read("draft = \"d.wif\"\nrising_shed = false").warp_up, (Ups{0, 1, 0, 1, 1, 0}));
  EXPECT_NE(error_of("draft = \"none.wif\"").find("there is no file"), std::string::npos);
  write_bytes(folder_.path() / "bad.wif", "[WIF]\n");
  EXPECT_NE(error_of("draft = \"bad.wif\"").find("bad.wif: expected a section"), std::string::npos);
}

TEST_F(WeaveConfig, ThePapersTopRowIsTheLastPick) {
  draw({"kw", "kk", "ww"});
  EXPECT_EQ(read("picture = \"paper.png\"").warp_up, (Ups{0, 0, 1, 1, 1, 0}));
}

TEST_F(WeaveConfig, ColoursOfAPaperAreWarpOrWeft) {
  draw({"rgw", "kwr"});
  const Ups red_and_black = {1, 0, 1, 1, 0, 0};
  EXPECT_EQ(read("picture = \"paper.png\"\nwarp_colors = [\"#ff0000\", \"#000000\"]").warp_up,
            red_and_black);
  EXPECT_EQ(read("picture = \"paper.png\"\nweft_colors = [\"#00FF00\", \"#ffffff\"]").warp_up,
            red_and_black);
  EXPECT_EQ(read("picture = \"paper.png\"\nwarp_colors = [\"#ff0000\", \"#000000\"]\nweft_colors = "
                 "[\"#00FF00\", \"#ffffff\"]")
                .warp_up,
            red_and_black);
  const auto error = [&](const std::string& keys) {
    return error_of("picture = \"paper.png\"\n" + keys);
  };
  EXPECT_NE(error("warp_colors = [\"red\"]").find("expected colours \"#rrggbb\""),
            std::string::npos);
  EXPECT_NE(error("warp_colors = [\"#ff0001\"]").find("#ff0001 is nowhere"), std::string::npos);
  EXPECT_NE(error("warp_colors = [\"#ff0000\"]\nweft_colors = [\"#ff0000\"]").find("both"),
            std::string::npos);
  EXPECT_NE(error("warp_colors = [\"#ff0000\"]\nweft_colors = [\"#00ff00\"]")
                .find("column 1, row 2 from the top is #000000"),
            std::string::npos);
  EXPECT_NE(error("warp_colors = [1]").find("expected a string"), std::string::npos);
}

TEST_F(WeaveConfig, FilesEnterTheCanonicalTextByTheirContent) {
  const auto text_of = [&](const std::string& keys) {
    const TomlTable table = table_of(keys);
    read_weave(table);
    return table.canonical_text();
  };
  write_bytes(folder_.path() / "d.wif", kDraft);
  write_bytes(folder_.path() / "moved.wif", kDraft);
  const std::string before = text_of("draft = \"d.wif\"");
  EXPECT_EQ(text_of("draft = \"moved.wif\""), before);
  write_bytes(folder_.path() / "d.wif", kDraft + "[WARP COLORS]\n1=1\n");
  EXPECT_NE(text_of("draft = \"d.wif\""), before);
}

}  // namespace
}  // namespace heddle
