#include "render/yarn_drift.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "fibers/math/random.h"
#include "formats/input_error.h"
#include "render/cloth_scene.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

constexpr YarnDriftConfig kDrift{.spacing_rms = 0.05, .across_mm = 1.5, .along_mm = 12, .seed = 4};

TEST(YarnDrift, SpacingsVaryAsMuchAsAsked) {
  const YarnDrift drift(kDrift);
  constexpr double kStep = 1e-4;
  Eigen::Vector2d across(0, 0);
  Eigen::Vector2d along(0, 0);
  constexpr int kPlaces = 20000;
  for (std::uint64_t k = 0; k < kPlaces; ++k) {
    RandomStream random(1, RandomStage::kTest, k, 0);
    const Eigen::Vector2d p(1000 * random.uniform_double(), 1000 * random.uniform_double());
    const Eigen::Vector2d by_x =
        (drift.shift(p + Eigen::Vector2d(kStep, 0)) - drift.shift(p)) / kStep;
    const Eigen::Vector2d by_y =
        (drift.shift(p + Eigen::Vector2d(0, kStep)) - drift.shift(p)) / kStep;
    across += Eigen::Vector2d(by_x.x() * by_x.x(), by_y.y() * by_y.y());
    along += Eigen::Vector2d(by_y.x() * by_y.x(), by_x.y() * by_x.y());
  }
  // The mean over the plane is exact; over these places it is good to 2 %.
  EXPECT_NEAR(std::sqrt(across.x() / kPlaces), 0.05, 0.002);
  EXPECT_NEAR(std::sqrt(across.y() / kPlaces), 0.05, 0.002);
  // Waves along the yarns are 8 times as long in the mean: slopes are that much smaller, give or
  // take the octaves over which lengths are spread.
  EXPECT_LT(std::sqrt(along.x() / kPlaces), 0.05 / 2);
  EXPECT_GT(std::sqrt(along.x() / kPlaces), 0.05 / 20);
}

TEST(YarnDrift, ARefinedMeshIsTheSameSurfaceWithoutGaps) {
  const ClothMesh coarse = flat_cloth(5, 3, 2);
  const ClothMesh fine = refined(coarse, 0.4);
  double area = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;  // directed edges
  for (const auto& t : fine.triangles) {
    const Vec3d normal = (fine.positions[t[1]] - fine.positions[t[0]])
                             .cross(fine.positions[t[2]] - fine.positions[t[0]]);
    EXPECT_GT(normal.z(), 0);  // no triangle is turned over
    area += 0.5 * normal.z();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k];
      const std::uint32_t b = t[(k + 1) % 3];
      EXPECT_LE((fine.fabric[a] - fine.fabric[b]).norm(), 0.4);
      EXPECT_EQ(++sides[std::make_pair(a, b)], 1);
    }
  }
  EXPECT_NEAR(area, 15, 1e-9);
  // Every edge has a triangle on its other side, but on the rim, where no gap opens either: its
  // length is that of the rim.
  double rim = 0;
  for (const auto& [edge, count] : sides) {
    if (!sides.contains({edge.second, edge.first}))
      rim += (fine.positions[edge.first] - fine.positions[edge.second]).norm();
  }
  EXPECT_NEAR(rim, 16, 1e-9);
  for (std::size_t v = 0; v < fine.positions.size(); ++v)
    EXPECT_LT((fine.positions[v].head<2>() - fine.fabric[v]).norm(), 1e-12);
}

TEST(YarnDrift, TooManyTrianglesAreRefused) {
  EXPECT_THROW(refined(flat_cloth(1000, 1000), 0.1), ConfigError);
}

TEST(YarnDrift, ClothWithDriftIsWholeAndDrifts) {
  const auto tile = std::make_shared<const TileScene>(crossed_layers(test_cotton()));
  const ClothScene even({{tile, flat_cloth(20, 20)}}, {});
  const ClothScene uneven({{tile, with_yarn_drift(flat_cloth(20, 20), kDrift)}}, {});
  EXPECT_EQ(uneven.flipped_tets(), 0U);
  EXPECT_EQ(uneven.degenerate_tets(), 0U);
  const YarnDrift drift(kDrift);
  const double thickness = static_cast<double>(tile->exemplar().z_max) * 2.1;
  int hits = 0;
  for (std::uint64_t k = 0; k < 4000; ++k) {
    RandomStream random(2, RandomStage::kTest, k, 0);
    const Vec3d from(16 * random.uniform_double() - 8, 16 * random.uniform_double() - 8, 4);
    const Vec3 down(0, 0, -1);
    const auto hit = uneven.first_fiber({from, down});
    // What the ray would see where the fabric has not drifted, but lies under it.
    const Eigen::Vector2d moved = from.head<2>() + drift.shift(from.head<2>());
    if (hit) {
      ++hits;
      // Pieces that are linear leave 8 % of the waves' amplitude, some 0.012 mm each way.
      EXPECT_LT((hit->fabric.head<2>() - moved).norm(), 3e-3);
      EXPECT_LT(std::abs(hit->position.z()), thickness);
    }
  }
  EXPECT_GT(hits, 2000);
  EXPECT_EQ(uneven.failed_walks(), 0U);
  EXPECT_TRUE(even.first_fiber({Vec3d(0.013, 0.027, 5), Vec3(0, 0, -1)}));
}

}  // namespace
}  // namespace heddle
