#include "fibers/tracing/tile_scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/cloth/synthesize.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "tests/support/fabrics.h"
#include "tests/support/fibers.h"

namespace heddle {
namespace {

// First hit with the capsule of a segment (both ends rounded), t of the ray; negative where there
// is none.
double intersect_capsule(const Vec3d& o, const Vec3d& d, const Vec3d& a, const Vec3d& b, double r) {
  const Vec3d axis = (b - a).normalized();
  const double length = (b - a).norm();
  double best = -1;
  auto offer = [&](double t, bool on_side) {
    if (!(t >= 0) || (best >= 0 && t >= best)) return;
    const double along = (o + t * d - a).dot(axis);
    if (!on_side || (along >= 0 && along <= length)) best = t;
  };
  auto roots = [&](const Vec3d& p, const Vec3d& q, bool on_side) {
    const double aa = q.squaredNorm();
    const double bb = p.dot(q);
    const double disc = bb * bb - aa * (p.squaredNorm() - r * r);
    if (disc < 0 || aa == 0) return;
    offer((-bb - std::sqrt(disc)) / aa, on_side);
  };
  const Vec3d p = o - a;
  roots(p - p.dot(axis) * axis, d - d.dot(axis) * axis, true);
  roots(o - a, d, false);
  roots(o - b, d, false);
  return best;
}

// Brute force over explicit copies of the tile.
double first_hit_by_hand(const Exemplar& e, const Ray& ray, std::uint32_t own_fiber, int copies) {
  double best = -1;
  for (std::uint32_t s = 0; s < e.segment_count(); ++s) {
    if (e.segment_fiber[s] == own_fiber) continue;
    for (int j = -copies; j <= copies; ++j) {
      for (int i = -copies; i <= copies; ++i) {
        const Vec3d shift(i * static_cast<double>(e.width_mm), j * static_cast<double>(e.height_mm),
                          0);
        const double t = intersect_capsule(ray.origin.cast<double>(), ray.direction.cast<double>(),
                                           e.points[e.segment_point[s]].cast<double>() + shift,
                                           e.points[e.segment_point[s] + 1].cast<double>() + shift,
                                           e.radius_mm[e.segment_fiber[s]]);
        if (t >= 0 && (best < 0 || t < best)) best = t;
      }
    }
  }
  return best;
}

TEST(TileSceneAgreement, EyeRaysAgreeWithBruteForceOverCopies) {
  for (const FabricConfig& config : test::kinds_of_cloth()) {
    const TileScene scene(synthesize(config));
    const Exemplar& e = scene.exemplar();
    const int copies = static_cast<int>(4.2F / std::min(e.width_mm, e.height_mm));
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
      RandomStream random(1, RandomStage::kTest, 1, static_cast<std::uint64_t>(i));
      const Vec3 origin(3 * random.uniform() - 1, 3 * random.uniform() - 1, 0.5F);
      const Vec3 direction = sample_hemisphere(Vec3(0, 0, -1), random);
      // at most 1.9 mm aside: within the copies of the brute force
      if (direction.z() > -0.3F) continue;
      const Ray ray{origin, 2.5F * direction};
      const double expected = first_hit_by_hand(e, ray, kNoFiber, copies);
      const auto hit = scene.intersect(ray, kNoFiber);
      ASSERT_EQ(hit.has_value(), expected >= 0) << i;
      EXPECT_EQ(scene.occluded(ray, kNoFiber), hit.has_value());
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(hit->t, expected, 2e-5) << i;
    }
    EXPECT_GT(hits, 120);
  }
}

TEST(TileSceneLaw, AWholePeriodChangesNothing) {
  for (const FabricConfig& config : test::kinds_of_cloth()) {
    const TileScene scene(synthesize(config));
    const Exemplar& e = scene.exemplar();
    int differing = 0;
    for (int i = 0; i < 2000; ++i) {
      RandomStream random(1, RandomStage::kTest, 2, static_cast<std::uint64_t>(i));
      const Vec3 origin(random.uniform() * e.width_mm, random.uniform() * e.height_mm, 0.3F);
      const Vec3 direction = sample_hemisphere(Vec3(0, 0, -1), random);
      const auto a = scene.intersect({origin, direction}, kNoFiber);
      const auto b = scene.intersect(
          {origin + Vec3(-3 * e.width_mm, 2 * e.height_mm, 0), direction}, kNoFiber);
      // Rounding of the shifted origin may move a ray that grazes a silhouette to the other side of
      // it.
      if (a.has_value() != b.has_value() ||
          (a && (a->segment != b->segment || std::abs(a->t - b->t) > 1e-4F)))
        ++differing;
    }
    EXPECT_LE(differing, 4);
  }
}

// Where the cloth is cut into tiles does not matter: fibers and rays moved together by a part of a
// period meet as before. Rays are flat, so that they cross many seams.
TEST(TileSceneLaw, SeamsChangeNothing) {
  for (const FabricConfig& config : test::kinds_of_cloth()) {
    const Exemplar exemplar = synthesize(config);
    const Vec3 shift(0.37F * exemplar.width_mm, 0.41F * exemplar.height_mm, 0);
    Exemplar moved = exemplar;
    for (Vec3& point : moved.points) point += shift;
    index_segments(moved);
    const TileScene here(exemplar);
    const TileScene there(moved);
    int hits = 0;
    int differing = 0;
    for (int i = 0; i < 20'000; ++i) {
      RandomStream random(1, RandomStage::kTest, 5, static_cast<std::uint64_t>(i));
      const Vec3 origin(random.uniform() * exemplar.width_mm, random.uniform() * exemplar.height_mm,
                        0.3F);
      const float azimuth = 2 * kPif * random.uniform();
      const Vec3 direction(std::cos(azimuth), std::sin(azimuth), -0.1F - 0.2F * random.uniform());
      const auto a = here.intersect({origin, direction}, kNoFiber);
      const auto b = there.intersect({origin + shift, direction}, kNoFiber);
      hits += a ? 1 : 0;
      const bool same = a.has_value() == b.has_value() &&
                        (!a || (a->segment == b->segment && std::abs(a->t - b->t) < 1e-4F));
      differing += same ? 0 : 1;
    }
    EXPECT_GT(hits, 15'000);
    // Rays that graze a silhouette.
    EXPECT_LE(differing, 20);
  }
}

TEST(TileSceneLaw, OwnFiberIsIgnoredInEveryCopy) {
  // One fiber, endless rows of its copies: with itself excluded, nothing is left to hit.
  const TileScene scene(
      test::straight_fibers(1, 0.5F, {{0.25F, 0}}, 0.05F, 5, test::white_fiber()));
  const Vec3 inside(0.5F, 0.25F, 0);
  EXPECT_TRUE(scene.occluded({inside, Vec3(0, 1, 0)}, kNoFiber));
  EXPECT_FALSE(scene.occluded({inside, Vec3(0, 1, 0)}, 0));
  const auto neighbour = scene.intersect({inside + Vec3(0, 0.1F, 0), Vec3(0, 1, 0)}, kNoFiber);
  ASSERT_TRUE(neighbour);
  EXPECT_NEAR(neighbour->t, 0.35F, 1e-5F);
}

TEST(TileSceneLaw, RangeLimitsHold) {
  const TileScene scene(test::straight_fibers(1, 1, {{0.5F, 0}}, 0.1F, 4, test::white_fiber()));
  const Vec3 origin(0.37F, 0.5F, 1);
  const Vec3 down(0, 0, -2);
  const auto hit = scene.intersect({origin, down}, kNoFiber);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->t, 0.45F, 1e-6F);  // 0.9 mm at two mm per unit of t
  EXPECT_FALSE(scene.intersect({origin, down, 0, 0.449F}, kNoFiber));
  const auto exit = scene.intersect({origin, down, 0.46F, 1}, kNoFiber);
  ASSERT_TRUE(exit);  // from inside, the far side
  EXPECT_NEAR(exit->t, 0.55F, 1e-6F);
}

// A row of parallel fibers is opaque below the angle at which neighbours close the gap.
TEST(TileSceneLaw, ARowOfFibersClosesAtTheKnownAngle) {
  const float r = 0.1F;
  const TileScene scene(test::straight_fibers(1, 0.5F, {{0.25F, 0}}, r, 4, test::white_fiber()));
  // Seen from height 0 in the gap's middle, the neighbour at distance 0.25 subtends asin(r / 0.25)
  // about the horizon.
  const float edge = std::asin(r / 0.25F);
  const Vec3 middle(0.31F, 0.5F, 0);
  for (float off : {-0.01F, 0.01F}) {
    const Vec3 direction(0.02F, std::cos(edge + off), std::sin(edge + off));
    EXPECT_EQ(scene.occluded({middle, direction}, kNoFiber), off < 0);
  }
}

// Two fibers in turn, without end. Across them, fiber B lies at distances 1/2, 3/2, ... to either
// side of fiber A; the nearest copy hides all others, so that a ray from A's axis hits where its
// angle phi from the plane has |sin phi| < r / (1/2), after the length
// rho = cos(phi) / 2 - sqrt(r^2 - sin^2(phi) / 4) across the fibers. Its length along the ray is
// rho / sin(alpha), alpha the angle to the fibers: 1 / sin(alpha) is pi / 2 in the mean over the
// sphere, and independent of phi. Most rays miss. Fiber A, cut into few segments, is as long as
// fiber B, cut into many.
TEST(TileSceneStatistical, MeanFreePathAmongRaysThatHit) {
  const double radius[2] = {0.05, 0.15};
  Exemplar exemplar = test::straight_fibers(0.8F, 1, {{0.25F, 0}}, 0.05F, 2, test::white_fiber());
  constexpr int kPieces = 40;
  for (int k = 0; k <= kPieces; ++k)
    exemplar.points.emplace_back(0.8F * static_cast<float>(k) / kPieces, 0.75F, 0.0F);
  exemplar.first_point.push_back(static_cast<std::uint32_t>(exemplar.points.size()));
  exemplar.radius_mm.push_back(0.15F);
  exemplar.material.push_back(0);
  index_segments(exemplar);
  const TileScene scene(exemplar);
  double rho = 0;
  double angle = 0;
  for (const double r : radius) {
    const double limit = std::asin(r / 0.5);
    const int steps = 2000;
    for (int k = 0; k < steps; ++k) {
      const double sine = std::sin(limit * (k + 0.5) / steps);
      rho += limit / steps * (std::sqrt(1 - sine * sine) / 2 - std::sqrt(r * r - sine * sine / 4));
    }
    angle += limit;
  }
  // 13 % of 400,000 rays hit. 1 / sin(alpha), whose variance grows with the logarithm of their
  // number, is known to 0.7 %.
  EXPECT_NEAR(scene.mean_free_path(1, 400'000) / (kPi / 2 * rho / angle), 1, 0.02);
}

}  // namespace
}  // namespace heddle
