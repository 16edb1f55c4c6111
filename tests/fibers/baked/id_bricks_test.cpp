#include "fibers/baked/id_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "fibers/math/random.h"

namespace heddle {
namespace {

/// A volume with `share` of its voxels filled, in clumps (so that empty bricks exist). Ids are the
/// voxel's index.
IdVolume random_volume(std::array<int, 3> size, double share, std::uint64_t seed) {
  IdVolume volume;
  volume.size = size;
  volume.voxel_mm = {0.013, 0.017, 0.011};
  volume.origin_mm = {0, 0, -0.05};
  RandomStream random(seed, RandomStage::kTest, 0, 0);
  for (int i = 0; i < size[0] * size[1] * size[2]; ++i)
    volume.ids.push_back(random.uniform() < share ? i : -1);
  return volume;
}

/// The slow way: every middle of a slice on the ray, in the order of the ray.
std::optional<FiberHit> look_at_every_slice(const IdVolume& volume, const Ray& ray) {
  int axis = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(ray.direction[a] / volume.voxel_mm[a]) >=
        std::abs(ray.direction[axis] / volume.voxel_mm[axis]))
      axis = a;
  }
  std::vector<double> samples;
  const double reach = std::ceil(6.0 * std::abs(ray.direction[axis]) / volume.voxel_mm[axis]);
  const double here =
      std::floor((ray.origin[axis] - volume.origin_mm[axis]) / volume.voxel_mm[axis]);
  for (double slice = here - reach - 2; slice <= here + reach + 2; ++slice) {
    const double t =
        (volume.origin_mm[axis] + (slice + 0.5) * volume.voxel_mm[axis] - ray.origin[axis]) /
        ray.direction[axis];
    if (t >= ray.t_min && t <= ray.t_max) samples.push_back(t);
  }
  std::sort(samples.begin(), samples.end());
  for (const double t : samples) {
    int voxel[3];
    for (int a = 0; a < 3; ++a) {
      const double p = ray.origin[a] + t * ray.direction[a];
      voxel[a] = static_cast<int>(std::floor((p - volume.origin_mm[a]) / volume.voxel_mm[a]));
      if (a < 2) voxel[a] = ((voxel[a] % volume.size[a]) + volume.size[a]) % volume.size[a];
    }
    if (voxel[2] < 0 || voxel[2] >= volume.size[2]) continue;
    const std::int32_t id =
        volume
            .ids[(static_cast<std::size_t>(voxel[2]) * volume.size[1] + voxel[1]) * volume.size[0] +
                 voxel[0]];
    if (id >= 0) return FiberHit{static_cast<float>(t), static_cast<std::uint32_t>(id)};
  }
  return {};
}

TEST(IdBricksAgreement, MarchEqualsLookingAtEverySlice) {
  // Sizes with and without a cut-off last brick, dense and sparse; rays from above, below and
  // within; a third of them nearly in the plane or exactly along an axis of it.
  const std::array<std::array<int, 3>, 3> sizes = {{{16, 24, 8}, {21, 9, 13}, {5, 3, 2}}};
  int hits = 0;
  int misses = 0;
  for (std::size_t v = 0; v < sizes.size(); ++v) {
    for (const double share : {0.002, 0.05, 0.5}) {
      const IdVolume volume = random_volume(sizes[v], share, 7 + v);
      const IdBricks bricks(volume);
      const float height = static_cast<float>(volume.size[2] * volume.voxel_mm[2]);
      for (int i = 0; i < 700; ++i) {
        RandomStream random(v, RandomStage::kTest, static_cast<std::uint64_t>(share * 1000), i);
        Ray ray;
        ray.origin = Vec3(2 * random.uniform() - 1, 2 * random.uniform() - 1,
                          -0.05F + height * (3 * random.uniform() - 1));
        ray.direction =
            Vec3(2 * random.uniform() - 1, 2 * random.uniform() - 1, 2 * random.uniform() - 1);
        if (i % 3 == 0) ray.direction[2] *= 0.01F;
        if (i % 9 == 0) ray.direction[i % 2] = 0;
        if (i % 27 == 0) ray.direction[2] = 0;
        if (i % 5 == 0) ray.t_min = 0.3F * random.uniform();
        if (i % 7 == 0) ray.t_max = ray.t_min + 0.2F * random.uniform();
        ray.t_max = std::min(ray.t_max, 6.0F);  // the slow way needs an end
        const std::optional<FiberHit> slow = look_at_every_slice(volume, ray);
        const std::optional<FiberHit> fast = bricks.first_hit(ray);
        ASSERT_EQ(slow.has_value(), fast.has_value())
            << "volume " << v << " share " << share << " ray " << i;
        if (!slow) {
          ++misses;
          continue;
        }
        ++hits;
        EXPECT_EQ(slow->segment, fast->segment)
            << "volume " << v << " share " << share << " ray " << i;
        EXPECT_NEAR(slow->t, fast->t, 1e-5) << "volume " << v << " share " << share << " ray " << i;
      }
    }
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(misses, 1000);
}

TEST(IdBricks, ParameterIsInUnitsOfTheDirection) {
  IdVolume volume = random_volume({8, 8, 4}, 0, 1);
  volume.voxel_mm = {0.25, 0.25, 0.25};
  volume.origin_mm = {0, 0, 0};
  // the layer z in [0.5, 0.75]
  std::fill(volume.ids.begin() + 2 * 64, volume.ids.begin() + 3 * 64, 5);
  const IdBricks bricks(volume);
  for (const float length : {0.1F, 1.0F, 37.0F}) {
    const std::optional<FiberHit> hit =
        bricks.first_hit({Vec3(0.3F, 0.4F, 3.75F), Vec3(0, 0, -length)});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->t * length, 3.125F, 1e-5);  // the middle of the layer
    EXPECT_EQ(hit->segment, 5U);
  }
}

