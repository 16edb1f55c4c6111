#include "fibers/math/sg_sum_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

SphericalMap upper_half(int resolution) {
  SphericalMap map(resolution);
  for (int row = 0; row < resolution / 2; ++row) {
    for (int column = 0; column < resolution; ++column) map.set(row, column, true);
  }
  return map;
}

SphericalMap whole(int resolution) {
  SphericalMap map(resolution);
  for (int row = 0; row < resolution; ++row) {
    for (int column = 0; column < resolution; ++column) map.set(row, column, true);
  }
  return map;
}

TEST(SgSumFitLaw, VoronoiWeightsKeepTheOpenSolidAngle) {
  for (FibonacciSet set : {FibonacciSet::kPrinted, FibonacciSet::kHemisphere}) {
    const SgSumFit fit(64, {set, 48, 128, SgWeights::kVoronoi});
    EXPECT_NEAR(fit.weights(upper_half(64)).sum(), 2 * kPi, 1e-12);
    EXPECT_NEAR(fit.weights(whole(64)).sum(), 2 * kPi, 1e-12)
        << "below the horizon counts as closed";
  }
  const SgSumFit fit(64, {FibonacciSet::kSphere, 48, 128, SgWeights::kVoronoi});
  EXPECT_NEAR(fit.weights(whole(64)).sum(), 4 * kPi, 1e-12);
  EXPECT_NEAR(fit.weights(upper_half(64), 5).sum(), 2 * kPi, 1e-12);
}

TEST(SgSumFit, VoronoiWeightOfOneCellGoesToItsNearestAxis) {
  const SgSumFit fit(32, {FibonacciSet::kSphere, 20, 64, SgWeights::kVoronoi});
  const LatLongGrid grid(32);
  const int turn = 3;
  const Eigen::AngleAxisd rotation(turn * grid.column_step(), Vec3d::UnitZ());
  for (int row = 0; row < 32; row += 5) {
    SphericalMap map(32);
    map.set(row, 30, true);
    const Eigen::VectorXd weights = fit.weights(map, turn);
    Eigen::Index largest = 0;
    EXPECT_DOUBLE_EQ(weights.maxCoeff(&largest), grid.solid_angle(row));
    EXPECT_DOUBLE_EQ(weights.sum(), grid.solid_angle(row));
    for (const Vec3d& axis : fit.axes()) {
      EXPECT_LE(
          (rotation * axis).dot(grid.centre(row, 30)),
          (rotation * fit.axes()[static_cast<std::size_t>(largest)]).dot(grid.centre(row, 30)) +
              1e-12);
    }
  }
}

// Least squares against the blurred map, by brute force: no weight can be moved to lower the
// residual.
TEST(SgSumFitAgreement, NnlsResidualIsStationary) {
  const int n = 48;
  const double sharpness = 48;
  const LatLongGrid grid(n);
  SphericalMap map(n);
  for (int row = 0; row < n / 2; ++row) {
    for (int column = 0; column < n; ++column)
      map.set(row, column, column < 15 || (row < 6 && column > 30));
  }
  const SgSumFit fit(n, {FibonacciSet::kHemisphere, 48, sharpness, SgWeights::kNnls});
  const Eigen::VectorXd weights = fit.weights(map);
  // Blurred map and sum at every cell centre; open cells are cut into 3 x 6 parts.
  std::vector<Vec3d> centres;
  std::vector<double> areas;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      centres.push_back(grid.centre(row, column));
      areas.push_back(grid.solid_angle(row));
    }
  }
  std::vector<Vec3d> parts;
  std::vector<double> part_areas;
  for (int row = 0; row < 3 * n; ++row) {
    for (int column = 0; column < 6 * n; ++column) {
      if (!map.open(row / 3, column / 6)) continue;
      const double polar = (row + 0.5) * grid.row_step() / 3;
      const double azimuth = (column + 0.5) * grid.column_step() / 6;
      parts.emplace_back(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                         std::cos(polar));
      part_areas.push_back(std::sin(polar) * grid.row_step() / 3 * grid.column_step() / 6);
    }
  }
  std::vector<double> residual(centres.size());
  double blurred_square = 0;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    double blurred = 0;
    for (std::size_t j = 0; j < parts.size(); ++j) {
      blurred += part_areas[j] * sg_value({parts[j], SgSumFit::kBlur}, centres[i]) /
                 sg_mass(SgSumFit::kBlur);
    }
    residual[i] = sg_sum_value(fit.axes(), weights, sharpness, centres[i]) - blurred;
    blurred_square += areas[i] * blurred * blurred;
  }
  for (std::size_t q = 0; q < fit.axes().size(); ++q) {
    double gradient = 0;
    double square = 0;
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const double lobe = sg_value({fit.axes()[q], sharpness}, centres[i]) / sg_mass(sharpness);
      gradient += areas[i] * lobe * residual[i];
      square += areas[i] * lobe * lobe;
    }
    // As a cosine between the residual's slope and the data: 2e-3 allows for the error of the sums.
    const double relative = gradient / std::sqrt(square * blurred_square);
    if (weights[static_cast<Eigen::Index>(q)] > 0) {
      EXPECT_NEAR(relative, 0, 2e-3) << q;
    } else {
      EXPECT_GT(relative, -2e-3) << q;
    }
  }
}

