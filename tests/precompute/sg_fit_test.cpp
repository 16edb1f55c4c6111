#include "precompute/sg_fit.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <set>

#include "fibers/math/random.h"
#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

// Every segment has its own round hole of 35 degrees about a random axis; the last sees nothing.
VisibilityMaps holes(std::size_t count, bool both_sides) {
  VisibilityMaps maps;
  maps.both_sides = both_sides;
  maps.words.assign(count * maps.words_per_map(), 0);
  maps.sees_nothing.assign(count, 0);
  maps.sees_nothing.back() = 1;
  const LatLongGrid grid(VisibilityMaps::kResolution);
  for (std::size_t s = 0; s + 1 < count; ++s) {
    RandomStream random(3, RandomStage::kTest, s, 0);
    const double z =
        both_sides ? 1 - 2 * random.uniform_double() : 0.3 + 0.7 * random.uniform_double();
    const double azimuth = 2 * kPi * random.uniform_double();
    const Vec3d axis(std::sqrt(1 - z * z) * std::cos(azimuth),
                     std::sqrt(1 - z * z) * std::sin(azimuth), z);
    for (int cell = 0;
         cell < (both_sides ? VisibilityMaps::kResolution * VisibilityMaps::kResolution
                            : VisibilityMaps::kResolution * VisibilityMaps::kResolution / 2);
         ++cell) {
      if (axis.dot(grid.centre(cell / VisibilityMaps::kResolution,
                               cell % VisibilityMaps::kResolution)) < std::cos(radians(35)))
        continue;
      maps.words[s * maps.words_per_map() + static_cast<std::size_t>(cell / 64)] |= std::uint64_t{1}
                                                                                    << (cell % 64);
    }
  }
  return maps;
}

// Under soft light, the stored Gaussians (halves, turned axes) give what the map gives. The fit's
// own error for these maps is 7 % on the hemisphere and 18 % on the sphere, whose axes lie farther
// apart.
TEST(SgFit, StoredGaussiansStandForTheMap) {
  const double light = 20;
  const LatLongGrid grid(VisibilityMaps::kResolution);
  for (const bool both_sides : {false, true}) {
    const VisibilityMaps maps = holes(12, both_sides);
    VisibilitySettings settings;
    settings.both_sides = both_sides;
    if (both_sides) settings.sgs.axes = FibonacciSet::kSphere;
    settings.sgs.sharpness = default_sg_sharpness(settings.sgs.axes);
    const SgVisibility sgs = fit_sgs(maps, settings);
    ASSERT_EQ(sgs.lobes(), 48);
    double error = 0;
    double total = 0;
    for (std::size_t s = 0; s + 1 < maps.count(); ++s) {
      const Eigen::AngleAxisd turn(float_from_half(sgs.rotation[s]), Vec3d::UnitZ());
      std::vector<Vec3d> axes;
      Eigen::VectorXd weights(48);
      for (std::size_t q = 0; q < 48; ++q) {
        axes.push_back(turn * sgs.axes[q].cast<double>());
        weights[static_cast<Eigen::Index>(q)] = float_from_half(sgs.weights[s * 48 + q]);
      }
      const SphericalMap map = maps.map(s);
      for (const Vec3d& direction : fibonacci_axes(FibonacciSet::kSphere, 30)) {
        if (!both_sides && direction.z() < 0) continue;
        double truth = 0;
        for (int cell = 0; cell < VisibilityMaps::kResolution * VisibilityMaps::kResolution;
             ++cell) {
          if (!map.open(cell / VisibilityMaps::kResolution, cell % VisibilityMaps::kResolution))
            continue;
          truth += grid.solid_angle(cell / VisibilityMaps::kResolution) *
                   sg_value({direction, light}, grid.centre(cell / VisibilityMaps::kResolution,
                                                            cell % VisibilityMaps::kResolution)) /
                   sg_mass(light);
        }
        error += std::abs(sg_sum_integral(axes, weights, sgs.sharpness, direction, light) - truth);
        total += truth;
      }
    }
    EXPECT_LT(error, (both_sides ? 0.25 : 0.12) * total) << "both sides: " << both_sides;
  }
}

TEST(SgFit, EverySegmentHasItsOwnTurnAndHiddenOnesNoWeight) {
  const VisibilityMaps maps = holes(40, false);
  const SgVisibility sgs = fit_sgs(maps, VisibilitySettings{});
  std::set<std::uint16_t> turns;
  for (const Half rotation : sgs.rotation) turns.insert(rotation.bits);
  EXPECT_GT(turns.size(), 25U);
  EXPECT_EQ(sgs.sees_nothing.back(), 1);
  for (std::size_t q = 0; q < 48; ++q) EXPECT_EQ(float_from_half(sgs.weights[39 * 48 + q]), 0);
}

TEST(SgFitEndToEnd, SameForAnyNumberOfThreads) {
  const VisibilityMaps maps = holes(40, false);
  SgVisibility one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = fit_sgs(maps, VisibilitySettings{});
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
  const SgVisibility two = fit_sgs(maps, VisibilitySettings{});
  EXPECT_EQ(std::memcmp(one.weights.data(), two.weights.data(), one.weights.size() * sizeof(Half)),
            0);
  EXPECT_EQ(
      std::memcmp(one.rotation.data(), two.rotation.data(), one.rotation.size() * sizeof(Half)), 0);
}

}  // namespace
}  // namespace heddle
