#include "render/cloth_scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/tracing/tile_trace.h"
#include "tests/support/fibers.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

std::shared_ptr<const TileScene> small_tile() {
  return std::make_shared<TileScene>(crossed_layers(test_cotton()));
}

ClothMesh drape() {
  const std::string path = std::string(HEDDLE_SOURCE_DIR) + "/configs/meshes/drape_sphere_64.obj";
  return cloth_mesh_of(read_obj(path), path, 1000.0, 300.0);
}

TriangleMesh square(float z, float half) {
  return {{{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}},
          {{0, 1, 2}, {0, 2, 3}}};
}

// Rays from above onto the middle of a swatch meet the same segments at the same places as on the
// endless flat tile.
TEST(ClothSceneAgreement, FlatSwatchIsTheFlatTile) {
  const auto tile = small_tile();
  const ClothScene scene({{tile, flat_cloth(40, 40)}}, {});
  const TileTrace flat(*tile);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  int hits = 0;
  int differing = 0;
  constexpr int kRays = 20000;
  for (int k = 0; k < kRays; ++k) {
    Vec3 direction = -sample_hemisphere({0, 0, 1}, random);
    direction.z() = std::min(direction.z(), -0.1F);
    direction.normalize();
    const Vec3 target(0.5F * random.uniform(), 0.5F * random.uniform(), 0);
    const Vec3 origin = target - 5 * direction;
    const auto expected = flat.first(origin, direction);
    const auto hit = scene.first_fiber({origin.cast<double>(), direction});
    if (hit.has_value() != expected.has_value() || (hit && hit->segment != expected->segment)) {
      ++differing;  // rays a fiber, within the rounding of either side
      continue;
    }
    if (!hit) continue;
    ++hits;
    EXPECT_LT((hit->position - expected->position.cast<double>()).norm(), 1e-4);
    EXPECT_LT((hit->fabric - hit->position).norm(), 1e-6);
    EXPECT_LT((scene.world_tangent(*hit) - expected->tangent).norm(), 1e-5F);
    // One scattered ray from here, own fiber ignored.
    const Vec3 next_direction = sample_sphere(random);
    const auto next_expected = flat.next(*expected, next_direction);
    const auto next = scene.first_fiber({hit->position, next_direction, &*hit});
    // The flat tile goes on for ever; nearly parallel rays reach the swatch's rim.
    if (std::abs(next_direction.z()) < 0.05F) continue;
    if (next.has_value() != next_expected.has_value() ||
        (next && next->segment != next_expected->segment))
      ++differing;
  }
  std::printf("  %d of %d rays hit, %d differ\n", hits, kRays, differing);
  EXPECT_GT(hits, kRays / 2);
  // A hit within 1e-6 mm of a silhouette 0.0175 mm wide: some 1e-4 of the rays.
  EXPECT_LT(differing, 20);
  EXPECT_EQ(scene.failed_walks(), 0U);
}

TEST(ClothSceneAgreement, OcclusionIsHavingAHit) {
  const ClothScene scene({{small_tile(), drape()}}, {});
  RandomStream random(2, RandomStage::kTest, 0, 0);
  int hits = 0;
  for (int k = 0; k < 3000; ++k) {
    const Vec3d origin = 300 * sample_sphere(random).cast<double>();
    const Vec3d target = 70 * sample_sphere(random).cast<double>();
    const Vec3 direction = (target - origin).normalized().cast<float>();
    const auto hit = scene.first_fiber({origin, direction});
    EXPECT_EQ(hit.has_value(), scene.occluded({origin, direction}));
    if (!hit) continue;
    ++hits;
    EXPECT_NEAR((hit->position - origin).norm(), hit->t, 1e-3);
    const Vec3 scattered = sample_sphere(random);
    EXPECT_EQ(scene.first_fiber({hit->position, scattered, &*hit}).has_value(),
              scene.occluded({hit->position, scattered, &*hit}));
  }
  EXPECT_GT(hits, 1000);
  EXPECT_EQ(scene.failed_walks(), 0U);
}

