#include "precompute/far_bake.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "tests/support/fibers.h"
#include "tests/support/small_exemplars.h"

namespace heddle {
namespace {

/// A fabric in which nothing hides anything, and whose one cell hands light on as it came.
struct OpenFabric {
  TileScene scene;
  SsdfVisibility ssdf;
  Transfer transfer;
  std::vector<BcsdfTable> materials;

  OpenFabric(const Exemplar& exemplar, bool both_sides) : scene(exemplar) {
    const std::size_t segments = exemplar.segment_count();
    ssdf = open_distances(segments);
    transfer.order = 2;
    transfer.both_sides = both_sides;
    transfer.cell_of_segment.assign(segments, 0);
    transfer.matrices.assign(std::size_t{9} * 9 * 3, 0.0F);
    for (std::size_t j = 0; j < 9; ++j) {
      for (std::size_t c = 0; c < 3; ++c) transfer.matrices[(j * 9 + j) * 3 + c] = 1;
    }
    transfer.paths = {1};
    materials = bcsdf_tables(exemplar.scattering);
  }
  FarTable bake(FarSettings settings) const {
    return bake_far({&scene, &ssdf, &transfer, {}, materials, 1.0}, settings, [](double) {});
  }
};

FarSettings coarse(int rays) {
  FarSettings settings;
  settings.resolution = 8;
  settings.rays = rays;
  return settings;
}

TEST(FarBakeLaw, WhiteFibersInLightFromEverywhereShowOne) {
  // A white isotropic fiber scatters the mean of the light about it. In light 1 from everywhere
  // that is 1 from every view, by single scattering where all is open, and by multiple scattering
  // where the cell hands light on.
  const OpenFabric fabric(crossed_layers(test::white_fiber()), true);
  const FarTable table = fabric.bake(coarse(256));
  const std::size_t lights = table.light_count();
  ASSERT_EQ(lights, 128U);
  for (std::uint32_t view = 0; view < table.view_count(); ++view) {
    double single = 0;
    for (std::size_t l = 0; l < lights; ++l)
      single += static_cast<double>(float_from_half(table.single[(view * lights + l) * 3 + 1]));
    EXPECT_NEAR(single * 4 * kPi / static_cast<double>(lights), 1, 0.02) << view;
    // Of light 1 from everywhere, c_light is the square root of 4 pi in the constant.
    EXPECT_NEAR(table.multiple[view * 27 + 1] * std::sqrt(4 * kPif), 1, 2e-3) << view;
  }
}

TEST(FarBakeLaw, OneFiberCoversWhatItsRadiusSays) {
  const OpenFabric fabric(single_fiber(test_cotton()), false);
  const FarTable table = fabric.bake(coarse(4096));
  const DirectionGrid grid = table.grid();
  for (std::uint32_t view = 0; view < table.view_count(); ++view) {
    // The fiber runs along y: seen from wo it is 2 r / cos wide on the plane, by the angle across.
    const Vec3 wo = grid.direction(view);
    const double cosine = std::abs(wo.z()) / std::hypot(wo.x(), wo.z());
    const double expected = std::min(1.0, 0.1 / cosine);
    const double noise = std::sqrt(expected * (1 - expected) / 4096);
    EXPECT_NEAR(table.coverage[view], expected, 5 * noise + 1e-6) << wo.transpose();
    // Over a disk seen from the top, the mean height is pi / 4 of the radius.
    if (cosine > 0.99) {
      EXPECT_NEAR(table.height[view], std::copysign(0.05 * kPi / 4, wo.z()), 0.004);
    }
  }
}

TEST(FarBakeLaw, EveryLobeKeepsItsLight) {
  // What a fiber sends to the eye of light from everywhere does not depend on how it is sorted and
  // tabulated: the sum over the lights is the integral of its BCSDF.
  const FiberScattering silk = test::silk_fiber();
  const OpenFabric fabric(single_fiber(silk), true);
  FarSettings settings = coarse(256);
  settings.resolution = 16;
  const FarTable table = fabric.bake(settings);
  const BcsdfTable& bcsdf = fabric.materials[0];
  const DirectionGrid grid = table.grid();
  const DirectionGrid fine(128);
  double worst = 0;
  for (std::uint32_t view = 0; view < table.view_count(); view += 37) {
    const Vec3 wo = grid.direction(view);
    if (std::abs(wo.y()) > 0.9F) continue;  // along the fiber
    const auto to_fiber = [](const Vec3& w) { return Vec3(w.y(), w.z(), w.x()); };
    double expected = 0;
    for (std::uint32_t l = 0; l < fine.count(); ++l) {
      const Vec3 wi = to_fiber(fine.direction(l));
      expected += std::sqrt(1 - static_cast<double>(wi.x()) * wi.x()) *
                  static_cast<double>(bcsdf.evaluate(wi, to_fiber(wo))[1]) / fine.count();
    }
    double sum = 0;
    for (std::size_t l = 0; l < table.light_count(); ++l) {
      sum += static_cast<double>(
                 float_from_half(table.single[(view * table.light_count() + l) * 3 + 1])) /
             table.light_count();
    }
    worst = std::max(worst, std::abs(sum / expected - 1));
  }
  EXPECT_LT(worst, 0.05);
}

TEST(FarBake, SameBytesForAnyNumberOfThreads) {
  const OpenFabric fabric(crossed_layers(test_cotton()), false);
  const auto bytes = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    const FarTable table = fabric.bake(coarse(64));
    std::vector<std::uint16_t> values;
    for (const Half value : table.single) values.push_back(value.bits);
    return std::pair(values, table.multiple);
  };
  EXPECT_EQ(bytes(1), bytes(2));
}

}  // namespace
}  // namespace heddle
