#include "precompute/voxelize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fibers/baked/id_bricks.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "formats/input_error.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

/// Three fibers: a tilted one that leaves the tile along x over its edge, a thicker one along y,
/// one zigzag along x.
Exemplar three_fibers() {
  Exemplar exemplar;
  exemplar.width_mm = 0.31F;
  exemplar.height_mm = 0.23F;
  exemplar.first_point = {0, 3, 6, 11};
  exemplar.points = {
      Vec3(0.25F, 0.22F, 0.02F),  Vec3(0.40F, 0.24F, 0.05F),  Vec3(0.56F, 0.22F, 0.02F),
      Vec3(0.1F, -0.05F, -0.03F), Vec3(0.12F, 0.07F, -0.02F), Vec3(0.1F, 0.18F, -0.03F),
      Vec3(0, 0.1F, 0.03F),       Vec3(0.08F, 0.12F, 0.04F),  Vec3(0.15F, 0.1F, 0.03F),
      Vec3(0.22F, 0.08F, 0.04F),  Vec3(0.31F, 0.1F, 0.03F)};
  exemplar.radius_mm = {0.01F, 0.02F, 0.012F};
  exemplar.material = {0, 0, 0};
  exemplar.scattering.resize(1);
  index_segments(exemplar);
  return exemplar;
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double along = (b - a).norm();
  const Vec3 u = (b - a) / along;
  const double s = (p - a).dot(u);
  if (s < 0) return (p - a).norm();
  if (s > along) return (p - b).norm();
  return (p - a - s * u).norm();
}

TEST(VoxelizeAgreement, EveryVoxelHoldsTheNearestAxisThatReachesItsCentre) {
  const Exemplar exemplar = three_fibers();
  const IdVolume volume = voxelize(exemplar, {1.3});
  std::size_t filled = 0;
  for (int z = 0; z < volume.size[2]; ++z) {
    for (int y = 0; y < volume.size[1]; ++y) {
      for (int x = 0; x < volume.size[0]; ++x) {
        const Vec3 centre(static_cast<float>((x + 0.5) * volume.voxel_mm[0]),
                          static_cast<float>((y + 0.5) * volume.voxel_mm[1]),
                          static_cast<float>(volume.origin_mm[2] + (z + 0.5) * volume.voxel_mm[2]));
        double nearest = std::numeric_limits<double>::infinity();
        double nearest_of_id = std::numeric_limits<double>::infinity();
        // to a surface: a rounding there decides either way
        double margin = std::numeric_limits<double>::infinity();
        const std::int32_t id =
            volume.ids[(static_cast<std::size_t>(z) * volume.size[1] + y) * volume.size[0] + x];
        for (std::uint32_t s = 0; s < exemplar.segment_count(); ++s) {
          const float radius = exemplar.radius_mm[exemplar.segment_fiber[s]];
          for (int j = -3; j <= 3; ++j) {
            for (int i = -3; i <= 3; ++i) {
              const Vec3 shift(static_cast<float>(i) * exemplar.width_mm,
                               static_cast<float>(j) * exemplar.height_mm, 0);
              const double d =
                  distance_to_segment(centre, exemplar.points[exemplar.segment_point[s]] + shift,
                                      exemplar.points[exemplar.segment_point[s] + 1] + shift);
              margin = std::min(margin, std::abs(d - radius));
              if (d > radius) continue;
              nearest = std::min(nearest, d);
              if (static_cast<std::int32_t>(s) == id) nearest_of_id = std::min(nearest_of_id, d);
            }
          }
        }
        if (margin < 1e-6) continue;
        ASSERT_EQ(id >= 0, std::isfinite(nearest));
        if (id < 0) continue;
        ++filled;
        EXPECT_NEAR(nearest_of_id, nearest, 1e-6);
      }
    }
  }
  EXPECT_GT(filled, 500U);
}

TEST(Voxelize, TileIsAWholeNumberOfVoxelsNearTheAskedEdge) {
  const Exemplar exemplar = three_fibers();
  for (const double per_radius : {0.7, 1.0, 3.3}) {
    const IdVolume volume = voxelize(exemplar, {per_radius});
    const double edge = 0.01 / per_radius;
    const double extent[3] = {exemplar.width_mm, exemplar.height_mm,
                              exemplar.z_max - exemplar.z_min};
    for (int a = 0; a < 3; ++a) {
      EXPECT_NEAR(volume.size[a] * volume.voxel_mm[a], extent[a], 1e-9);
      // Rounding to n voxels changes the edge by at most half a part in n.
      EXPECT_NEAR(volume.voxel_mm[a] / edge, 1, 0.5 / volume.size[a] + 1e-9);
    }
    EXPECT_NEAR(volume.origin_mm[2], exemplar.z_min, 1e-9);
  }
}