TEST(SgSumFit, TurnedAxesFitTheTurnedMapAlike) {
  const int n = 32;
  SphericalMap map(n);
  SphericalMap turned(n);
  for (int row = 0; row < n / 2; ++row) {
    for (int column = 0; column < 9; ++column) {
      map.set(row, column, true);
      turned.set(row, (column + 27) % n, true);
    }
  }
  for (SgWeights method : {SgWeights::kVoronoi, SgWeights::kNnls}) {
    const SgSumFit fit(n, {FibonacciSet::kHemisphere, 48, 48, method});
    EXPECT_LT((fit.weights(map) - fit.weights(turned, 27)).cwiseAbs().maxCoeff(), 1e-6);
  }
}

// A map of few large cells is integrated as exactly as its refinement.
TEST(SgSumFitAgreement, CoarseMapIsItsRefinement) {
  const SgSumFit coarse(4, {FibonacciSet::kSphere, 48, 28, SgWeights::kNnls});
  const SgSumFit fine(64, {FibonacciSet::kSphere, 48, 28, SgWeights::kNnls});
  SphericalMap coarse_map(4);
  SphericalMap fine_map(64);
  for (const auto& [row, column] : {std::pair(0, 1), std::pair(2, 3), std::pair(3, 3)}) {
    coarse_map.set(row, column, true);
    for (int r = 0; r < 16; ++r) {
      for (int c = 0; c < 16; ++c) fine_map.set(16 * row + r, 16 * column + c, true);
    }
  }
  // Midpoint sums over parts of 0.025 rad of a Gaussian 0.09 rad wide: error (0.025 / 0.09)^2 / 24
  // = 0.3 %.
  const Eigen::VectorXd weights = fine.weights(fine_map);
  EXPECT_LT((coarse.weights(coarse_map) - weights).cwiseAbs().maxCoeff(),
            0.01 * weights.maxCoeff());
}

TEST(SgSum, IntegralIsTheValueBlurred) {
  const std::vector<Vec3d> axes = {Vec3d(0, 0, 1), Vec3d(0.6, 0, 0.8)};
  const Eigen::VectorXd weights = Eigen::Vector2d(0.7, 0.2);
  const Vec3d direction = Vec3d(0.3, 0.4, 0.9).normalized();
  const int n = 256;
  const LatLongGrid grid(n);
  double sum = 0;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const Vec3d w = grid.centre(row, column);
      sum += grid.solid_angle(row) * sg_sum_value(axes, weights, 40, w) *
             sg_value({direction, 25}, w) / sg_mass(25.0);
    }
  }
  // Midpoint sums over cells of 0.025 rad of Gaussians of width 0.16 rad: error about (0.025 /
  // 0.16)^2 / 24 = 1e-3.
  EXPECT_NEAR(sg_sum_integral(axes, weights, 40, direction, 25), sum, 1e-3 * sum);
}

}  // namespace
}  // namespace heddle