// Two pieces that overlap in space: the first hit is the nearer of the hits of each alone.
TEST(ClothSceneAgreement, OverlappingShells) {
  const auto tile = small_tile();
  ClothMesh lifted = flat_cloth(4, 4);
  for (Vec3d& p : lifted.positions) p += Vec3d(0.07, 0.03, 0.11);
  const ClothScene both({{tile, flat_cloth(4, 4)}, {tile, lifted}}, {});
  const ClothScene lower({{tile, flat_cloth(4, 4)}}, {});
  const ClothScene upper({{tile, lifted}}, {});
  RandomStream random(3, RandomStage::kTest, 0, 0);
  int from_lower = 0;
  for (int k = 0; k < 5000; ++k) {
    const Vec3 direction = sample_sphere(random);
    const Vec3d origin = Vec3d(random.uniform_double(), random.uniform_double(), 0.05) -
                         5 * direction.cast<double>();
    const auto a = lower.first_fiber({origin, direction});
    const auto b = upper.first_fiber({origin, direction});
    const auto found = both.first_fiber({origin, direction});
    ASSERT_EQ(found.has_value(), a || b);
    if (!found) continue;
    const double nearest = std::min(a ? a->t : 1e9, b ? b->t : 1e9);
    EXPECT_NEAR(found->t, nearest, 1e-6);
    from_lower += found->cloth == 0 ? 1 : 0;
  }
  EXPECT_GT(from_lower, 1000);
}

TEST(ClothScene, GlobalVisibilityCountsShellsAndMeshes) {
  const auto tile = small_tile();
  const auto open_up = [](const ClothScene& scene) {
    const auto hit = scene.first_fiber({Vec3d(0.013, 0.027, 5), Vec3(0, 0, -1)});
    EXPECT_TRUE(hit);
    return scene.globally_visible(scene.surface_point(*hit, ClothSide::kFace), Vec3(0, 0, 1));
  };
  const ClothScene alone({{tile, flat_cloth(4, 4)}}, {});
  EXPECT_TRUE(open_up(alone));
  EXPECT_FALSE(open_up(ClothScene({{tile, flat_cloth(4, 4)}}, {square(10, 1)})));
  ClothMesh above = flat_cloth(4, 4);
  for (Vec3d& p : above.positions) p.z() += 8;
  EXPECT_FALSE(open_up(ClothScene({{tile, flat_cloth(4, 4)}, {tile, above}}, {})));

  const auto hit = alone.first_fiber({Vec3d(0.013, 0.027, 5), Vec3(0, 0, -1)});
  ASSERT_TRUE(hit);
  const Shell::SurfacePoint face = alone.surface_point(*hit, ClothSide::kFace);
  const Shell::SurfacePoint back = alone.surface_point(*hit, ClothSide::kBack);
  EXPECT_NEAR(face.position.x(), hit->position.x(), 1e-6);
  EXPECT_TRUE(alone.globally_visible(face, Vec3(0.995F, 0, 0.0998F)));  // nearly along the surface
  EXPECT_FALSE(alone.globally_visible(face, Vec3(0, 0, -1)));
  EXPECT_TRUE(alone.globally_visible(back, Vec3(0, 0, -1)));
  const ClothScene lined({{tile, flat_cloth(4, 4), true}}, {});
  EXPECT_FALSE(lined.globally_visible(back, Vec3(0, 0, -1)));
}

TEST(ClothScene, UnderlayIsJustBelowTheFibers) {
  const auto tile = small_tile();
  const ClothScene lined({{tile, flat_cloth(4, 4), true}}, {});
  const auto hit = lined.first_mesh(Vec3d(0.1, 0.1, 5), Vec3(0, 0, -1));
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->surface, nullptr);
  const double z = 5 - hit->t;
  EXPECT_LT(z, tile->exemplar().z_min);
  EXPECT_GT(z, tile->exemplar().z_min - 0.02 * (tile->exemplar().z_max - tile->exemplar().z_min));
}

TEST(ClothScene, PiecesOfOneFabricShareTheirMaterials) {
  const auto one = small_tile();
  const auto other = std::make_shared<TileScene>(single_fiber(test::white_fiber()));
  const ClothScene scene(
      {{one, flat_cloth(1, 1)}, {other, flat_cloth(1, 1)}, {one, flat_cloth(1, 1)}}, {});
  EXPECT_EQ(scene.materials().size(), 2U);
  EXPECT_EQ(scene.material_offset(1), 1);
  EXPECT_EQ(scene.material_offset(2), 0);
}

// Directions go to fabric space by the inverse of the map that takes tangents to the world.
TEST(ClothScene, DirectionsRoundTrip) {
  const ClothScene scene({{small_tile(), drape()}}, {});
  RandomStream random(5, RandomStage::kTest, 0, 0);
  int checked = 0;
  while (checked < 100) {
    const Vec3d origin = 300 * sample_sphere(random).cast<double>();
    const Vec3 direction = -origin.normalized().cast<float>();
    const auto hit = scene.first_fiber({origin, direction});
    if (!hit) continue;
    ++checked;
    const Vec3 back = scene.fabric_direction(*hit, scene.world_tangent(*hit));
    EXPECT_LT((back - scene.exemplar(0).segment_tangent(hit->segment)).norm(), 1e-5F);
  }
}

}  // namespace
}  // namespace heddle
