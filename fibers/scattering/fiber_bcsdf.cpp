#include "fibers/scattering/fiber_bcsdf.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/special_functions.h"
#include "fibers/math/spherical_harmonics.h"

namespace heddle {
namespace {

// exp(-d^2 / (2 beta^2)) / (sqrt(2 pi) beta Gn): M of the header.
double longitudinal(double theta_i, double theta_o, double beta) {
  const double deviation = (theta_i + theta_o) / beta;
  return std::exp(-0.5 * deviation * deviation) /
         (std::sqrt(2.0 * kPi) * beta * gaussian_cos2_mean(theta_i, beta));
}

// Unit vector of the azimuth in the normal plane; any for directions along the tangent.
Eigen::Vector2d azimuth(const Vec3d& direction) {
  const double length = std::hypot(direction.y(), direction.z());
  return length > 0.0 ? Eigen::Vector2d(direction.y() / length, direction.z() / length)
                      : Eigen::Vector2d(1.0, 0.0);
}

// Nodes over [-pi/2, pi/2] for a Gaussian about `centre` times functions that change on the scale
// beta or slower.
QuadratureRule gaussian_panels(double centre, double beta) {
  const double a = std::max(-kHalfPi, centre - 9.0 * beta);
  const double b = std::min(kHalfPi, centre + 9.0 * beta);
  return gauss_legendre_panels(24, a, b, {centre - 3.0 * beta, centre, centre + 3.0 * beta});
}

}  // namespace

FiberDirection fiber_direction(const Vec3d& direction) {
  return {std::atan2(direction.x(), std::hypot(direction.y(), direction.z())),
          std::atan2(direction.z(), direction.y())};
}

Vec3d vector_from(const FiberDirection& direction) {
  const double cosine = std::cos(direction.theta);
  return {std::sin(direction.theta), cosine * std::cos(direction.phi),
          cosine * std::sin(direction.phi)};
}

double schlick_weight(double cos_theta) {
  const double drop = 1.0 - cos_theta;
  return drop * drop * (drop * drop) * drop;
}

double longitudinal_weight(double theta_i, double beta) {
  const double cosine = std::sin(kHalfPi - std::abs(theta_i));
  return cosine * cosine / (std::sqrt(2.0 * kPi) * beta * gaussian_cos2_mean(theta_i, beta));
}

Rgbd colored(const FiberScattering& fiber, const LobeSums& sums) {
  if (fiber.isotropic_white) return Rgbd::Constant(sums.r);
  return fiber.color_r * sums.r +
         (1.0 - fiber.color_r) * (sums.r_schlick + fiber.color_tt * sums.tt);
}

Rgbd evaluate_bcsdf(const FiberScattering& fiber, const Vec3d& wi, const Vec3d& wo, Lobe lobe) {
  LobeSums density;
  if (fiber.isotropic_white) {
    if (lobe != Lobe::kTt) density.r = 1.0 / (kPi * kPi);
    return colored(fiber, density);
  }
  const double theta_i = fiber_direction(wi).theta;
  const double theta_o = fiber_direction(wo).theta;
  const double schlick = schlick_weight(std::hypot(wi.y(), wi.z()));
  if (lobe != Lobe::kTt) {
    density.r = longitudinal(theta_i, theta_o, fiber.beta_r) / (2.0 * kPi);
    density.r_schlick = density.r * schlick;
  }
  if (lobe != Lobe::kR) {
    const double k = 1.0 / (fiber.gamma_tt * fiber.gamma_tt);
    // 2 cos^2(d / 2) = |u_i + u_o|^2 / 2 does not cancel near the peak d = pi.
    const double von_mises = std::exp(-0.5 * k * (azimuth(wi) + azimuth(wo)).squaredNorm()) /
                             (2.0 * kPi * scaled_bessel_i0(k));
    density.tt = (1.0 - schlick) * longitudinal(theta_i, theta_o, fiber.beta_tt) * von_mises;
  }
  return colored(fiber, density);
}

Rgbd bcsdf_albedo(const FiberScattering& fiber, double theta_i) {
  assert(std::abs(theta_i) <= kHalfPi);
  LobeSums sums;
  if (fiber.isotropic_white) {
    const QuadratureRule rule = gauss_legendre(24, -kHalfPi, kHalfPi);
    sums.r = integrate(rule, [](double theta_o) { return std::cos(theta_o) * std::cos(theta_o); }) *
             2.0 * kPi / (kPi * kPi);
    return colored(fiber, sums);
  }
  const auto outgoing_share = [theta_i](double beta) {
    return integrate(gaussian_panels(-theta_i, beta), [&](double theta_o) {
      return longitudinal(theta_i, theta_o, beta) * std::cos(theta_o) * std::cos(theta_o);
    });
  };
  const double k = 1.0 / (fiber.gamma_tt * fiber.gamma_tt);
  std::vector<double> breaks;
  append_geometric_breaks(0.0, std::min(1.0, fiber.gamma_tt), kPi, breaks);
  const double azimuth_share = integrate(gauss_legendre_panels(24, -kPi, kPi, breaks),
                                         [k](double from_peak) {
                                           const double half_sine = std::sin(0.5 * from_peak);
                                           return std::exp(-2.0 * k * half_sine * half_sine);
                                         }) /
                               (2.0 * kPi * scaled_bessel_i0(k));
  const double schlick = schlick_weight(std::cos(theta_i));
  sums.r = outgoing_share(fiber.beta_r);
  sums.r_schlick = schlick * sums.r;
  sums.tt = (1.0 - schlick) * outgoing_share(fiber.beta_tt) * azimuth_share;
  return colored(fiber, sums);
}

std::vector<Rgbd> bcsdf_sh(const FiberScattering& fiber, double theta_o, int order, Lobe lobe) {
  assert(order >= 0 && order <= kMaxShOrder && std::abs(theta_o) <= kHalfPi);
  const int count = sh_count(order);
  // In azimuth Y_j is a trigonometric polynomial of degree `order`, which 2 order + 2 angles
  // integrate exactly against a constant and, with the weights below, against the von Mises
  // density: the mean of cos(m d) over it, d from its peak, is I_m(k) / I_0(k).
  const int angles = 2 * order + 2;
  std::vector<double> von_mises(static_cast<std::size_t>(angles), 1.0 / angles);
  if (!fiber.isotropic_white) {
    const std::vector<double> moments =
        bessel_ratios(order, 1.0 / (fiber.gamma_tt * fiber.gamma_tt));
    for (int a = 0; a < angles; ++a) {
      // wo lies at azimuth 0, TT's peak at pi
      const double from_peak = 2.0 * kPi * a / angles - kPi;
      for (int m = 1; m <= order; ++m) {
        von_mises[static_cast<std::size_t>(a)] +=
            2.0 / angles * moments[static_cast<std::size_t>(m)] * std::cos(m * from_peak);
      }
    }
  }

  std::vector<LobeSums> sums(static_cast<std::size_t>(count));
  std::vector<double> y(static_cast<std::size_t>(count));
  std::vector<double> mean(static_cast<std::size_t>(count));
  std::vector<double> mean_tt(static_cast<std::size_t>(count));
  const auto azimuthal_means = [&](double theta_i) {
    std::fill(mean.begin(), mean.end(), 0.0);
    std::fill(mean_tt.begin(), mean_tt.end(), 0.0);
    for (int a = 0; a < angles; ++a) {
      evaluate_sh(order, vector_from({theta_i, 2.0 * kPi * a / angles}), y.data());
      for (std::size_t j = 0; j < y.size(); ++j) {
        mean[j] += y[j] / angles;
        mean_tt[j] += y[j] * von_mises[static_cast<std::size_t>(a)];
      }
    }
  };

  if (lobe != Lobe::kTt) {
    const QuadratureRule rule = fiber.isotropic_white ? gauss_legendre(24, -kHalfPi, kHalfPi)
                                                      : gaussian_panels(-theta_o, fiber.beta_r);
    for (std::size_t n = 0; n < rule.nodes.size(); ++n) {
      const double theta_i = rule.nodes[n];
      azimuthal_means(theta_i);
      const double cosine = std::cos(theta_i);
      const double deviation = (theta_i + theta_o) / fiber.beta_r;
      const double density =
          rule.weights[n] * (fiber.isotropic_white ? 2.0 / kPi * cosine * cosine
                                                   : longitudinal_weight(theta_i, fiber.beta_r) *
                                                         std::exp(-0.5 * deviation * deviation));
      for (std::size_t j = 0; j < sums.size(); ++j) {
        sums[j].r += density * mean[j];
        sums[j].r_schlick += density * schlick_weight(cosine) * mean[j];
      }
    }
  }
  if (lobe != Lobe::kR && !fiber.isotropic_white) {
    const QuadratureRule rule = gaussian_panels(-theta_o, fiber.beta_tt);
    for (std::size_t n = 0; n < rule.nodes.size(); ++n) {
      const double theta_i = rule.nodes[n];
      azimuthal_means(theta_i);
      const double deviation = (theta_i + theta_o) / fiber.beta_tt;
      const double density = rule.weights[n] * longitudinal_weight(theta_i, fiber.beta_tt) *
                             std::exp(-0.5 * deviation * deviation) *
                             (1.0 - schlick_weight(std::cos(theta_i)));
      for (std::size_t j = 0; j < sums.size(); ++j) sums[j].tt += density * mean_tt[j];
    }
  }
  std::vector<Rgbd> coefficients;
  coefficients.reserve(sums.size());
  for (const LobeSums& s : sums) coefficients.push_back(colored(fiber, s));
  return coefficients;
}

}  // namespace heddle
