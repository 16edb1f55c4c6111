#include "fibers/cloth/interpenetration.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/random.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

TEST(SegmentDistanceAgreement, IsTheSmallestOfAGrid) {
  RandomStream random(5, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 200; ++k) {
    Vec3 ends[4];
    for (Vec3& end : ends) end = Vec3(random.uniform(), random.uniform(), random.uniform());
    constexpr int kSteps = 200;
    float smallest = 10;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        const Vec3 p = ends[0] + static_cast<float>(i) / kSteps * (ends[1] - ends[0]);
        const Vec3 q = ends[2] + static_cast<float>(j) / kSteps * (ends[3] - ends[2]);
        smallest = std::min(smallest, (p - q).norm());
      }
    }
    const float distance = segment_distance(ends[0], ends[1], ends[2], ends[3]);
    EXPECT_LE(distance, smallest + 1e-6F);
    EXPECT_GT(distance, smallest - 0.01F);
  }
}

// Two fibers of radius 0.02 whose axes cross 0.03 apart overlap by 0.01, half a radius.
TEST(Interpenetration, OfTwoCrossingFibers) {
  Exemplar exemplar = test::straight_fibers(1, 1, {Vec2(0.5F, 0)}, 0.02F, 10, test::white_fiber());
  for (int k = 0; k <= 10; ++k)
    exemplar.points.emplace_back(0.55F, static_cast<float>(k) / 10, 0.03F);
  exemplar.first_point.push_back(static_cast<std::uint32_t>(exemplar.points.size()));
  exemplar.radius_mm.push_back(0.02F);
  exemplar.material.push_back(0);
  index_segments(exemplar);
  EXPECT_EQ(measure_interpenetration(exemplar).share, 0) << "one yarn";
  exemplar.yarn = {0, 1};
  const Interpenetration found = measure_interpenetration(exemplar);
  // Of each fiber the piece at the crossing; the pieces beside it touch it with their caps.
  EXPECT_GE(found.share, 2.0 / 20);
  EXPECT_LE(found.share, 4.0 / 20);
  EXPECT_NEAR(found.deepest, 0.5, 1e-4);
}

// Yarns that are laid clear of each other hold fibers that are clear of each other, but for the
// chords that replace their curves.
TEST(InterpenetrationLaw, WovenYarnsKeepClear) {
  for (const char* notation : {"plain", "twill 2/2", "satin 5/2"}) {
    const Interpenetration found =
        measure_interpenetration(synthesize(test::small_fabric(notation)));
    EXPECT_LE(found.share, 0.02) << notation;
    EXPECT_LE(found.deepest, 0.2) << notation;
  }
}

}  // namespace
}  // namespace heddle
