// Curves of one fiber: Gamma, Bessel functions, the end of the fiber's axis.

#include <algorithm>
#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_gaussian.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/scattering/sg_scatter.h"
#include "pipeline/warnings.h"
#include "tests/stability/stability_curve.h"

namespace heddle::stability {
namespace {

FiberScattering gray_fiber(double beta_deg, double gamma_deg) {
  return {Rgbd::Constant(0.3), Rgbd::Constant(0.7), radians(beta_deg), radians(beta_deg),
          radians(gamma_deg)};
}

/// Gamma of the R lobe from the definition: a product rule over the sphere, fine around the light
/// and around the cone.
double brute_force_gamma(const FiberScattering& fiber, const SphericalGaussian& light,
                         const Vec3d& wo) {
  const FiberDirection axis = fiber_direction(light.axis);
  const double theta_o = fiber_direction(wo).theta;
  const double width = 1 / std::sqrt(light.sharpness + 1);
  std::vector<double> thetas;
  append_geometric_breaks(-theta_o, 0.5 * fiber.beta_r, kPi, thetas);
  append_geometric_breaks(axis.theta, 0.5 * width, kPi, thetas);
  for (const double end : {-kPi / 2, kPi / 2})
    append_geometric_breaks(end, 0.25 * fiber.beta_r, kPi, thetas);
  std::vector<double> phis;
  append_geometric_breaks(axis.phi, 0.5 * width / std::max(std::cos(axis.theta), 0.1), kPi, phis);
  const QuadratureRule phi_rule = gauss_legendre_panels(8, axis.phi - kPi, axis.phi + kPi, phis);
  return integrate(gauss_legendre_panels(8, -kPi / 2, kPi / 2, thetas), [&](double theta) {
    const double cosine = std::cos(theta);
    if (std::abs(theta + theta_o) > 9 * fiber.beta_r) return 0.0;
    // R does not depend on the azimuth.
    const double scattered = evaluate_bcsdf(fiber, vector_from({theta, axis.phi}), wo, Lobe::kR)[0];
    return scattered * cosine * cosine * integrate(phi_rule, [&](double phi) {
             return sg_value(light, vector_from({theta, phi}));
           });
  });
}

}  // namespace

Curve gamma_curve(Effort effort) {
  Curve curve{.title = "Gamma at grazing views (R 10 deg, theta_o 75 to 85 deg)",
              .driver = "sharpness of the light",
              .measure = "mean |error| / mean value",
              .is_log = true,
              .drivers = effort == Effort::kFull ? std::vector<double>{1, 3, 10, 25, 50, 100, 200,
                                                                       400, 1000, 3000, 1e4, 1e5}
                                                 : std::vector<double>{1, 25, 100, 400, 1e4},
              .series = {{"as printed", {}}, {"shipped", {}}},
              .warning_from = kPrintedGammaSharpness,
              .warns_above = false};
  const FiberScattering fiber = gray_fiber(10, 12);
  const int lights = effort == Effort::kFull ? 60 : 25;
  for (const double sharpness : curve.drivers) {
    double total = 0;
    double printed = 0;
    double shipped = 0;
    for (int k = 0; k < lights; ++k) {
      RandomStream random(2, RandomStage::kTest, static_cast<std::uint64_t>(sharpness),
                          static_cast<std::uint64_t>(k));
      const double theta_o = radians(75 + 10 * random.uniform_double());
      const double spread = std::hypot(fiber.beta_r, 1 / std::sqrt(sharpness));
      const double theta = sample_cut_gaussian(static_cast<float>(-theta_o),
                                               static_cast<float>(std::min(spread, 1.5)), random);
      const SphericalGaussian light{vector_from({theta, kPi * (2 * random.uniform_double() - 1)}),
                                    sharpness};
      const Vec3d wo = vector_from({theta_o, 0});
      const double exact = brute_force_gamma(fiber, light, wo);
      total += exact;
      printed += std::abs(sg_scatter(fiber, light, wo, SgMethod::kPrinted, Lobe::kR)[0] - exact);
      shipped += std::abs(sg_scatter(fiber, light, wo, SgMethod::kDefault, Lobe::kR)[0] - exact);
    }
    curve.series[0].values.push_back(printed / total);
    curve.series[1].values.push_back(shipped / total);
  }
  return curve;
}

Curve bessel_curve(Effort) {
  Curve curve{
      .title = "I0(x) exp(-x) at large arguments",
      .driver = "x",
      .measure = "relative error (1 where it is not a number)",
      .is_log = true,
      .drivers = {1e-3, 0.1, 1, 10, 50, 80, 100, 700, 1e3, 1e4, 1e6, 1e8, 1e12},
      .series = {{"as printed, float", {}}, {"shipped, float", {}}, {"shipped, double", {}}},
      .warning_from = {}};
  for (const double x : curve.drivers) {
    // (1 / pi) integral over [0, pi] of exp(x (cos t - 1)), on panels as narrow as the peak.
    std::vector<double> breaks;
    append_geometric_breaks(0, 0.5 / std::sqrt(x + 1), kPi, breaks);
    const double exact = integrate(gauss_legendre_panels(24, 0, kPi, breaks),
                                   [&](double t) {
                                     const double half = std::sin(0.5 * t);
                                     return std::exp(-2 * x * half * half);
                                   }) /
                         kPi;
    const auto error = [&](double value) {
      return std::isfinite(value) ? std::abs(value / exact - 1) : 1.0;
    };
    const auto small = static_cast<float>(x);
    // The printed product, in the precision of a renderer.
    const float printed =
        static_cast<float>(std::cyl_bessel_i(0.0, std::min(x, 700.0))) * std::exp(-small);
    curve.series[0].values.push_back(error(static_cast<double>(printed)));
    curve.series[1].values.push_back(error(static_cast<double>(scaled_bessel_i0(small))));
    curve.series[2].values.push_back(error(scaled_bessel_i0(x)));
  }
  return curve;
}

Curve lobe_width_curve(Effort) {
  Curve curve{.title = "Light along the fiber: cos(theta) and G go to 0",
              .driver = "light from the fiber's axis, degrees",
              .measure = "|energy out / (F + (1 - F) C_TT) - 1|",
              .is_log = true,
              .drivers = {1e-4, 1e-2, 0.1, 0.5, 1, 2, 5, 10, 20, 45, 90},
              .series = {},
              .warning_from = {}};
  for (const double beta : {1.0, 10.0, 60.0}) {
    Series series{"beta " + std::to_string(static_cast<int>(beta)) + " deg", {}};
    const FiberScattering fiber = gray_fiber(beta, 30);
    const BcsdfTable table(fiber);
    for (const double from_axis : curve.drivers) {
      const double theta_i = kPi / 2 - radians(from_axis);
      const Vec3 wi =
          Vec3d(std::cos(radians(from_axis)), std::sin(radians(from_axis)), 0).cast<float>();
      std::vector<double> thetas;
      append_geometric_breaks(-theta_i, 0.5 * fiber.beta_r, kPi, thetas);
      const QuadratureRule phis =
          gauss_legendre_panels(12, 0, kPi, {kPi / 2, kPi - fiber.gamma_tt});
      const double energy =
          integrate(gauss_legendre_panels(10, -kPi / 2, kPi / 2, thetas), [&](double theta) {
            const double cosine = std::cos(theta);
            return cosine * cosine * integrate(phis, [&](double phi) {
                     return 2 * static_cast<double>(
                                    table.evaluate(wi, vector_from({theta, phi}).cast<float>())[0]);
                   });
          });
      const double fresnel = 0.3 + 0.7 * std::pow(1 - std::sin(radians(from_axis)), 5);
      series.values.push_back(std::abs(energy / (fresnel + (1 - fresnel) * 0.7) - 1));
    }
    curve.series.push_back(std::move(series));
  }
  return curve;
}

}  // namespace heddle::stability