TEST(IdBricks, StartWithinAFilledVoxelHitsWithinASlice) {
  const IdVolume volume = random_volume({9, 9, 9}, 1, 1);
  const IdBricks bricks(volume);
  const std::optional<FiberHit> hit =
      bricks.first_hit({Vec3(-0.2F, 0.7F, 0), Vec3(0.1F, 0.2F, 0.3F), 0.01F});
  ASSERT_TRUE(hit);
  EXPECT_GE(hit->t, 0.01F);
  EXPECT_LE(hit->t, 0.01F + 0.011F / 0.3F);  // one voxel along z
}

TEST(IdBricksLaw, TiltedRaysMeetLittleMoreOfASphereThanItShows) {
  // Share of parallel rays that meet a voxelised sphere (10 voxels of radius) beside its cross
  // section. Along the grid that is the count of columns. Tilted, slices' jagged rims lie over each
  // other and the widest counts; samples in the slices' middles keep that below a third of a voxel
  // all around, where touching every voxel would add half a voxel and more.
  IdVolume volume;
  volume.size = {50, 50, 24};
  volume.voxel_mm = {0.02, 0.02, 0.02};
  for (int z = 0; z < 24; ++z) {
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 50; ++x)
        volume.ids.push_back(std::hypot(x - 24.6, y - 24.9, z - 11.7) <= 10 ? 0 : -1);
    }
  }
  const IdBricks bricks(volume);
  const auto area = [](double voxels) { return kPi * std::pow(0.02 * voxels, 2); };
  for (const Vec3& direction : {Vec3(0, 0, -1), Vec3(0.35F, 0.2F, -1), Vec3(0.3F, 0.28F, -0.9F)}) {
    constexpr int kRays = 40000;
    int hits = 0;
    for (int i = 0; i < kRays; ++i) {
      RandomStream random(2, RandomStage::kTest, 0, static_cast<std::uint64_t>(i));
      hits +=
          bricks.first_hit({Vec3(random.uniform(), random.uniform(), 0.5F), direction}).has_value();
    }
    // Over the area of the tile, a tilted sphere's shadow is an ellipse; no two copies overlap at
    // these tilts.
    const double shown = hits * static_cast<double>(-direction.normalized().z()) / kRays;
    const double noise = 3 * std::sqrt(area(10) / kRays);
    EXPECT_GT(shown, area(9.9) - noise);
    EXPECT_LT(shown, area(direction.x() == 0 ? 10.1 : 10.33) + noise);
  }
}

TEST(IdBricks, RaysThatNeverEndAreGivenUp) {
  const IdVolume empty = random_volume({9, 9, 9}, 0, 1);
  const IdBricks bricks(empty);
  EXPECT_FALSE(bricks.first_hit({Vec3(0, 0, 0), Vec3(1, 0, 0)}));
  EXPECT_FALSE(bricks.first_hit({Vec3(0, 0, 0), Vec3(-0.3F, 0.8F, 0)}));
  EXPECT_FALSE(bricks.first_hit({Vec3(0, 0, 0), Vec3(0.3F, 0.8F, 1e-30F)}));
  EXPECT_FALSE(bricks.first_hit({Vec3(0, 0, 5), Vec3(1, 0, 0)}));
  EXPECT_FALSE(bricks.first_hit({Vec3(0, 0, 5), Vec3(0, 0, 1)}));
}

TEST(IdBricks, FarOriginFindsTheSameVoxelAsANearOne) {
  // A ray from 300 mm away: the march restarts in tile (0, 0), so that only the float of the origin
  // limits it.
  const IdVolume volume = random_volume({40, 40, 10}, 0.3, 3);
  const IdBricks bricks(volume);
  int same = 0;
  for (int i = 0; i < 500; ++i) {
    RandomStream random(1, RandomStage::kTest, 1, i);
    const Vec3 direction =
        Vec3(random.uniform() - 0.5F, random.uniform() - 0.5F, -0.3F).normalized();
    const Vec3 near(random.uniform(), random.uniform(), 0.1F);
    const auto a = bricks.first_hit({near, direction});
    const auto b = bricks.first_hit({near - 300 * direction, direction});
    if (!a || !b || a->segment != b->segment) {
      same += !a && !b;
      continue;
    }
    ++same;
    EXPECT_NEAR(b->t - 300, a->t, 1e-4);
  }
  // Positions 300 mm away are rounded to 1.5e-5 mm, a thousandth of a voxel: of the few planes a
  // ray crosses before its hit, fewer than 1 % come with a change of order.
  EXPECT_GT(same, 485);
}

}  // namespace
}  // namespace heddle
