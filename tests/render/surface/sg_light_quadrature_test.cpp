#include "render/surface/sg_light_quadrature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

/// Midpoint rule over the upper hemisphere.
double brute_force(const Vec3d& axis, double sharpness,
                   const std::function<double(const Vec3d&)>& f, int rows) {
  double sum = 0.0;
  for (int i = 0; i < rows; ++i) {
    const double theta = 0.5 * kPi * (i + 0.5) / rows;
    for (int j = 0; j < 4 * rows; ++j) {
      const double phi = 0.5 * kPi * (j + 0.5) / rows;
      const Vec3d w(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                    std::cos(theta));
      sum += f(w) * sg_value({axis, sharpness}, w) * std::sin(theta);
    }
  }
  return sum * 0.5 * kPi / rows * 0.5 * kPi / rows / sg_mass(sharpness);
}

TEST(SgLightQuadrature, ConstantsGiveTheLightAboveTheHorizon) {
  for (const double sharpness : {0.0, 1e-5, 1.0, 40.0, 1e4, 1e7}) {
    const auto one = [](const Vec3d&) { return Rgbd(1, 2, 3); };
    // Share of the light above the horizon: (1 - e^-s) / (1 - e^-2s) about +z, one half about x,
    // where the horizon is a step.
    const double up =
        sharpness == 0.0 ? 0.5 : std::expm1(-sharpness) / std::expm1(-2.0 * sharpness);
    EXPECT_NEAR(integrate_sg_light(Vec3d::UnitZ(), sharpness, one)[1], 2.0 * up, 4e-3) << sharpness;
    const double side = integrate_sg_light(Vec3d::UnitX(), sharpness, one)[1];
    EXPECT_NEAR(side, 1.0, 4e-3);
  }
}

TEST(SgLightQuadratureAgreement, ConvergesAgainstBruteForceSmoothAndStep) {
  const auto smooth = [](const Vec3d& w) { return w.z() * (1.0 + w.x() * w.y()); };
  const auto step = [](const Vec3d& w) {
    return std::hypot(w.x() - 0.2, 3.0 * w.y()) < 0.6 ? w.z() : 0.0;
  };
  for (const double sharpness : {0.0, 3.0, 60.0}) {
    const Vec3d axis = Vec3d(0.3, -0.1, 0.8).normalized();
    for (const bool is_step : {false, true}) {
      const auto f = [&](const Vec3d& w) { return is_step ? step(w) : smooth(w); };
      const double exact = brute_force(axis, sharpness, f, 1500);
      std::printf("  sharpness %g, %s:", sharpness, is_step ? "step" : "smooth");
      for (const int points : {1597, 10946, 75025, 514229}) {
        const double value = integrate_sg_light(
            axis, sharpness, [&](const Vec3d& w) { return Rgbd::Constant(f(w)); },
            {.tolerance = 0.0, .max_points = points})[0];
        const double error = std::abs(value / exact - 1.0);
        std::printf(" %.1e", error);
        // The step fills a tenth of the hemisphere and more, so relative errors are up to ten times
        // the rates; 2e-4 is the brute force's own error on the step.
        EXPECT_LT(error, is_step ? 10.0 * std::pow(points, -0.75) + 2e-4 : 10.0 / points + 1e-6);
      }
      std::printf("\n");
    }
  }
}

TEST(SgLightQuadrature, StopsAtItsTolerance) {
  const Vec3d axis = Vec3d(0.3, -0.1, 0.8).normalized();
  int evaluations = 0;
  const auto f = [&](const Vec3d& w) {
    ++evaluations;
    return Rgbd::Constant(w.z());
  };
  integrate_sg_light(axis, 3.0, f, {.tolerance = 0.1});
  EXPECT_LE(evaluations, 610 + 1597);
  evaluations = 0;
  integrate_sg_light(axis, 3.0, f, {.tolerance = 0.0, .max_points = 30000});
  EXPECT_GT(evaluations, 28657 / 2);
  EXPECT_LE(evaluations, 610 + 1597 + 4181 + 10946 + 28657);
}

}  // namespace
}  // namespace heddle
