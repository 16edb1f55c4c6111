#include "render/triangle_scene.h"

#include <gtest/gtest.h>

namespace heddle {
namespace {

TriangleMesh square(float z) {
  return {{{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}}, {{0, 1, 2}, {0, 2, 3}}};
}

TEST(TriangleScene, FindsTheNearestTriangleFromEitherSide) {
  const TriangleScene scene({square(1), square(2)});
  EXPECT_FLOAT_EQ(scene.intersect({0.3F, 0.1F, 0}, {0, 0, 1})->t, 1);
  EXPECT_FLOAT_EQ(scene.intersect({0.3F, 0.1F, 5}, {0, 0, -1})->t, 3);
  EXPECT_FALSE(scene.intersect({0.3F, 0.1F, 0}, {0, 0, -1}));
  EXPECT_FALSE(scene.intersect({0.3F, 0.1F, 0}, {0, 0, 1}, 0.9F));
  EXPECT_TRUE(scene.occluded({0.3F, 0.1F, 0}, {0, 0, 1}));
  EXPECT_FALSE(scene.occluded({0.3F, 0.1F, 0}, {0, 0, 1}, 0.9F));
  EXPECT_FALSE(scene.occluded({3, 0, 0}, {0, 0, 1}));
}

TEST(TriangleScene, SaysWhereOnTheMeshesAHitLies) {
  const std::vector<TriangleMesh> meshes = {square(1), square(2)};
  const TriangleScene scene(meshes);
  for (const Vec3& target : {Vec3(0.3F, 0.1F, 2), Vec3(-0.5F, 0.25F, 2)}) {
    const auto hit = scene.intersect(target + Vec3(0, 0, 3), {0, 0, -1});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->mesh, 1U);
    const auto& corner = meshes[1].triangles[hit->triangle];
    const auto& p = meshes[1].positions;
    const Vec3 point =
        (1 - hit->u - hit->v) * p[corner[0]] + hit->u * p[corner[1]] + hit->v * p[corner[2]];
    EXPECT_LT((point - target).norm(), 1e-6F);
  }
}

TEST(TriangleScene, ListsAllCrossingsInOrder) {
  const TriangleScene scene({square(3), square(1), square(2)});
  std::vector<TriangleScene::Crossing> crossings;
  scene.crossings({0.5F, -0.5F, 0}, {0, 0, 1}, TriangleScene::kInfinity, crossings);
  ASSERT_EQ(crossings.size(), 3U);
  EXPECT_EQ(crossings[0].mesh, 1U);
  EXPECT_EQ(crossings[1].mesh, 2U);
  EXPECT_EQ(crossings[2].mesh, 0U);
  EXPECT_EQ(crossings[0].triangle, 0U);
  EXPECT_FLOAT_EQ(crossings[2].t, 3);
  scene.crossings({0.5F, -0.5F, 0}, {0, 0, 1}, 2.5F, crossings);
  EXPECT_EQ(crossings.size(), 2U);
}

TEST(TriangleScene, EmptySceneBlocksNothing) {
  const TriangleScene scene({});
  EXPECT_FALSE(scene.occluded({0, 0, 0}, {0, 0, 1}));
  EXPECT_FALSE(scene.intersect({0, 0, 0}, {0, 0, 1}));
}

}  // namespace
}  // namespace heddle
