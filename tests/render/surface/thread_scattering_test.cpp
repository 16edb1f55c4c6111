#include "render/surface/thread_scattering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "fibers/math/quadrature.h"
#include "fibers/math/random.h"

namespace heddle {
namespace {

ThreadParameters parameters(double ior, const Rgbd& albedo, double kd, double gamma_s_deg,
                            double gamma_v_deg) {
  return {ior, albedo, kd, radians(gamma_s_deg), radians(gamma_v_deg)};
}

// The different threads of table II.
const ThreadParameters kThreads[] = {
    parameters(1.46, .3 * Rgbd(.2, .8, 1), .3, 12, 24),      // linen
    parameters(1.345, .12 * Rgbd(1, .95, .05), .2, 5, 10),   // silk crepe de chine, flat
    parameters(1.345, .16 * Rgbd(1, .95, .05), .3, 18, 32),  // silk crepe de chine, twisted
    parameters(1.539, .035 * Rgbd(1, .37, .3), .1, 2.5, 5),  // polyester charmeuse, flat
    parameters(1.539, .2 * Rgbd(1, .37, .3), .7, 30, 60),    // polyester charmeuse, twisted
    parameters(1.345, .2 * Rgbd(.1, 1, .4), .1, 4, 8),       // shot silk, direction 1
    parameters(1.345, .6 * Rgbd(1, 0, .1), .1, 5, 10),       // shot silk, direction 2
    parameters(1.46, .3 * Rgbd(.05, .02, 0), .1, 6, 12),     // velvet
};

double exact_reflectance(double ior, double angle) {
  const double inside = std::asin(std::sin(angle) / ior);
  const double s =
      (std::cos(angle) - ior * std::cos(inside)) / (std::cos(angle) + ior * std::cos(inside));
  const double p =
      (ior * std::cos(angle) - std::cos(inside)) / (ior * std::cos(angle) + std::cos(inside));
  return 0.5 * (s * s + p * p);
}

// Equations 2 to 4 as printed, from angles.
Rgbd printed(const ThreadParameters& thread, const ThreadConventions& conventions, double theta_i,
             double phi_i, double theta_r, double phi_r) {
  const double phi_d = std::remainder(phi_i - phi_r, 2 * kPi);
  const double theta_h = 0.5 * (theta_i + theta_r);
  const double theta_d = 0.5 * (theta_i - theta_r);
  const auto g = [&](double width) {
    return conventions.width == ThreadConventions::Width::kIwasaki
               ? std::exp(-theta_h * theta_h / (width * width)) / (std::sqrt(kPi) * width)
               : std::exp(-0.5 * theta_h * theta_h / (width * width)) /
                     (std::sqrt(2 * kPi) * width);
  };
  const double reflected =
      exact_reflectance(thread.ior, std::acos(std::cos(theta_d) * std::cos(0.5 * phi_d)));
  double entering = (1 - reflected) * (1 - reflected);
  if (conventions.fresnel == ThreadConventions::Fresnel::kNormal) {
    entering =
        (1 - exact_reflectance(thread.ior,
                               std::acos(std::max(0.0, std::cos(theta_i) * std::cos(phi_i))))) *
        (1 - exact_reflectance(thread.ior,
                               std::acos(std::max(0.0, std::cos(theta_r) * std::cos(phi_r)))));
  }
  const double surface = reflected * std::cos(0.5 * phi_d) * g(thread.gamma_s);
  const Rgbd volume = entering * ((1 - thread.kd) * g(thread.gamma_v) + thread.kd) /
                      (std::cos(theta_i) + std::cos(theta_r)) * thread.albedo;
  return (surface + volume) / std::pow(std::cos(theta_d), 2);
}

struct Angles {
  double theta_i, phi_i, theta_r, phi_r;
};

Angles random_angles(RandomStream& random, double most_deg) {
  const auto angle = [&](double limit) { return limit * (2 * random.uniform_double() - 1); };
  return {angle(radians(most_deg)), angle(kPi), angle(radians(most_deg)), angle(kPi)};
}

TEST(ThreadScatteringAgreement, IsThePrintedEquations) {
  using Conventions = ThreadConventions;
  RandomStream random(1, RandomStage::kTest, 0, 0);
  double worst = 0;
  for (const auto width : {Conventions::Width::kStandardDeviation, Conventions::Width::kIwasaki}) {
    for (const auto fresnel : {Conventions::Fresnel::kHalf, Conventions::Fresnel::kNormal}) {
      const Conventions conventions{width, fresnel, radians(20)};
      for (const ThreadParameters& thread : kThreads) {
        const ThreadScattering scattering(thread, conventions);
        for (int k = 0; k < 500; ++k) {
          const Angles a = random_angles(random, 89);
          const Rgbd expected =
              printed(thread, conventions, a.theta_i, a.phi_i, a.theta_r, a.phi_r);
          const Rgbd value = scattering.value(a.theta_i, a.phi_i, a.theta_r, a.phi_r);
          // Far from the cone all is 0 but for rounding.
          worst =
              std::max(worst, (value - expected).abs().maxCoeff() / (expected.maxCoeff() + 1e-6));
        }
      }
    }
  }
  std::printf("  largest relative difference %.2g\n", worst);
  // Fresnel terms near 90 degrees lose digits in the arccosine of the printed form.
  EXPECT_LT(worst, 1e-9);
}

TEST(ThreadScatteringLaw, IsReciprocalToTheLastBit) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  for (const auto fresnel :
       {ThreadConventions::Fresnel::kHalf, ThreadConventions::Fresnel::kNormal}) {
    ThreadConventions conventions;
    conventions.fresnel = fresnel;
    for (const ThreadParameters& thread : kThreads) {
      const ThreadScattering scattering(thread, conventions);
      for (int k = 0; k < 1000; ++k) {
        const Angles a = random_angles(random, 90);
        const Rgbd forth = scattering.value(a.theta_i, a.phi_i, a.theta_r, a.phi_r);
        const Rgbd back = scattering.value(a.theta_r, a.phi_r, a.theta_i, a.phi_i);
        ASSERT_TRUE((forth == back).all());
      }
    }
  }
}

TEST(ThreadScattering, AngleOfHalfTangent) {
  double worst = 0;
  for (int k = 1; k <= 1000; ++k) {
    const double t = k / 1000.0;
    worst = std::max(worst,
                     std::abs(angle_of_half_tangent<1>(Lanes<1>(t))[0] / (2 * std::atan(t)) - 1));
  }
  EXPECT_LT(worst, 5e-14);
  EXPECT_EQ(angle_of_half_tangent<1>(Lanes<1>(0.0))[0], 0);
}

// Integral over all directions of f_s cos(theta_r): the energy of one scattering in the
// normalisation of Marschner et al. 2003. Returns {all, surface part}.
std::pair<double, double> energy(const ThreadParameters& thread, double theta_i) {
  ThreadParameters black = thread;
  black.albedo = Rgbd::Zero();
  const ThreadScattering all(thread, {});
  const ThreadScattering surface(black, {});
  const auto integral = [&](const ThreadScattering& scattering) {
    std::vector<double> breaks;
    append_geometric_breaks(-theta_i, thread.gamma_s, kPi, breaks);
    append_geometric_breaks(-kPi / 2, 1e-3, 0.5, breaks);
    const QuadratureRule thetas = gauss_legendre_panels(12, -kPi / 2, kPi / 2, breaks);
    const QuadratureRule phis = gauss_legendre_panels(12, -kPi, kPi, {-2, -1, 0, 1, 2});
    return integrate(thetas, [&](double theta_r) {
      const double cosine = std::cos(theta_r);
      return cosine * cosine * integrate(phis, [&](double phi) {
               return scattering.value(theta_i, 0, theta_r, phi).maxCoeff();
             });
    });
  };
  return {integral(all), integral(surface)};
}

// Not conserved: measured independently as .75 to 3.2 at 0 degrees and 5.0 to 11.1 at 85, the
// surface part alone .30 to .59 and 2.5 to 4.7. Half a unit of the last digit given.
TEST(ThreadScatteringStability, CreatesEnergy) {
  struct Expected {
    double theta_deg, least, most, least_surface, most_surface, digit;
  };
  for (const Expected& expected :
       {Expected{0, .75, 3.2, .30, .59, .05}, Expected{85, 5.0, 11.1, 2.5, 4.7, .05}}) {
    double least = 1e9, most = 0, least_surface = 1e9, most_surface = 0;
    for (const ThreadParameters& thread : kThreads) {
      // velvet, nearly black: not among those measured
      if (&thread == &kThreads[std::size(kThreads) - 1]) continue;
      const auto [all, surface] = energy(thread, radians(expected.theta_deg));
      std::printf("  theta_i %2.0f: %7.3f, surface part %7.3f\n", expected.theta_deg, all, surface);
      least = std::min(least, all), most = std::max(most, all);
      least_surface = std::min(least_surface, surface),
      most_surface = std::max(most_surface, surface);
    }
    EXPECT_NEAR(least, expected.least, expected.digit);
    EXPECT_NEAR(most, expected.most, expected.digit);
    EXPECT_NEAR(least_surface, expected.least_surface, expected.digit);
    EXPECT_NEAR(most_surface, expected.most_surface, expected.digit);
  }
}

// 1 / cos^2 theta_d: silk's flat thread in its mirror direction.
TEST(ThreadScatteringStability, IsNotBounded) {
  const ThreadScattering silk(kThreads[1], {});
  const auto mirror = [&](double degrees) {
    return silk.value(radians(degrees), 0, -radians(degrees), 0).maxCoeff();
  };
  EXPECT_NEAR(mirror(80), 63, .5);
  EXPECT_NEAR(mirror(85), 384, .5);
  EXPECT_NEAR(mirror(89), 1.4e4, 500);
  EXPECT_NEAR(mirror(89.9), 1.5e6, 5e4);
}

// phi_d beyond 180 degrees is the same as the angle the other way round: never a negative cosine.
TEST(ThreadScatteringLaw, AzimuthsWrap) {
  const ThreadScattering thread(kThreads[0], {});
  const Rgbd expected = thread.value(.3, radians(170), -.2, radians(-170));
  const Rgbd same = thread.value(.3, radians(-10), -.2, radians(10));
  EXPECT_LT((expected / same - 1).abs().maxCoeff(), 1e-12);
  EXPECT_GT(thread.value(.3, kPi, -.3, 0).minCoeff(), 0);
}

}  // namespace
}  // namespace heddle
