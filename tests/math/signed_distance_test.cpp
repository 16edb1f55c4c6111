#include "fibers/math/signed_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"

namespace heddle {
namespace {

SphericalMap map_of(int resolution, const std::function<bool(int, int)>& open) {
  SphericalMap map(resolution);
  for (int row = 0; row < resolution; ++row) {
    for (int column = 0; column < resolution; ++column) map.set(row, column, open(row, column));
  }
  return map;
}

// Union of round caps: edges of all slopes, poles and wrap included.
SphericalMap caps(int resolution, int count, double radius, std::uint64_t seed) {
  std::vector<Vec3d> axes;
  for (int i = 0; i < count; ++i) {
    RandomStream random(seed, RandomStage::kTest, 0, static_cast<std::uint64_t>(i));
    axes.push_back(sample_sphere(random).cast<double>());
  }
  const LatLongGrid grid(resolution);
  return map_of(resolution, [&](int row, int column) {
    return std::any_of(axes.begin(), axes.end(), [&](const Vec3d& axis) {
      return axis.dot(grid.centre(row, column)) > std::cos(radius);
    });
  });
}

SphericalMap noise(int resolution, double share, std::uint64_t seed) {
  RandomStream random(seed, RandomStage::kTest, 1, 0);
  return map_of(resolution, [&](int, int) { return random.uniform_double() < share; });
}

Vec3d random_direction(std::uint64_t i) {
  RandomStream random(7, RandomStage::kTest, 2, i);
  return sample_sphere(random).cast<double>().normalized();
}

// Largest difference between the transform and the exact distance over every `stride`th cell, as a
// share of the bound.
double transform_error_in_bounds(const SphericalMap& map, int stride) {
  const int n = map.resolution();
  std::vector<float> distance(map.grid().cell_count());
  SignedDistanceTransform transform(n);
  transform(map, distance.data());
  const ExactSignedDistance exact(map);
  double worst = 0;
  for (int cell = 0; cell < n * n; cell += stride) {
    const double truth = exact(map.grid().centre(cell / n, cell % n));
    const double bound = std::abs(truth) <= 3 ? SignedDistanceTransform::kMaxError
                                              : SignedDistanceTransform::kMaxErrorNearAntipode;
    worst = std::max(
        worst,
        std::abs(truth - static_cast<double>(distance[static_cast<std::size_t>(cell)])) / bound);
  }
  return worst;
}

TEST(ExactSignedDistance, HalfSpaceAboveTheEquator) {
  for (int n : {8, 128}) {
    const ExactSignedDistance exact(map_of(n, [&](int row, int) { return row < n / 2; }));
    for (std::uint64_t i = 0; i < 200; ++i) {
      const Vec3d w = random_direction(i);
      EXPECT_NEAR(exact(w), std::asin(w.z()), 1e-12);
    }
    EXPECT_NEAR(exact({0, 0, 1}), kPi / 2, 1e-12);
    EXPECT_NEAR(exact({0, 0, -1}), -kPi / 2, 1e-12);
  }
}

// The edge is a great circle through both poles: every distance ends on a meridian side or at a
// pole.
TEST(ExactSignedDistance, HalfSpaceBesideTheMeridian) {
  for (int n : {8, 128}) {
    const ExactSignedDistance exact(map_of(n, [&](int, int column) { return column < n / 2; }));
    for (std::uint64_t i = 0; i < 200; ++i) {
      const Vec3d w = random_direction(i);
      EXPECT_NEAR(exact(w), std::asin(w.y()), 1e-12);
    }
    EXPECT_NEAR(exact({1e-6, 1e-6, 1}), 1e-6, 1e-15);
  }
}

TEST(ExactSignedDistance, PolarCap) {
  const int n = 64;
  const ExactSignedDistance exact(map_of(n, [&](int row, int) { return row < 5; }));
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Vec3d w = random_direction(i);
    EXPECT_NEAR(exact(w), 5 * kPi / n - std::acos(w.z()), 1e-12);
  }
}

TEST(ExactSignedDistance, NoEdgeIsPlusOrMinusPi) {
  for (bool open : {false, true}) {
    const SphericalMap map = map_of(16, [&](int, int) { return open; });
    EXPECT_EQ(ExactSignedDistance(map)({0, 0, 1}), open ? kPi : -kPi);
    std::vector<float> distance(map.grid().cell_count());
    SignedDistanceTransform transform(16);
    transform(map, distance.data());
    for (float d : distance) EXPECT_EQ(d, open ? kPif : -kPif);
  }
}

// Against points spread over every opposite cell: no point may be nearer, and one must be within
// half a point spacing.
TEST(ExactSignedDistanceAgreement, NearestPointOfOppositeCells) {
  const int n = 12;
  const int points = 40;
  for (const SphericalMap& map :
       {noise(n, 0.05, 1), noise(n, 0.5, 2), noise(n, 0.95, 3), caps(n, 3, 0.7, 4)}) {
    const ExactSignedDistance exact(map);
    for (std::uint64_t i = 0; i < 30; ++i) {
      const Vec3d w = random_direction(i);
      const LatLongGrid::Cell own = map.grid().cell_of(w);
      const bool open = map.open(own.row, own.column);
      double nearest = 2;
      for (int row = 0; row < n; ++row) {
        for (int column = 0; column < n; ++column) {
          if (map.open(row, column) == open) continue;
          for (int a = 0; a <= points; ++a) {
            for (int b = 0; b <= points; ++b) {
              const double polar = (row + static_cast<double>(a) / points) * kPi / n;
              const double azimuth = (column + static_cast<double>(b) / points) * 2 * kPi / n;
              const Vec3d p(std::sin(polar) * std::cos(azimuth),
                            std::sin(polar) * std::sin(azimuth), std::cos(polar));
              nearest = std::min(nearest, (w - p).norm());
            }
          }
        }
      }
      const double sampled = 2 * std::asin(nearest / 2);
      const double spacing = 2 * kPi / n / points;
      const double d = std::abs(exact(w));
      EXPECT_EQ(exact(w) > 0, open);
      EXPECT_LE(d, sampled + 1e-9);
      EXPECT_GE(d, sampled - 0.5 * spacing);
    }
  }
}

TEST(SignedDistanceTransformAgreement, ExactAtEveryCellOfSmallMaps) {
  for (int n : {1, 2, 3, 4, 5, 6, 7, 16, 33}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      EXPECT_LE(
          transform_error_in_bounds(noise(n, 0.05 * static_cast<double>(seed - 1) + 0.02, seed), 1),
          1)
          << "n " << n << " seed " << seed;
    }
  }
}

TEST(SignedDistanceTransformAgreement, ExactOnMapsOfFullSize) {
  const int n = 128;
  std::vector<SphericalMap> maps = {caps(n, 1, 0.3, 1), caps(n, 5, 0.5, 2), caps(n, 40, 0.15, 3),
                                    noise(n, 0.001, 4)};
  // One cell at a pole, one across the wrap, a slit along a meridian through both poles.
  maps.push_back(map_of(n, [](int row, int column) { return row == 0 && column == 17; }));
  maps.push_back(
      map_of(n, [](int row, int column) { return row == 127 || (row == 60 && column == 0); }));
  maps.push_back(map_of(n, [](int row, int column) { return row == 60 && column == 127; }));
  maps.push_back(map_of(n, [](int, int column) { return column == 5 || column == 69; }));
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const double error = transform_error_in_bounds(maps[i], 5);
    EXPECT_LE(error, 1) << "map " << i;
    RecordProperty("error_of_map_" + std::to_string(i), std::to_string(error));
  }
}

}  // namespace
}  // namespace heddle
