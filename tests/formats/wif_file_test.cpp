#include "formats/wif_file.h"

#include <gtest/gtest.h>

#include <string>

#include "formats/input_error.h"
#include "tests/support/mutations.h"

namespace heddle {
namespace {

// A 2/2 twill of two repeats along the warp, with all that a draft can say.
const std::string kTwill =
    "[WIF]\nVersion=1.1\n"
    "[CONTENTS]\nCOLOR TABLE=true\nTHREADING=true\nTIEUP=true\nTREADLING=true\n"
    "[COLOR PALETTE]\nRange=0,255\nEntries=2\n"
    "[COLOR TABLE]\n1=255,0,51\n2=0,102,255\n"
    "[WEAVING]\nShafts=4\nTreadles=4\nRising Shed=yes\n"
    "[WARP]\nThreads=4\nColor=1\nUnits=Centimeters\nSpacing=0.04\nThickness=0.03\n"
    "[WEFT]\nThreads=8\nColor=2\nUnits=Centimeters\nSpacing=0.05\n"
    "[TEXT]\nTitle=2/2 twill; not a comment\n"
    "[THREADING]\n1=1\n2=2\n3=3\n4=4\n"
    "[TIEUP]\n1=1,2\n2=2,3\n3=3,4\n4=1,4\n"
    "[TREADLING]\n1=1\n2=2\n3=3\n4=4\n5=1\n6=2\n7=3\n8=4\n";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

WifDraft read(const std::string& text, std::optional<bool> rising = {}) {
  return parse_wif(text, "d.wif", rising);
}

std::string error_of(const std::string& text) {
  try {
    read(text);
  } catch (const FileError& error) {
    return error.what();
  }
  return "no error";
}

// The drawdown from the first pick up.
std::string picks_of(const WifDraft& draft) {
  std::string text;
  for (std::size_t k = 0; k < draft.warp_up.size(); ++k) {
    if (k > 0 && k % draft.threading.size() == 0) text += ' ';
    text += draft.warp_up[k] != 0 ? '1' : '0';
  }
  return text;
}

const std::string kTwillPicks = "1100 0110 0011 1001 1100 0110 0011 1001";

TEST(WifFileFormat, ReadsADraft) {
  const WifDraft draft = read(kTwill);
  EXPECT_EQ(picks_of(draft), kTwillPicks);
  EXPECT_EQ(draft.title, "2/2 twill; not a comment");
  EXPECT_EQ(draft.ends(), 4);
  EXPECT_EQ(draft.picks(), 8);
  EXPECT_TRUE(draft.warnings.empty());
  ASSERT_EQ(draft.warp.color.size(), 4U);
  EXPECT_EQ(draft.warp.color[3], (std::array<double, 3>{1, 0, 0.2}));
  EXPECT_EQ(draft.weft.color[7], (std::array<double, 3>{0, 0.4, 1}));
  EXPECT_NEAR(draft.warp.spacing_mm.at(3), 0.4, 1e-12);
  EXPECT_NEAR(draft.warp.thickness_mm.at(0), 0.3, 1e-12);
  EXPECT_NEAR(draft.weft.spacing_mm.at(7), 0.5, 1e-12);
  EXPECT_TRUE(draft.weft.thickness_mm.empty());
}

TEST(WifFileFormat, ASinkingShedLowersWhatIsTied) {
  const std::string sinking = replaced(kTwill, "Rising Shed=yes", "Rising Shed=0");
  EXPECT_EQ(picks_of(read(sinking)), "0011 1001 1100 0110 0011 1001 1100 0110");
  EXPECT_EQ(picks_of(read(sinking, true)), kTwillPicks);
}

TEST(WifFileFormat, NoRisingShedKeyMeansSinkingAndAWarning) {
  const std::string none = replaced(kTwill, "Rising Shed=yes\n", "");
  const WifDraft draft = read(none);
  EXPECT_EQ(picks_of(draft), "0011 1001 1100 0110 0011 1001 1100 0110");
  ASSERT_EQ(draft.warnings.size(), 1U);
  EXPECT_NE(draft.warnings[0].find("d.wif:14: no 'Rising Shed'"), std::string::npos);
  EXPECT_EQ(picks_of(read(none, true)), kTwillPicks);
  EXPECT_TRUE(read(none, true).warnings.empty());
}

TEST(WifFileFormat, FormsInTheWildReadTheSame) {
  std::string crlf;
  for (const char c : kTwill) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  std::string spaced;
  for (const char c : kTwill) spaced += c == '=' ? std::string(" = ") : std::string(1, c);
  std::string upper = kTwill;
  for (char& c : upper) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
  const std::string cases[] = {
      "\xef\xbb\xbf" + crlf,
      spaced,
      upper,
      replaced(kTwill, "Threads=4", "Threads=4 ; ends"),
      replaced(kTwill, "[TIEUP]\n", "  [ TieUp ] ; ties\n; a comment\n"),
      replaced(kTwill, "1=1,2\n", "1=2 , 1,1,0\n"),
      replaced(kTwill, "Version=1.1", "Version=1.2"),
      kTwill + "[PRIVATE LOOM THREADING]\n1=9\nnonsense\n[1] text\n",
      kTwill + "[NOTES]\n1=a line\n",
      replaced(kTwill, "Title=2/2", "free text\n[WARP COLORS] (default = 1)\n1=77\nTitle=2/2"),
      kTwill.substr(0, kTwill.size() - 1),
  };
  for (const std::string& text : cases) {
    const WifDraft draft = read(text);
    EXPECT_EQ(picks_of(draft), kTwillPicks) << text;
    EXPECT_EQ(draft.warp.color[0], (std::array<double, 3>{1, 0, 0.2}));
    EXPECT_TRUE(draft.warnings.empty()) << draft.warnings[0];
  }
  EXPECT_EQ(read(replaced(kTwill, "Title=2/2", "Title=K\xf6per")).title,
            "K\xc3\xb6per twill; not a comment");
}

TEST(WifFileFormat, UnitsAndRanges) {
  std::string text = replaced(kTwill, "Units=Centimeters\nSpacing=0.04\nThickness=0.03",
                              "Units=Decipoints\nSpacing=72");
  text = replaced(text, "Units=Centimeters\nSpacing=0.05", "Units=inches\nSpacing=.1");
  text = replaced(text, "Range=0,255", "Range=0,1000");
  text = replaced(text, "1=255,0,51", "1=1000,0,500");
  const WifDraft draft = read(text);
  EXPECT_NEAR(draft.warp.spacing_mm[0], 2.54, 1e-12);
  EXPECT_NEAR(draft.weft.spacing_mm[0], 2.54, 1e-12);
  EXPECT_EQ(draft.warp.color[0], (std::array<double, 3>{1, 0, 0.5}));
}

TEST(WifFileFormat, ThreadsOfTheirOwnColourAndSize) {
  const WifDraft draft =
      read(kTwill + "[WARP COLORS]\n2=2\n3=\n4=7,0,255,0\n[WARP SPACING]\n3=0.06\n4=\n");
  EXPECT_EQ(draft.warp.color[0], (std::array<double, 3>{1, 0, 0.2}));
  EXPECT_EQ(draft.warp.color[1], (std::array<double, 3>{0, 0.4, 1}));
  EXPECT_EQ(draft.warp.color[2], (std::array<double, 3>{1, 0, 0.2}));
  EXPECT_EQ(draft.warp.color[3], (std::array<double, 3>{0, 1, 0}));
  EXPECT_NEAR(draft.warp.spacing_mm[2], 0.6, 1e-12);
  EXPECT_NEAR(draft.warp.spacing_mm[3], 0.4, 1e-12);
}

TEST(WifFileFormat, ALiftPlanTakesThePlaceOfTreadlesWhereItIsListed) {
  const std::string plan = "[LIFTPLAN]\n1=1\n2=2,3\n3=4\n4=1\n5=1\n6=1\n7=1\n8=1\n";
  const WifDraft both = read(kTwill + plan);
  EXPECT_EQ(picks_of(both), kTwillPicks);
  ASSERT_EQ(both.warnings.size(), 1U);
  EXPECT_NE(both.warnings[0].find("differs"), std::string::npos);
  const WifDraft listed = read(replaced(kTwill, "TIEUP=true", "LIFTPLAN=true") + plan);
  EXPECT_EQ(picks_of(listed), "1000 0110 0001 1000 1000 1000 1000 1000");
  EXPECT_TRUE(listed.tieup.empty());
}

TEST(WifFileFormat, ThreadsThatNothingNamesAreLeftOut) {
  std::string text = replaced(kTwill, "Threads=4", "Threads=1200");
  text = replaced(text, "Threads=8", "Threads=600");
  text = replaced(text, "[TIEUP]", "5=0\n1200=\n[TIEUP]");
  const WifDraft draft = read(text);
  EXPECT_EQ(picks_of(draft), kTwillPicks);
  ASSERT_EQ(draft.warnings.size(), 2U);
  EXPECT_NE(draft.warnings[0].find("4 of 1200 ends"), std::string::npos);
  EXPECT_NE(draft.warnings[1].find("8 of 600 picks"), std::string::npos);
}

TEST(WifFileFormat, AnEndOnNoShaftNeverMoves) {
  const WifDraft draft = read(replaced(kTwill, "2=2\n3=3", "2=\n3=3"));
  EXPECT_EQ(picks_of(draft), "1000 0010 0011 1001 1000 0010 0011 1001");
  EXPECT_EQ(draft.warnings.size(), 1U);
}

TEST(WifFileFormat, OfKeysThatComeTwiceTheFirstHolds) {
  const WifDraft draft = read(replaced(kTwill, "[TIEUP]\n1=1,2\n", "[TIEUP]\n1=1,2\n1=3\n"));
  EXPECT_EQ(picks_of(draft), kTwillPicks);
  ASSERT_EQ(draft.warnings.size(), 1U);
  EXPECT_NE(draft.warnings[0].find("line 37 already"), std::string::npos) << draft.warnings[0];
}

TEST(WifFileFormat, ContradictionsAreRefusedWithTheirLine) {
  const auto expect = [](const std::string& what, const std::string& by, const char* message) {
    const std::string error = error_of(replaced(kTwill, what, by));
    EXPECT_NE(error.find(message), std::string::npos) << error << "\nexpected: " << message;
  };
  expect("Shafts=4", "Shafts=-4", "d.wif:15: expected 'shafts' from 1 to 4096, found '-4'");
  expect("Threads=4", "Threads=2000000000", "d.wif:19: expected 'threads' from 1 to 1000000");
  expect("Threads=4\n", "", "d.wif:18: [WARP]: expected a key 'threads'");
  expect("Threads=4", "Threads=3", "d.wif:35: end 4 of 3");
  expect("4=1,4", "4=1,5", "expected the number of a shaft from 0 to 4, found '5'");
  expect("4=1,4", "5=1,4", "treadle 5 of 4");
  expect("4=1,4", "4=1,-4", "found '-4'");
  expect("4=1,4", "4=1,99999999999999999999", "found '99999999999999999999'");
  expect("8=4\n", "8=4,7\n", "expected the number of a treadle from 0 to 4, found '7'");
  expect("8=4\n", "8=x\n", "found 'x'");
  expect("8=4\n", "0=4\n", "expected the number of a pick from 1");
  expect("[TREADLING]", "[TREADLING", "expected [SECTION] alone on its line");
  expect("[TREADLING]", "[TREDLING]", "d.wif:14: expected the sections [TIEUP] and [TREADLING]");
  expect("[WEFT]", "[WOOF]", "d.wif: expected a section [WEFT]");
  expect("Rising Shed=yes", "Rising Shed=maybe", "found 'maybe'");
  expect("Spacing=0.04", "Spacing=nan", "expected a spacing from 0.001 to 100 mm, found 'nan'");
  expect("Spacing=0.04", "Spacing=-1", "found '-1'");
  expect("Spacing=0.04", "Spacing=1e9", "found '1e9'");
  expect("Units=Centimeters", "Units=Furlongs", "expected Decipoints, Inches or Centimeters");
  expect("[COLOR TABLE]", "[COLOUR TABLE]", "d.wif:20: colour 1: expected a section [COLOR TABLE]");
  expect("Color=2", "Color=3", "colour 3 is not in [COLOR TABLE], which has 2");
  expect("1=255,0,51", "1=256,0,51", "expected a colour's part from 0 to 255, found '256'");
  expect("1=255,0,51", "1=255,0", "expected COLOUR=R,G,B");
  expect("Range=0,255", "Range=255,0", "expected Range=LOW,HIGH");
  EXPECT_NE(error_of(replaced(kTwill, "Version", std::string("Ver\0sion", 8)))
                .find("d.wif:2: expected text, found a byte 0"),
            std::string::npos);
  EXPECT_NE(error_of("").find("d.wif: expected a section [WIF]"), std::string::npos);
  EXPECT_NE(error_of(replaced(kTwill, "4=1,4", "4=1," + std::string(300000, '9'))).size(), 0U);
  EXPECT_LT(error_of(replaced(kTwill, "4=1,4", "4=1," + std::string(300000, '9'))).size(), 200U);
}

TEST(WifFileFormat, OnlyUsedThreadsNeedTheirColours) {
  EXPECT_EQ(read(kTwill + "[WARP COLORS]\n5=99\n").warp.color.size(), 4U);
  const WifDraft zero = read(replaced(kTwill, "Color=1", "Color=0"));
  EXPECT_EQ(zero.warnings.size(), 2U);
  EXPECT_EQ(zero.warp.color.at(0), (std::array<double, 3>{1, 0, 0.2}));
}

TEST(WifFileFormat, AThicknessAboveTheSpacingIsNamed) {
  const WifDraft draft = read(replaced(kTwill, "Thickness=0.03", "Thickness=0.05"));
  ASSERT_EQ(draft.warnings.size(), 1U);
  EXPECT_NE(draft.warnings[0].find("without having measured"), std::string::npos);
}

TEST(WifFileFormat, ALongLineIsReadOnce) {
  std::string shafts = "1";
  for (int k = 0; k < 100000; ++k) shafts += ",1";
  const WifDraft draft = read(replaced(kTwill, "1=1,2\n", "1=" + shafts + ",2\n"));
  EXPECT_EQ(draft.tieup.at(0), (std::vector<int>{1, 2}));
}

TEST(WifFileFormat, DamagedDraftsEndInADraftOrAnError) {
  int refused = 0;
  for_each_mutation(
      kTwill, 1, std::string_view("\0\n=[];,-9\xff", 10), [&](const std::string& damaged) {
        try {
          const WifDraft draft = read(damaged);
          EXPECT_EQ(draft.warp_up.size(), static_cast<std::size_t>(draft.ends() * draft.picks()));
          EXPECT_FALSE(draft.warp_up.empty());
        } catch (const FileError&) {
          ++refused;
        }
      });
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace heddle
