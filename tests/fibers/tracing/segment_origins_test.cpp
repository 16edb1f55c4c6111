#include "fibers/tracing/segment_origins.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "fibers/cloth/synthesize.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

// A sparse layer: each fiber sees all of the sky over it, and its most exposed side is its top.
TEST(SegmentOriginsLaw, AFreeFiberIsExposedAtItsTop) {
  const TileScene scene(test::straight_fibers(1, 2, {{0.5F, 0}}, 0.02F, 4, test::white_fiber()));
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  for (std::uint32_t s = 0; s < 4; ++s) {
    EXPECT_NEAR(origins.openness[s], 1, 0.02);
    const Vec3 offset = origins.position[s] - scene.exemplar().segment_midpoint(s);
    EXPECT_NEAR(offset.norm(), kExposedDepth * 0.02F, 1e-5F);
    // 288 rays place the direction to about 0.1 rad.
    EXPECT_GT(offset.z(), 0.02F * kExposedDepth * 0.9F);
  }
}

// Under a wall of fibers on its left, a fiber is exposed to its right.
TEST(SegmentOriginsLaw, TheExposedSideFacesTheGap) {
  const float r = 0.02F;
  std::vector<Vec2> places = {{0.5F, 0}};
  for (int i = 0; i < 12; ++i) places.emplace_back(0.44F, -0.1F + 0.039F * static_cast<float>(i));
  const TileScene scene(test::straight_fibers(1, 4, places, r, 4, test::white_fiber()));
  const SegmentOrigins origins = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  const Vec3 offset = origins.position[0] - scene.exemplar().segment_midpoint(0);
  EXPECT_GT(offset.y(), 0.3F * r);
  EXPECT_LT(origins.openness[0], 0.8F);
}

// A roof over one end of a segment takes as much of its sky as a roof over the other end: points of
// all its length count alike.
TEST(SegmentOriginsStatistical, BothEndsOfASegmentCount) {
  double openness[2] = {0, 0};
  constexpr int kSeeds = 250;
  for (const int end : {0, 1}) {
    Exemplar exemplar = test::straight_fibers(4, 4, {{2.0F, 0}}, 0.02F, 4, test::white_fiber());
    // A thick fiber across, just over the first or the last tenth of segment 1.
    for (int k = 0; k <= 4; ++k)
      exemplar.points.emplace_back(end == 0 ? 1.1F : 1.9F, static_cast<float>(k), 0.2F);
    exemplar.first_point.push_back(static_cast<std::uint32_t>(exemplar.points.size()));
    exemplar.radius_mm.push_back(0.15F);
    exemplar.material.push_back(0);
    index_segments(exemplar);
    const TileScene scene(exemplar);
    for (int seed = 1; seed <= kSeeds; ++seed) {
      openness[end] +=
          static_cast<double>(find_segment_origins(scene, false, OriginChoice::kExposed,
                                                   static_cast<std::uint64_t>(seed))
                                  .openness[1]) /
          kSeeds;
    }
  }
  // 250 x 144 rays before the surface, 70 % of which see the sky: each is known to 0.003.
  std::printf("openness under a roof at either end: %.4f, %.4f\n", openness[0], openness[1]);
  EXPECT_LT(openness[0], 0.95);
  EXPECT_NEAR(openness[0], openness[1], 0.02);
}

TEST(SegmentOriginsLaw, PrintedChoiceIsTheMidpoint) {
  const TileScene scene(synthesize(test::small_fabric()));
  const SegmentOrigins printed = find_segment_origins(scene, false, OriginChoice::kMidpoint, 1);
  const SegmentOrigins exposed = find_segment_origins(scene, false, OriginChoice::kExposed, 1);
  EXPECT_EQ(printed.openness, exposed.openness);
  int moved = 0;
  for (std::uint32_t s = 0; s < scene.exemplar().segment_count(); ++s) {
    EXPECT_EQ(printed.position[s], scene.exemplar().segment_midpoint(s));
    const float distance = (exposed.position[s] - printed.position[s]).norm();
    if (distance > 0) {
      EXPECT_NEAR(distance,
                  kExposedDepth * scene.exemplar().radius_mm[scene.exemplar().segment_fiber[s]],
                  1e-5F);
      ++moved;
    } else {
      EXPECT_EQ(exposed.openness[s], 0);  // nothing to choose by
    }
  }
  EXPECT_GT(moved, 100);
}

}  // namespace
}  // namespace heddle
