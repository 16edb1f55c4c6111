#include "render/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/random.h"

namespace heddle {
namespace {

constexpr int kWidth = 40;
constexpr int kHeight = 32;
using Picture = std::vector<Rgb>;

Picture uniform_picture(const Rgb& color) {
  return Picture(kWidth * kHeight, color);
}

Picture noise_picture(std::uint64_t seed) {
  RandomStream random(seed, RandomStage::kTest, 0, 0);
  Picture picture(kWidth * kHeight);
  for (Rgb& pixel : picture) {
    for (int c = 0; c < 3; ++c) pixel[c] = random.uniform();
  }
  return picture;
}

double flip(const Picture& a, const Picture& b) {
  return flip_error(a, b, kWidth, kHeight);
}

TEST(FlipLaw, IdenticalPicturesDoNotDiffer) {
  EXPECT_EQ(flip(noise_picture(1), noise_picture(1)), 0);
  EXPECT_EQ(flip(uniform_picture(Rgb(0, 0, 0)), uniform_picture(Rgb(0, 0, 0))), 0);
}

TEST(FlipLaw, SymmetricAndWithinZeroAndOne) {
  const Picture a = noise_picture(1);
  const Picture b = noise_picture(2);
  const std::vector<float> forth = flip_map(a, b, kWidth, kHeight);
  const std::vector<float> back = flip_map(b, a, kWidth, kHeight);
  for (std::size_t k = 0; k < forth.size(); ++k) {
    ASSERT_EQ(forth[k], back[k]);
    ASSERT_GE(forth[k], 0.0F);
    ASSERT_LE(forth[k], 1.0F);
  }
  EXPECT_GT(flip(a, b), 0.05);
}

TEST(FlipLaw, MirroredAndTurnedPicturesDifferAsMuch) {
  const Picture a = noise_picture(1);
  const Picture b = noise_picture(2);
  const auto mirrored = [](Picture picture) {
    for (int y = 0; y < kHeight; ++y)
      std::reverse(picture.begin() + y * kWidth, picture.begin() + (y + 1) * kWidth);
    return picture;
  };
  const auto transposed = [](const Picture& picture) {
    Picture result;
    for (int x = 0; x < kWidth; ++x) {
      for (int y = 0; y < kHeight; ++y)
        result.push_back(picture[static_cast<std::size_t>(y) * kWidth + x]);
    }
    return result;
  };
  EXPECT_NEAR(flip(mirrored(a), mirrored(b)), flip(a, b), 1e-6);
  EXPECT_NEAR(flip_error(transposed(a), transposed(b), kHeight, kWidth), flip(a, b), 1e-6);
}

// Green against blue is by definition the largest difference of colours. Black against white is
// HyAB = 100 (L* alone); with green at (L*, a*, b*) = (87.735, -86.18, 83.18) and blue at
// (32.30, 79.19, -107.86), a* and b* times L* / 100, the largest HyAB is 55.43 + hypot(101.19,
// 107.82) = 203.3, and 0.95 + 0.05 (100^0.7 - 0.4 m) / (0.6 m), m = 203.3^0.7, is 0.9675.
TEST(FlipLaw, KnownExtremes) {
  EXPECT_NEAR(flip(uniform_picture(Rgb(0, 1, 0)), uniform_picture(Rgb(0, 0, 1))), 1, 1e-6);
  EXPECT_NEAR(flip(uniform_picture(Rgb(0, 0, 0)), uniform_picture(Rgb(1, 1, 1))), 0.9675, 5e-4);
}

TEST(FlipLaw, LightBeyondTheScreenIsClipped) {
  EXPECT_EQ(flip(uniform_picture(Rgb(1, 1, 1)), uniform_picture(Rgb(7, 7, 7))), 0);
  EXPECT_EQ(flip(uniform_picture(Rgb(0, 0, 0)), uniform_picture(Rgb(-1, -1, -1))), 0);
}

// Small uniform differences count in proportion to HyAB^0.7 = |dL*|^0.7: L* = 116 cbrt(Y) - 16.
TEST(FlipLaw, GreysFollowTheirLightness) {
  const auto lightness = [](double y) { return 116 * std::cbrt(y) - 16; };
  const double small =
      flip(uniform_picture(Rgb(0.2F, 0.2F, 0.2F)), uniform_picture(Rgb(0.21F, 0.21F, 0.21F)));
  const double large =
      flip(uniform_picture(Rgb(0.2F, 0.2F, 0.2F)), uniform_picture(Rgb(0.25F, 0.25F, 0.25F)));
  const double expected =
      std::pow((lightness(0.25) - lightness(0.2)) / (lightness(0.21) - lightness(0.2)), 0.7);
  EXPECT_NEAR(large / small, expected, 1e-3 * expected);
}

// A white pixel on black, by the paper's formulas. The luminance at a distance of (x, y) pixels is
// the achromatic Gaussian there, exp(-pi^2 (x^2 + y^2) / (0.0047 p^2)) over its sum, p = 67.02
// pixels per degree: its L*, to the power of 0.7, is the colour difference, of which the remap
// makes 0.95 / (0.4 m) times as much, m = 203.3^0.7. The difference of points is, along each axis,
// the second derivative of a Gaussian of deviation s = 0.041 p there, whose parts above and below 0
// are divided by their sums; of edges likewise the first; the larger counts, and the square root of
// it over sqrt(2).
TEST(FlipLaw, AWhitePixelAsThePapersFormulasHaveIt) {
  Picture point = uniform_picture(Rgb(0, 0, 0));
  point[16 * kWidth + 20] = Rgb(1, 1, 1);
  const std::vector<float> map = flip_map(uniform_picture(Rgb(0, 0, 0)), point, kWidth, kHeight);
  const double p = 0.7 * 3840 / 0.7 * kPi / 180;
  const double s = 0.041 * p;
  const auto achromatic = [p](int x, int y) {
    return std::exp(-kPi * kPi * (x * x + y * y) / (0.0047 * p * p));
  };
  const auto gaussian = [s](int x, int y) { return std::exp(-(x * x + y * y) / (2 * s * s)); };
  const auto edge = [&](int x, int y) { return x * gaussian(x, y); };
  const auto bump = [&](int x, int y) { return (1 - x * x / (s * s)) * gaussian(x, y); };
  double total = 0;
  double of_edge = 0;
  double above = 0;
  double below = 0;
  for (int y = -10; y <= 10; ++y) {
    for (int x = -10; x <= 10; ++x) {
      total += achromatic(x, y);
      if (std::max(std::abs(x), std::abs(y)) > 9) continue;  // the detectors' radius, 3 s
      of_edge += std::max(0.0, edge(x, y));
      above += std::max(0.0, bump(x, y));
      below -= std::min(0.0, bump(x, y));
    }
  }
  const auto share = [](double value, double over, double under) {
    return value / (value > 0 ? over : under);
  };
  for (int y = -6; y <= 6; ++y) {
    for (int x = -6; x <= 6; ++x) {
      const double luminance = achromatic(x, y) / total;
      const double root = luminance > std::pow(6.0 / 29, 3) ? std::cbrt(luminance)
                                                            : luminance * 841 / 108 + 4.0 / 29;
      const double color =
          std::pow(std::max(0.0, 116 * root - 16), 0.7) * 0.95 / (0.4 * std::pow(203.3, 0.7));
      ASSERT_LT(color, 0.95);
      const double edges = std::hypot(edge(x, y), edge(y, x)) / of_edge;
      const double points =
          std::hypot(share(bump(x, y), above, below), share(bump(y, x), above, below));
      const double features = std::sqrt(std::max(edges, points) / std::sqrt(2));
      EXPECT_NEAR(map[static_cast<std::size_t>((16 + y) * kWidth + 20 + x)],
                  std::pow(color, 1 - features), 2e-4)
          << x << ' ' << y;
    }
  }
}

// What the authors' own program gives (github.com/NVlabs/flip, python/flip_api.py of 2021, at
// double precision): one pixel of a colour on a ground of another, and an edge between two colours;
// some pixels of each. Its matrices are rounded otherwise: differences below 1e-4.
TEST(FlipAgreement, PixelsOfTheAuthorsProgram) {
  struct Pixel {
    int x, y;
    double value;
  };
  const auto compare = [](const char* name, const Picture& a, const Picture& b,
                          const std::vector<Pixel>& pixels) {
    const std::vector<float> map = flip_map(a, b, kWidth, kHeight);
    for (const Pixel& pixel : pixels) {
      EXPECT_NEAR(map[static_cast<std::size_t>(pixel.y * kWidth + pixel.x)], pixel.value, 2e-4)
          << name << ' ' << pixel.x << ' ' << pixel.y;
    }
  };
  const auto with_pixel = [](const Rgb& ground, const Rgb& color) {
    Picture picture = uniform_picture(ground);
    picture[16 * kWidth + 20] = color;
    return picture;
  };
  const Rgb black(0, 0, 0);
  compare("white on black", uniform_picture(black), with_pixel(black, Rgb(1, 1, 1)),
          {{20, 16, 0.86491}, {21, 16, 0.76349}, {20, 18, 0.48056}, {22, 19, 0.04305}});
  const Rgb grey(0.5F, 0.5F, 0.5F);
  compare("red on grey", uniform_picture(grey), with_pixel(grey, Rgb(1, 0.2F, 0.1F)),
          {{20, 16, 0.21971},
           {21, 16, 0.16553},
           {20, 18, 0.07172},
           {25, 16, 0.01193},
           {20, 9, 0.00424}});
  compare("blue on black", uniform_picture(black), with_pixel(black, Rgb(0.1F, 0.2F, 1)),
          {{20, 16, 0.58817},
           {21, 16, 0.48783},
           {20, 18, 0.22033},
           {25, 16, 0.03050},
           {20, 9, 0.01070}});
  const Rgb dim(0.2F, 0.2F, 0.2F);
  compare("dim on grey", uniform_picture(dim), with_pixel(dim, Rgb(0.3F, 0.3F, 0.3F)),
          {{20, 16, 0.09607}, {21, 16, 0.07033}, {20, 18, 0.02709}});
  const Picture dark = uniform_picture(Rgb(0.1F, 0.1F, 0.1F));
  Picture edge = dark;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 20; x < kWidth; ++x)
      edge[static_cast<std::size_t>(y * kWidth + x)] = Rgb(0.3F, 0.3F, 0.2F);
  }
  compare("edge", dark, edge,
          {{19, 16, 0.51443},
           {20, 16, 0.65630},
           {17, 5, 0.19432},
           {23, 31, 0.71223},
           {30, 16, 0.64842},
           {10, 16, 0.00119}});
}

// One white pixel on black is a point where the other picture has none: worse than the same light
// spread out evenly, and worst next to itself.
TEST(FlipLaw, PointsCountWhereTheyAre) {
  const Picture black = uniform_picture(Rgb(0, 0, 0));
  Picture point = black;
  const std::size_t place = 16 * kWidth + 20;
  point[place] = Rgb(1, 1, 1);
  const std::vector<float> map = flip_map(black, point, kWidth, kHeight);
  EXPECT_EQ(std::max_element(map.begin(), map.end()) - map.begin(),
            static_cast<std::ptrdiff_t>(place));
  EXPECT_EQ(map[0], 0.0F);
  const float spread = 1.0F / (kWidth * kHeight);
  EXPECT_GT(map[place], flip(black, uniform_picture(Rgb(spread, spread, spread))));
}

}  // namespace
}  // namespace heddle
