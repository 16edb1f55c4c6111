#include "fibers/cloth/bundle_tangents.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

constexpr float kRadius = 0.005F;

/// Straight fibers on a grid of 8 x 5 at 0.012 mm, all along x.
Exemplar straight_bundle() {
  std::vector<Vec2> places;
  for (int y = 0; y < 8; ++y) {
    for (int z = 0; z < 5; ++z) {
      places.emplace_back(0.012F * (static_cast<float>(y) + 0.5F), 0.012F * static_cast<float>(z));
    }
  }
  return test::straight_fibers(0.4F, 0.096F, places, kRadius, 20, test::white_fiber());
}

/// The same with points that stray from their lines.
Exemplar wandering_bundle(std::uint64_t stream) {
  Exemplar exemplar = straight_bundle();
  RandomStream random(3, RandomStage::kTest, stream, 0);
  for (Vec3& point : exemplar.points) point.tail<2>() += 0.002F * sample_disk(random);
  index_segments(exemplar);
  return exemplar;
}

TEST(BundleTangentsLaw, ParallelFibersAreTheirOwnBundle) {
  const Exemplar exemplar = straight_bundle();
  const std::vector<Vec3> mean = bundle_tangents(exemplar);
  for (const Vec3& tangent : mean) EXPECT_LT((tangent - Vec3::UnitX()).norm(), 1e-6F);
  EXPECT_LT(bundle_spread(exemplar, mean), 1e-6);
}

TEST(BundleTangentsLaw, WanderAveragesOut) {
  const Exemplar exemplar = wandering_bundle(1);
  const std::vector<Vec3> mean = bundle_tangents(exemplar);
  double own = 0;
  double of_bundle = 0;
  double between = 0;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    own += (exemplar.segment_tangent(s) - Vec3::UnitX()).squaredNorm();
    of_bundle += (mean[s] - Vec3::UnitX()).squaredNorm();
    // Angle between unit vectors: 2 asin of half their distance.
    const auto apart = static_cast<double>((exemplar.segment_tangent(s) - mean[s]).norm());
    between += std::pow(2 * std::asin(apart / 2), 2);
  }
  // Midpoints within 0.02 mm are those of 9 fibers (5 at the ends of the grid), one to three
  // segments each: independent wander falls to a ninth (a fifth) in variance, and a little less
  // where segments of one fiber, which share points, cancel.
  EXPECT_LT(of_bundle, own / 4);
  EXPECT_GT(of_bundle, own / 60);
  const double rms = std::sqrt(between / static_cast<double>(mean.size()));
  EXPECT_NEAR(bundle_spread(exemplar, mean), rms, 1e-4 * rms);
}

// Every other fiber runs backwards: its segments come in the opposite order, and their means point
// the other way. The other fibers' means stay as they are.
TEST(BundleTangentsLaw, DirectionDoesNotMatter) {
  const Exemplar forth = wandering_bundle(2);
  Exemplar turned = forth;
  for (std::size_t f = 0; f + 1 < turned.first_point.size(); f += 2) {
    std::reverse(turned.points.begin() + turned.first_point[f],
                 turned.points.begin() + turned.first_point[f + 1]);
  }
  index_segments(turned);
  const std::vector<Vec3> mean = bundle_tangents(forth);
  const std::vector<Vec3> mean_turned = bundle_tangents(turned);
  constexpr std::uint32_t kPerFiber = 20;
  for (std::uint32_t s = 0; s < forth.segment_count(); ++s) {
    const bool backwards = s / kPerFiber % 2 == 0;
    const std::uint32_t first = s / kPerFiber * kPerFiber;
    const Vec3 expected =
        backwards ? Vec3(-mean_turned[2 * first + kPerFiber - 1 - s]) : mean_turned[s];
    EXPECT_LT((mean[s] - expected).norm(), 1e-5F) << s;
  }
}

// Where the tile begins is a convention: moved by parts of a period, and written as a tile of two
// periods, where what was a seam lies in the middle, every segment keeps its mean.
TEST(BundleTangentsLaw, SegmentsAtASeamHaveTheMeanThatTheyHaveElsewhere) {
  const Exemplar exemplar = wandering_bundle(4);
  const std::vector<Vec3> mean = bundle_tangents(exemplar);
  const std::uint32_t segments = static_cast<std::uint32_t>(exemplar.segment_count());
  for (const Vec3& shift : {Vec3(0.25F, 0, 0), Vec3(0, 0.07F, 0)}) {
    Exemplar moved = exemplar;
    for (Vec3& point : moved.points) point += shift;
    index_segments(moved);
    const std::vector<Vec3> mean_moved = bundle_tangents(moved);
    for (std::uint32_t s = 0; s < segments; ++s)
      EXPECT_LT((mean[s] - mean_moved[s]).norm(), 1e-5F) << s;
  }
  // Two tiles side by side, as one: the copies' fibers follow the others.
  for (const int axis : {0, 1}) {
    Exemplar tiled = exemplar;
    const float period = axis == 0 ? exemplar.width_mm : exemplar.height_mm;
    (axis == 0 ? tiled.width_mm : tiled.height_mm) *= 2;
    const auto points = static_cast<std::uint32_t>(exemplar.points.size());
    for (std::size_t f = 0; f < exemplar.fiber_count(); ++f) {
      tiled.first_point.push_back(points + exemplar.first_point[f + 1]);
      tiled.radius_mm.push_back(exemplar.radius_mm[f]);
      tiled.material.push_back(exemplar.material[f]);
    }
    for (Vec3 point : exemplar.points) {
      point[axis] += period;
      tiled.points.push_back(point);
    }
    index_segments(tiled);
    const std::vector<Vec3> mean_tiled = bundle_tangents(tiled);
    ASSERT_EQ(mean_tiled.size(), 2U * segments);
    for (std::uint32_t s = 0; s < segments; ++s) {
      EXPECT_LT((mean[s] - mean_tiled[s]).norm(), 1e-5F) << "axis " << axis << ", " << s;
      EXPECT_LT((mean[s] - mean_tiled[segments + s]).norm(), 1e-5F) << "axis " << axis << ", " << s;
    }
  }
}

