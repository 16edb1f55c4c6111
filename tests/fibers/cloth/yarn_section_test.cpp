#include "fibers/cloth/yarn_section.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/vector.h"

namespace heddle {
namespace {

// The share within a radius is the integral of p(R) R, here by a fine sum over the square of the
// radius.
TEST(YarnSectionLaw, RadiiAreDistributedAsTheDensitySays) {
  for (const RadialDensity density :
       {RadialDensity{0, 0}, {0, 0.2}, {0.34, 0.42}, {0.01, 3}, {0.5, 1}}) {
    const RadialPlaces places(density);
    constexpr int kSteps = 100000;
    double whole = 0;
    for (int k = 0; k < kSteps; ++k) whole += density.at(std::sqrt((k + 0.5) / kSteps));
    double within = 0;
    for (int k = 0; k < kSteps; ++k) {
      if (k % 9999 == 0) {
        const double radius = std::sqrt(static_cast<double>(k) / kSteps);
        EXPECT_NEAR(places.share(radius), within / whole, 1e-4) << density.beta << " " << radius;
        EXPECT_NEAR(places.radius(places.share(radius)), radius, 1e-9) << density.beta;
      }
      within += density.at(std::sqrt((k + 0.5) / kSteps));
    }
    EXPECT_NEAR(places.radius(1), 1, 1e-12);
  }
}

TEST(YarnSectionLaw, DensityFallsFromTheAxisToTheEdge) {
  const RadialDensity density{0.2, 0.5};
  EXPECT_NEAR(density.at(0), 0.8, 1e-12);
  EXPECT_NEAR(density.at(1), 0.2, 1e-12);
  EXPECT_GT(density.at(0.5), density.at(0.6));
}

TEST(YarnSectionLaw, ReachIsThatOfTheFarthestPoint) {
  for (const PlyShape shape :
       {PlyShape{0, 1, 1}, {0.5, 0.5, std::sqrt(0.5)}, {0.4, 0.2, 0.9}, {0.5, 0.3, 0.35}}) {
    double farthest = 0;
    for (int k = 0; k < 10000; ++k) {
      const double t = kPi * k / 10000;
      farthest = std::max(farthest, std::hypot(shape.centre + shape.radial * std::cos(t),
                                               shape.tangential * std::sin(t)));
    }
    EXPECT_NEAR(reach_of(shape), farthest, 1e-6) << shape.centre;
  }
}

TEST(YarnSectionLaw, PliesTouchEachOtherAndTheEdge) {
  for (int plies = 1; plies <= 12; ++plies) {
    const PlyShape shape = touching_plies(plies);
    EXPECT_NEAR(reach_of(shape), 1, 1e-12) << plies;
    if (plies <= 2) continue;
    EXPECT_NEAR(shape.centre * std::sin(kPi / plies), shape.radial, 1e-12) << plies;
  }
}

}  // namespace
}  // namespace heddle