TEST(VoxelizeLaw, FilledShareIsTheVolumeOfTheFiber) {
  // One straight fiber along x, off the grid's symmetry planes: filled share of the tile = pi r^2 /
  // (height * thickness).
  Exemplar exemplar;
  exemplar.width_mm = 0.1F;
  exemplar.height_mm = 0.1F;
  exemplar.first_point = {0, 3};
  exemplar.points = {Vec3(0, 0.0312F, 0), Vec3(0.04F, 0.0312F, 0), Vec3(0.1F, 0.0312F, 0)};
  exemplar.radius_mm = {0.01F};
  exemplar.material = {0};
  exemplar.scattering.resize(1);
  index_segments(exemplar);
  const IdVolume volume = voxelize(exemplar, {8});
  double filled = 0;
  for (const std::int32_t id : volume.ids) filled += id >= 0;
  const double expected = kPi * 0.01 * 0.01 / (0.1 * 0.02);
  // Points of a grid in a disc of radius 8 edges: off by less than the circle's length in edges /
  // area, 2 / 8, in the worst case; by about (2 pi 8)^(1/2) / (pi 64) = 3.5 % as a standard
  // deviation. 3 of them.
  EXPECT_NEAR(filled / static_cast<double>(volume.ids.size()) / expected, 1, 0.105);
}

/// A hair across the tile's corner: an open fiber of four segments.
TEST(VoxelizeLaw, AnOpenFiberEndsRoundInEveryCopy) {
  Exemplar exemplar;
  exemplar.width_mm = 0.31F;
  exemplar.height_mm = 0.23F;
  exemplar.first_point = {0, 4};
  exemplar.points = {Vec3(0.25F, 0.2F, 0), Vec3(0.3F, 0.22F, 0.02F), Vec3(0.35F, 0.25F, 0.03F),
                     Vec3(0.4F, 0.26F, 0.03F)};
  exemplar.radius_mm = {0.02F};
  exemplar.material = {0};
  exemplar.is_open = {1};
  exemplar.scattering = {test::white_fiber()};
  index_segments(exemplar);
  EXPECT_NO_THROW(validate_exemplar(exemplar, "hair"));
  const IdVolume volume = voxelize(exemplar, {4});
  double filled = 0;
  for (const std::int32_t id : volume.ids) filled += id >= 0;
  double length = 0;
  for (std::size_t k = 0; k < 3; ++k)
    length += static_cast<double>((exemplar.points[k + 1] - exemplar.points[k]).norm());
  const double expected = kPi * 0.02 * 0.02 * (length + 4.0 / 3 * 0.02);
  const double voxel = volume.voxel_mm[0] * volume.voxel_mm[1] * volume.voxel_mm[2];
  // A sphere or cylinder of 4 voxels radius, off by a few percent; bends count twice or not.
  EXPECT_NEAR(filled * voxel / expected, 1, 0.04);
}

TEST(VoxelizeStatistical, RaysThroughTheVolumeSeeWhatRaysAgainstFibersSee) {
  const TileScene scene(crossed_layers(test_cotton()));
  const Exemplar& exemplar = scene.exemplar();
  double disagreement_before = 1;
  for (const double per_radius : {1.5, 3.0, 6.0}) {
    const IdVolume volume = voxelize(exemplar, {per_radius});
    const IdBricks bricks(volume);
    int both = 0;
    int same = 0;
    int fiber_hits = 0;
    int volume_hits = 0;
    double deeper = 0;
    constexpr int kRays = 20000;
    for (int i = 0; i < kRays; ++i) {
      RandomStream random(3, RandomStage::kTest, 0, static_cast<std::uint64_t>(i));
      Ray ray;
      ray.origin = Vec3(random.uniform(), random.uniform(), exemplar.z_max + 0.01F);
      ray.direction = -sample_hemisphere(Vec3::UnitZ(), random);
      // grazing rays tell fibers apart by less than any voxel
      if (ray.direction.z() > -0.3F) continue;
      const auto by_fibers = scene.intersect(ray, kNoFiber);
      const auto by_volume = bricks.first_hit(ray);
      fiber_hits += by_fibers.has_value();
      volume_hits += by_volume.has_value();
      if (!by_fibers || !by_volume) continue;
      ++both;
      if (exemplar.segment_fiber[by_fibers->segment] != exemplar.segment_fiber[by_volume->segment])
        continue;
      ++same;
      deeper += (by_volume->t - by_fibers->t) * -ray.direction.z();
    }
    // Silhouettes are off by a fraction of a voxel, so the share of rays that see another fiber
    // falls in proportion to its edge.
    const double disagreement = 1 - static_cast<double>(same) / both;
    std::printf(
        "  %.1f voxels per radius: %.2f %% see another fiber, %.3f voxels deeper, hits %+.2f %%\n",
        per_radius, 100 * disagreement, deeper / same / volume.voxel_mm[2],
        100.0 * (volume_hits - fiber_hits) / fiber_hits);
    EXPECT_LT(disagreement, 0.75 * disagreement_before);
    EXPECT_LT(disagreement, 0.25 / per_radius);
    // Samples are half a slice apart from the surface on average.
    EXPECT_NEAR(deeper / same / volume.voxel_mm[2], 0, 1);
    EXPECT_NEAR(volume_hits, fiber_hits, 0.02 * fiber_hits);
    disagreement_before = disagreement;
  }
}

TEST(Voxelize, SettingsComeFromTheSection) {
  EXPECT_DOUBLE_EQ(
      read_volume_settings(TomlTable::parse("voxels_per_radius = 2.5", "f.toml")).voxels_per_radius,
      2.5);
  EXPECT_THROW(read_volume_settings(TomlTable::parse("voxels_per_radius = 0", "f.toml")),
               ConfigError);
  EXPECT_THROW(voxelize(three_fibers(), {1000}), ConfigError);
}

}  // namespace
}  // namespace heddle
