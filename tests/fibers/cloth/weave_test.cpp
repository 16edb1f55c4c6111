#include "fibers/cloth/weave.h"

#include <gtest/gtest.h>

#include <stdexcept>

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

TEST(Weave, RefusesWhatIsNoWeave) {
  for (const char* notation :
       {"", "Plain", "twill", "twill 2", "twill 0/2", "twill 2/-1", "twill 2/2 ", "satin 4/2",
        "satin 6/2", "satin 6/3", "satin 8/1", "satin 8/7", "satin 5/2x", "twill 99999999999/1"}) {
    EXPECT_THROW(parse_weave(notation, WeaveFace::kWarp), std::invalid_argument) << notation;
  }
}

}  // namespace
}  // namespace heddle
