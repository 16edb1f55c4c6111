#include "fibers/cloth/weave.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace heddle {
namespace {

// Every end and every pick of a weave interlaces, and the ups per pick are what the notation says.
void expect_interlaces(const Weave& weave, int ups) {
  for (int i = 0; i < weave.ends; ++i) {
    int in_pick = 0;
    int in_end = 0;
    for (int k = 0; k < weave.ends; ++k) {
      in_pick += weave.is_warp_up(k, i) ? 1 : 0;
      in_end += weave.is_warp_up(i, k) ? 1 : 0;
    }
    EXPECT_EQ(in_pick, ups) << weave.notation << " pick " << i;
    EXPECT_EQ(in_end, ups) << weave.notation << " end " << i;
  }
}

TEST(WeaveLaw, EachEndAndPickHasTheStatedNumberOfUps) {
  expect_interlaces(parse_weave("plain", WeaveFace::kWarp), 1);
  expect_interlaces(parse_weave("twill 2/2", WeaveFace::kWarp), 2);
  expect_interlaces(parse_weave("twill 3/1", WeaveFace::kWarp), 3);
  expect_interlaces(parse_weave("satin 5/2", WeaveFace::kWarp), 4);
  expect_interlaces(parse_weave("satin 8/3", WeaveFace::kWeft), 1);
}

TEST(WeaveLaw, TwillStepsByOneEndPerPick) {
  const Weave twill = parse_weave("twill 2/2", WeaveFace::kWarp);
  for (int pick = 0; pick < 4; ++pick) {
    for (int end = 0; end < 4; ++end)
      EXPECT_EQ(twill.is_warp_up(end, pick), twill.is_warp_up(end + 1, pick + 1));
  }
}

// The mark of a satin: no two interlacing points touch, not even at a corner.
TEST(WeaveLaw, SatinPointsNeverTouch) {
  for (const char* notation : {"satin 5/2", "satin 5/3", "satin 7/2", "satin 8/3", "satin 8/5"}) {
    const Weave satin = parse_weave(notation, WeaveFace::kWarp);
    for (int pick = 0; pick < satin.picks; ++pick) {
      for (int end = 0; end < satin.ends; ++end) {
        if (satin.is_warp_up(end, pick)) continue;
        for (int dp = -1; dp <= 1; ++dp) {
          for (int de = -1; de <= 1; ++de) {
            if (dp == 0 && de == 0) continue;
            EXPECT_TRUE(satin.is_warp_up(end + de, pick + dp))
                << notation << " " << end << "," << pick;
          }
        }
      }
    }
  }
}

TEST(WeaveLaw, WeftFaceIsTheComplementOfAWarpFace) {
  EXPECT_EQ(parse_weave("satin 5/2", WeaveFace::kWeft).face, WeaveFace::kWeft);
  EXPECT_EQ(parse_weave("twill 1/3", WeaveFace::kWarp).face, WeaveFace::kWeft);
  EXPECT_EQ(parse_weave("twill 3/1", WeaveFace::kWarp).face, WeaveFace::kWarp);
}

std::string rows_of(const Weave& weave) {
  std::string rows;
  for (int pick = weave.picks; pick-- > 0;) {
    for (int end = 0; end < weave.ends; ++end) rows += weave.is_warp_up(end, pick) ? '1' : '0';
    if (pick > 0) rows += ' ';
  }
  return rows;
}

Weave weave_of(const char* notation, const WeaveChoices& choices = {}) {
  return parse_weave(notation, WeaveFace::kWarp, choices);
}

TEST(Weave, RibsAndBasketsArePlainWeaveDrawnOut) {
  EXPECT_EQ(rows_of(weave_of("plain")), "01 10");
  EXPECT_EQ(rows_of(weave_of("warp rib 2/2")), "01 01 10 10");
  EXPECT_EQ(rows_of(weave_of("warp rib 1/2")), "01 01 10");
  EXPECT_EQ(rows_of(weave_of("weft rib 2/2")), "1100 0011");
  EXPECT_EQ(rows_of(weave_of("weft rib 3/1")), "1110 0001");
  EXPECT_EQ(rows_of(weave_of("basket 2/2")), "0011 0011 1100 1100");
  EXPECT_EQ(rows_of(weave_of("basket 2/1")), "001 110 110");
}

TEST(Weave, TwillsTakeAStepADirectionAndSeveralRuns) {
  EXPECT_EQ(rows_of(weave_of("twill 2/2")), "1001 0011 0110 1100");
  EXPECT_EQ(rows_of(weave_of("twill 2/2", {.direction = TwillDirection::kS})),
            "1001 1100 0110 0011");
  EXPECT_EQ(rows_of(weave_of("twill 3/1/1/2", {.step = 3})),
            "0100111 0111010 1010011 0011101 1101001 1001110 1110100");
  // A step that shares a divisor with the ends comes back after fewer picks.
  EXPECT_EQ(rows_of(weave_of("twill 2/2", {.step = 2})), "0011 1100");
}

TEST(WeaveLaw, STwillIsTheMirrorImageOfZ) {
  for (const char* notation : {"twill 3/1", "twill 1/2/2/3", "herringbone 2/2", "pointed 3/1"}) {
    const Weave z = weave_of(notation, {.width = 6});
    const Weave s = weave_of(notation, {.direction = TwillDirection::kS, .width = 6});
    for (int pick = 0; pick < z.picks; ++pick) {
      for (int end = 0; end < z.ends; ++end)
        EXPECT_EQ(z.is_warp_up(end, pick), s.is_warp_up(z.ends - 1 - end, pick)) << notation;
    }
  }
}

// The cut of a herringbone of a balanced twill: neighbours on both sides of it never agree.
TEST(WeaveLaw, HerringboneIsCutWhereWarpMeetsWeft) {
  for (const int width : {4, 6, 8, 9}) {
    const Weave weave = weave_of("herringbone 2/2", {.width = width});
    ASSERT_EQ(weave.ends, 2 * width);
    for (int pick = 0; pick < weave.picks; ++pick) {
      EXPECT_NE(weave.is_warp_up(width - 1, pick), weave.is_warp_up(width, pick));
      EXPECT_NE(weave.is_warp_up(-1, pick), weave.is_warp_up(0, pick));
      EXPECT_EQ(weave.is_warp_up(0, pick), weave.is_warp_up(1, pick + 1));
      EXPECT_EQ(weave.is_warp_up(width, pick + 1), weave.is_warp_up(width + 1, pick));
    }
  }
}

TEST(WeaveLaw, PointedTwillIsItsOwnMirrorImageAboutEachPoint) {
  for (const int width : {2, 3, 8}) {
    const Weave weave = weave_of("pointed 2/2", {.width = width});
    ASSERT_EQ(weave.ends, 2 * width);
    for (int pick = 0; pick < weave.picks; ++pick) {
      for (int k = 0; k < weave.ends; ++k) {
        EXPECT_EQ(weave.is_warp_up(k, pick), weave.is_warp_up(-k, pick));
        EXPECT_EQ(weave.is_warp_up(width + k, pick), weave.is_warp_up(width - k, pick));
      }
    }
  }
}

TEST(WeaveLaw, SatinsByShares) {
  expect_interlaces(weave_of("4/1 satin"), 4);
  expect_interlaces(weave_of("2/3 satin"), 2);
  expect_interlaces(weave_of("1/4 satin"), 1);
  expect_interlaces(weave_of("5/3 satin", {.step = 5}), 5);
  EXPECT_EQ(weave_of("4/1 satin").warp_up, weave_of("satin 5/2").warp_up);
  EXPECT_EQ(weave_of("7/1 satin").warp_up, weave_of("satin 8/3").warp_up);
  EXPECT_EQ(weave_of("4/1 satin", {.step = 3}).warp_up, weave_of("satin 5/3").warp_up);
  EXPECT_EQ(weave_of("2/3 satin").face, WeaveFace::kWeft);
}

TEST(Weave, MatrixIsReadFromTheTopRowDown) {
  EXPECT_EQ(rows_of(parse_weave_matrix("110\n011  000")), "110 011 000");
  EXPECT_EQ(rows_of(parse_weave_matrix(std::string(4096, '1'))), std::string(4096, '1'));
  for (const std::string& text :
       {std::string(), std::string(" \n"), std::string("10 0"), std::string("12 21"),
        std::string(4097, '0'), std::string("1\0", 2)}) {
    EXPECT_THROW(parse_weave_matrix(text), std::invalid_argument) << text.substr(0, 20);
  }
}

TEST(Weave, RefusesWhatIsNoWeave) {
  for (const char* notation : {"",
                               "Plain",
                               "twill",
                               "twill 2",
                               "twill 0/2",
                               "twill 2/-1",
                               "twill 2/2 ",
                               "satin 4/2",
                               "satin 6/2",
                               "satin 6/3",
                               "satin 8/1",
                               "satin 8/7",
                               "satin 5/2x",
                               "twill 99999999999/1",
                               "twill 4096/1",
                               "twill 2/1/1",
                               "rib 2/2",
                               "warp rib 2",
                               "basket 2/2/2",
                               "herringbone 2/2",
                               "pointed 2/2",
                               "3/1 satin",
                               "3/3 satin",
                               "satin",
                               " satin",
                               "1/ satin",
                               "4/1  satin"}) {
    EXPECT_THROW(parse_weave(notation, WeaveFace::kWarp), std::invalid_argument) << notation;
  }
  EXPECT_THROW(weave_of("twill 2/2", {.step = 4}), std::invalid_argument);
  EXPECT_THROW(weave_of("4/1 satin", {.step = 4}), std::invalid_argument);
}

}  // namespace
}  // namespace heddle
