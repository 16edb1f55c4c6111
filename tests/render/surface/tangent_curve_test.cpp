#include "render/surface/tangent_curve.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace heddle {
namespace {

// Share of the curve with an angle up to `limit`, from the control points.
double share_below(const std::vector<double>& offsets, const std::vector<double>& lengths,
                   double limit) {
  double below = 0;
  double total = 0;
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    const double low = std::min(offsets[k], offsets[k + 1]);
    const double high = std::max(offsets[k], offsets[k + 1]);
    const double share = high > low ? std::clamp((limit - low) / (high - low), 0.0, 1.0)
                                    : (limit >= low ? 1.0 : 0.0);
    below += lengths[k] * share;
    total += lengths[k];
  }
  return below / total;
}

double share_below(const std::vector<TangentPiece>& pieces, double limit) {
  double below = 0;
  for (const TangentPiece& piece : pieces) {
    below +=
        piece.share * (piece.end > piece.begin
                           ? std::clamp((limit - piece.begin) / (piece.end - piece.begin), 0.0, 1.0)
                           : (limit >= piece.begin ? 1.0 : 0.0));
  }
  return below;
}

TEST(TangentCurveAgreement, HasTheDistributionOfTheCurve) {
  const std::vector<std::pair<std::vector<double>, std::vector<double>>> curves = {
      {{-.4, .4}, {1}},
      {{-.6, -.6, .6, .6}, {1, 1, 1}},
      {{-32, -32, -18, 0, 0, 18, 32, 32}, {1.33, .66, 2, 2, 2, .66, 1.33}},
      {{-30, -30, 30, 30, -5, -5, 5, 5}, {1.33, 1.33, 1.33, 0, .67, .67, .67}},
      {{-90, -55, 55, 90}, {.5, 0, .5}},
      {{0, 1, 0, 1, .5}, {1, 1, 2, 1}},
      {{0, 0}, {3}},
  };
  for (const auto& [offsets, lengths] : curves) {
    const std::vector<TangentPiece> pieces = tangent_distribution(offsets, lengths);
    for (double limit = -91; limit <= 91; limit += .173) {
      ASSERT_NEAR(share_below(pieces, limit), share_below(offsets, lengths, limit), 1e-13) << limit;
    }
    for (std::size_t k = 0; k + 1 < pieces.size(); ++k) {
      if (pieces[k].begin < pieces[k].end) {
        EXPECT_LE(pieces[k].end, pieces[k + 1].begin);
      }
    }
  }
}

TEST(TangentCurve, JoinsWhatIsOneSlope) {
  EXPECT_EQ(tangent_distribution({-1, 0, 1}, {2, 2}).size(), 1u);
  EXPECT_EQ(tangent_distribution({-1, 1, -1}, {1, 2}).size(), 1u);
  EXPECT_EQ(tangent_distribution({-1, 0, 1}, {1, 2}).size(), 2u);
  EXPECT_EQ(tangent_distribution({2, 2, 5, 5, 2, 2}, {1, 0, 1, 0, 1}).size(), 2u)
      << "two atoms, one of them twice";
}

}  // namespace
}  // namespace heddle
