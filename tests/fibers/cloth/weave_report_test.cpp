#include "fibers/cloth/weave_report.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

namespace heddle {
namespace {

TEST(WeaveReport, FloatsAndInterlacingsOfKnownWeaves) {
  const WeaveReport plain = report_weave(parse_weave("plain"));
  EXPECT_EQ(plain.warp_face.longest, 1);
  EXPECT_EQ(plain.weft_back.longest, 1);
  EXPECT_DOUBLE_EQ(plain.warp_interlacing, 1);
  EXPECT_DOUBLE_EQ(plain.warp_share, 0.5);

  const WeaveReport twill = report_weave(parse_weave("twill 3/1"));
  EXPECT_EQ(twill.warp_face.longest, 3);
  EXPECT_EQ(twill.warp_back.longest, 1);
  EXPECT_EQ(twill.weft_face.longest, 1);
  EXPECT_EQ(twill.weft_back.longest, 3);
  EXPECT_DOUBLE_EQ(twill.weft_interlacing, 0.5);
  EXPECT_DOUBLE_EQ(twill.warp_share, 0.75);

  const WeaveReport satin = report_weave(parse_weave("satin 8/3", WeaveFace::kWeft));
  EXPECT_EQ(satin.weft_face.longest, 7);
  EXPECT_DOUBLE_EQ(satin.weft_face.mean, 7);
  EXPECT_DOUBLE_EQ(satin.warp_interlacing, 0.25);

  // Runs of 2 and 1 up, of 1 and 2 down.
  const WeaveReport fancy = report_weave(parse_weave("twill 2/1/1/2"));
  EXPECT_EQ(fancy.warp_face.longest, 2);
  EXPECT_DOUBLE_EQ(fancy.warp_face.mean, 1.5);
}

TEST(WeaveReport, FloatsRunOnIntoTheNextRepeat) {
  // Each end is up in the first and the last pick only.
  const WeaveReport report = report_weave(parse_weave_matrix("11 00 00 11"));
  EXPECT_EQ(report.warp_face.longest, 2);
  EXPECT_EQ(report.warp_back.longest, 2);
  EXPECT_EQ(report.weft_face.endless, 2);
  EXPECT_EQ(report.weft_back.endless, 2);
  EXPECT_EQ(report.weft_face.longest, 0);
}

TEST(WeaveReport, FindsTheSmallestRepeatAndNeighboursThatAreAlike) {
  const WeaveReport twice = report_weave(parse_weave_matrix("0101 1010 0101 1010"));
  EXPECT_EQ(twice.repeat_ends, 2);
  EXPECT_EQ(twice.repeat_picks, 2);
  EXPECT_EQ(twice.alike_ends, 0);
  const WeaveReport basket = report_weave(parse_weave("basket 2/2"));
  EXPECT_EQ(basket.repeat_ends, 4);
  EXPECT_EQ(basket.alike_ends, 2);
  EXPECT_EQ(basket.alike_picks, 2);
  EXPECT_EQ(report_weave(parse_weave("warp rib 2/2")).alike_picks, 2);
  EXPECT_EQ(report_weave(parse_weave("warp rib 2/2")).alike_ends, 0);
}

TEST(WeaveReport, UsualWeavesHoldTogether) {
  for (const char* notation : {"plain", "twill 2/2", "twill 3/1", "warp rib 3/2", "weft rib 2/2",
                               "basket 3/2", "satin 8/3", "4/1 satin"}) {
    EXPECT_EQ(find_layers(parse_weave(notation)).size(), 1U) << notation;
  }
}

TEST(WeaveReport, DoubleClothFallsIntoItsTwoCloths) {
  // Even ends and picks weave plain cloth above the plain cloth of the odd ones.
  std::string rows;
  for (int row = 0; row < 4; ++row) {
    const int pick = 3 - row;
    for (int end = 0; end < 4; ++end) {
      const bool top_end = end % 2 == 0;
      const bool top_pick = pick % 2 == 0;
      const bool crossing = (end / 2 + pick / 2) % 2 == 0;
      rows += (top_end == top_pick ? crossing : top_end) ? '1' : '0';
    }
    rows += ' ';
  }
  const std::vector<ClothLayer> layers = find_layers(parse_weave_matrix(rows));
  ASSERT_EQ(layers.size(), 2U);
  EXPECT_EQ(layers[0].ends, (std::vector<int>{0, 2}));
  EXPECT_EQ(layers[0].picks, (std::vector<int>{0, 2}));
  EXPECT_EQ(layers[1].ends, (std::vector<int>{1, 3}));
  EXPECT_EQ(layers[1].picks, (std::vector<int>{1, 3}));
}

// The threads in layers, by reachability in the graph of who lies over whom.
std::set<std::set<int>> layers_by_reachability(const Weave& weave) {
  const int n = weave.ends + weave.picks;
  std::vector<std::vector<bool>> reach(n, std::vector<bool>(n, false));
  for (int end = 0; end < weave.ends; ++end) {
    for (int pick = 0; pick < weave.picks; ++pick) {
      const bool up = weave.is_warp_up(end, pick);
      reach[up ? end : weave.ends + pick][up ? weave.ends + pick : end] = true;
    }
  }
  for (int k = 0; k < n; ++k) {
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        if (reach[i][k] && reach[k][j]) reach[i][j] = true;
      }
    }
  }
  std::set<std::set<int>> layers;
  for (int i = 0; i < n; ++i) {
    std::set<int> layer = {i};
    for (int j = 0; j < n; ++j) {
      if (reach[i][j] && reach[j][i]) layer.insert(j);
    }
    layers.insert(layer);
  }
  return layers;
}

TEST(WeaveReportAgreement, LayersAreTheStronglyConnectedSetsOfThreads) {
  std::mt19937 random(5);
  int apart = 0;
  for (int n = 0; n < 3000; ++n) {
    Weave weave;
    weave.ends = 1 + static_cast<int>(random() % 6);
    weave.picks = 1 + static_cast<int>(random() % 6);
    for (int k = 0; k < weave.ends * weave.picks; ++k) weave.warp_up.push_back(random() % 2);
    std::set<std::set<int>> found;
    for (const ClothLayer& layer : find_layers(weave)) {
      std::set<int> threads(layer.ends.begin(), layer.ends.end());
      for (const int pick : layer.picks) threads.insert(weave.ends + pick);
      found.insert(threads);
    }
    EXPECT_EQ(found, layers_by_reachability(weave));
    apart += found.size() > 1 ? 1 : 0;
  }
  EXPECT_GT(apart, 500);
  EXPECT_LT(apart, 2500);
}

TEST(WeaveReport, CoverAndDensityOfThreads) {
  const DraftThreads threads = {{}, {0.4, 0.6}, {0.3, 0.4}};
  EXPECT_DOUBLE_EQ(*cover_of(threads), 0.7);
  EXPECT_DOUBLE_EQ(*threads_per_cm(threads), 20);
  EXPECT_FALSE(cover_of({}));
  EXPECT_FALSE(threads_per_cm({}));
}

}  // namespace
}  // namespace heddle