// The mean of unit vectors along every segment within four radii, to the digit: two fibers that
// cross at a small angle, one or both of whose pieces reach a segment.
TEST(BundleTangentsLaw, NeighboursWithinFourRadiiCountEqually) {
  for (const float apart : {3.9F, 4.1F}) {
    Exemplar exemplar = test::straight_fibers(0.4F, 0.4F, {{0.1F, 0}, {0.1F, apart * kRadius}},
                                              kRadius, 4, test::white_fiber());
    // The second fiber's middle points are moved aside: its second piece has a slope of 0.2.
    exemplar.points[5 + 1].y() -= 0.01F;
    exemplar.points[5 + 2].y() += 0.01F;
    index_segments(exemplar);
    const Vec3 other = Vec3(0.1F, 0.02F, 0).normalized();
    const Vec3 expected = apart < 4 ? (Vec3::UnitX() + other).normalized() : Vec3(Vec3::UnitX());
    const std::vector<Vec3> mean = bundle_tangents(exemplar);
    EXPECT_LT((mean[1] - expected).norm(), 1e-6F) << apart;
  }
}

TEST(BundleTangents, FibersThatCrossDoNotCount) {
  Exemplar exemplar = straight_bundle();
  const std::vector<Vec3> alone = bundle_tangents(exemplar);
  // A fiber across all others, just over them.
  for (int k = 0; k <= 8; ++k)
    exemplar.points.emplace_back(0.2F, 0.096F * static_cast<float>(k) / 8, 0.058F);
  exemplar.first_point.push_back(static_cast<std::uint32_t>(exemplar.points.size()));
  exemplar.radius_mm.push_back(kRadius);
  exemplar.material.push_back(0);
  index_segments(exemplar);
  const std::vector<Vec3> with = bundle_tangents(exemplar);
  for (std::size_t s = 0; s < alone.size(); ++s) EXPECT_EQ(alone[s], with[s]);
  EXPECT_LT((with.back() - Vec3::UnitY()).norm(), 1e-6F);
}

/// The same by asking every pair of segments.
std::vector<Vec3> bundle_tangents_of_all_pairs(const Exemplar& exemplar) {
  std::vector<Vec3> mean;
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
    Vec3 sum = exemplar.segment_tangent(s);
    for (std::uint32_t other = 0; other < exemplar.segment_count(); ++other) {
      Vec3 apart = exemplar.segment_midpoint(other) - exemplar.segment_midpoint(s);
      apart.x() -= exemplar.width_mm * std::round(apart.x() / exemplar.width_mm);
      apart.y() -= exemplar.height_mm * std::round(apart.y() / exemplar.height_mm);
      const float cosine = exemplar.segment_tangent(other).dot(exemplar.segment_tangent(s));
      const bool counts =
          other != s && apart.norm() <= 4 * exemplar.radius_mm[exemplar.segment_fiber[s]];
      if (counts && std::abs(cosine) >= 0.9F)
        sum += (cosine > 0 ? 1.0F : -1.0F) * exemplar.segment_tangent(other);
    }
    mean.push_back(sum.normalized());
  }
  return mean;
}

void expect_means_of_all_pairs(const Exemplar& exemplar) {
  const std::vector<Vec3> mean = bundle_tangents(exemplar);
  const std::vector<Vec3> expected = bundle_tangents_of_all_pairs(exemplar);
  for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s)
    ASSERT_LT((mean[s] - expected[s]).norm(), 1e-5F) << s;
}

TEST(BundleTangentsAgreement, ColumnsFindWhatAllPairsFind) {
  expect_means_of_all_pairs(synthesize(test::small_fabric()));
  expect_means_of_all_pairs(wandering_bundle(3));
}

// Few fibers on a tile of 1.3 m: 65,000 columns of 4 radii along each axis would be 4 billion.
TEST(BundleTangentsAgreement, SparseYarnsOnALargeTile) {
  FabricConfig config = test::small_fabric();
  config.segment_mm = 10;
  config.weave = parse_weave("plain", WeaveFace::kWarp);
  config.repeats_x = config.repeats_y = 8;
  config.fibers[0].radius_mm = 0.005;
  config.warp.spacing_mm = config.weft.spacing_mm = 81.921;
  for (YarnConfig& yarn : config.yarns) {
    yarn.width_mm = yarn.height_mm = 10;
    yarn.plies = 1;
    yarn.fibers_per_ply = 1;
    yarn.yarn_turns_per_mm = yarn.ply_turns_per_mm = 0;
  }
  const Exemplar exemplar = synthesize(config);
  ASSERT_GT(exemplar.width_mm, 1300);
  ASSERT_GT(exemplar.width_mm / (4 * exemplar.radius_mm[0]), 65'000);
  expect_means_of_all_pairs(exemplar);
}

}  // namespace
}  // namespace heddle
