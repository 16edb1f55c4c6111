#include "render/cloth_trace.h"

#include <gtest/gtest.h>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

// Two flat pieces, one 1 mm over the other, and a black triangle below both.
ClothScene two_sheets() {
  const auto tile = std::make_shared<TileScene>(crossed_layers(test_cotton()));
  ClothMesh upper = flat_cloth(6, 6);
  for (Vec3d& p : upper.positions) p.z() += 1;
  const TriangleMesh black = {{{-2, -2, -3}, {4, -2, -3}, {-2, 4, -3}}, {{0, 1, 2}}};
  return ClothScene({{tile, flat_cloth(6, 6)}, {tile, upper}}, {black});
}

struct Fates {
  int onward = 0, ended = 0, escaped = 0, to_other_sheet = 0;
};

Fates count_fates(const ClothScene& scene, bool local) {
  const ClothTrace trace(scene, local);
  RandomStream random(1, RandomStage::kTest, 0, 0);
  Fates fates;
  for (int k = 0; k < 20000; ++k) {
    const Vec3d origin(random.uniform_double() - 0.5, random.uniform_double() - 0.5,
                       0.5);  // between the sheets
    const auto hit = scene.first_fiber({origin, -sample_hemisphere({0, 0, 1}, random)});
    if (!hit || hit->cloth != 0) continue;
    const ClothTrace::Vertex vertex = trace.vertex(*hit);
    const Vec3 direction = sample_sphere(random);
    const auto next = trace.next(vertex, direction);
    // The one law that light found both ways rests on.
    EXPECT_EQ(!next.has_value(), trace.escapes(vertex, direction));
    if (!next) {
      ++fates.escaped;
    } else if (next->is_end) {
      ++fates.ended;
    } else {
      ++fates.onward;
      fates.to_other_sheet += next->hit.cloth == 1 ? 1 : 0;
    }
  }
  return fates;
}

TEST(ClothTraceLaw, PathsEscapeExactlyWhereShadowRaysPass) {
  const ClothScene scene = two_sheets();
  const Fates global = count_fates(scene, false);
  const Fates local = count_fates(scene, true);
  EXPECT_GT(global.to_other_sheet, 100);
  EXPECT_GT(global.ended, 10);
  EXPECT_EQ(local.to_other_sheet, 0);
  // The same rays: what went on to the other sheet ends when local; escapes are untouched.
  EXPECT_EQ(local.ended, global.ended + global.to_other_sheet);
  EXPECT_EQ(local.escaped, global.escaped);
}

TEST(ClothTrace, AMeshInsideTheShellEndsPaths) {
  const auto tile = std::make_shared<TileScene>(crossed_layers(test_cotton()));
  const TriangleMesh middle = {{{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}, {{0, 1, 2}}};
  const ClothScene scene({{tile, flat_cloth(6, 6)}}, {middle});
  const ClothTrace trace(scene, false);
  RandomStream random(2, RandomStage::kTest, 0, 0);
  int ended = 0;
  for (int k = 0; k < 1000; ++k) {
    const auto hit = scene.first_fiber(
        {Vec3d(random.uniform_double(), random.uniform_double(), 2), Vec3(0, 0, -1)});
    if (!hit || hit->position.z() < 0) continue;
    const auto next = trace.next(trace.vertex(*hit), Vec3(0, 0.1F, -1).normalized());
    ASSERT_TRUE(next);
    EXPECT_TRUE(next->is_end || next->hit.position.z() > 0);
    ended += next->is_end ? 1 : 0;
  }
  EXPECT_GT(ended, 10);
}

}  // namespace
}  // namespace heddle
