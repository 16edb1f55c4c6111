#include "fibers/scattering/sg_scatter.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

#include "fibers/math/special_functions.h"

namespace heddle {
namespace {

Eigen::Vector2d azimuth(const Vec3d& direction, double cosine) {
  return cosine > 0.0 ? Eigen::Vector2d(direction.y() / cosine, direction.z() / cosine)
                      : Eigen::Vector2d(1.0, 0.0);
}

// One lobe under one light: the integrand B exp(E) over theta.
class LobeIntegrand {
 public:
  LobeIntegrand(const FiberScattering& fiber, const SphericalGaussian& light, const Vec3d& wo,
                bool is_tt)
      : white_(fiber.isotropic_white), is_tt_(is_tt), sharpness_(light.sharpness) {
    light_cosine_ = std::hypot(light.axis.y(), light.axis.z());
    light_theta_ = std::atan2(light.axis.x(), light_cosine_);
    const double view_cosine = std::hypot(wo.y(), wo.z());
    cone_ = -std::atan2(wo.x(), view_cosine);
    beta_ = is_tt ? fiber.beta_tt : fiber.beta_r;
    inverse_variance_ = white_ ? 0.0 : 1.0 / (beta_ * beta_);
    if (is_tt) {
      k_ = 1.0 / (fiber.gamma_tt * fiber.gamma_tt);
      const Eigen::Vector2d u_light = azimuth(light.axis, light_cosine_);
      const Eigen::Vector2d u_view = azimuth(wo, view_cosine);
      sum2_ = (u_light + u_view).squaredNorm();
      difference2_ = (u_light - u_view).squaredNorm();
    }
  }

  // Centre and precision of the Gaussian that approximates exp(E).
  double precision() const { return 0.5 * (inverse_variance_ + sharpness_); }
  double centre() const {
    const double total = inverse_variance_ + sharpness_;
    return total > 0.0 ? (inverse_variance_ * cone_ + sharpness_ * light_theta_) / total : 0.0;
  }

  // E of the header.
  double exponent(double theta) const {
    const double from_cone = theta - cone_;
    const double half_sine = std::sin(0.5 * (theta - light_theta_));
    return -0.5 * inverse_variance_ * from_cone * from_cone -
           2.0 * sharpness_ * half_sine * half_sine;
  }

  double slope(double theta) const {  // dE / dtheta
    return -inverse_variance_ * (theta - cone_) - sharpness_ * std::sin(theta - light_theta_);
  }

  // B without Schlick's factor; |theta| <= pi/2. The printed I0 and exp overflow. The scaled form
  // is
  //   exp(-k - A) times the integral over phi_i = 2 pi I0e(m) exp(-q / (m + A + k))
  //   A = sharpness cos(theta) cos(theta'),   q = k A |u' + u_o|^2
  //   m = sqrt(k^2 + A^2 - 2 k A cos(d)) = sqrt((k - A)^2 + k A |u' - u_o|^2)
  double smooth(double theta) const {
    const double cosine = std::sin(kHalfPi - std::abs(theta));
    const double a = sharpness_ * light_cosine_ * cosine;
    if (white_) return 2.0 / kPi * cosine * cosine * scaled_bessel_i0(a);
    const double weight = longitudinal_weight(theta, beta_);
    if (!is_tt_) return weight * scaled_bessel_i0(a);
    const double m = std::sqrt((k_ - a) * (k_ - a) + k_ * a * difference2_);
    return weight * scaled_bessel_i0(m) / scaled_bessel_i0(k_) *
           std::exp(-k_ * a * sum2_ / (m + a + k_));
  }

  void add(double theta, double weight, LobeSums& sums) const {
    const double value = weight * smooth(theta);
    const double schlick = schlick_weight(std::cos(theta));
    if (is_tt_) {
      sums.tt += value * (1.0 - schlick);
    } else {
      sums.r += value;
      sums.r_schlick += value * schlick;
    }
  }

  void printed(LobeSums& sums) const {
    const double theta = centre();
    const double root = std::sqrt(precision());
    const double length =
        root > 0.0 ? 0.5 * std::sqrt(kPi) / root *
                         erf_difference(root * (-kHalfPi - theta), root * (kHalfPi - theta))
                   : kPi;
    // E at the centre to second order: -(beta^-2 sharpness / (beta^-2 + sharpness)) (theta_o +
    // theta')^2 / 2
    const double gap = light_theta_ - cone_;
    const double drop =
        precision() > 0.0 ? 0.25 * inverse_variance_ * sharpness_ / precision() * gap * gap : 0.0;
    add(theta, std::exp(-drop) * length, sums);
  }

  void three_nodes(LobeSums& sums) const {
    if (precision() < kBroadPrecision) {
      const QuadratureRule rule = gauss_legendre(kBroadNodes, -kHalfPi, kHalfPi);
      for (std::size_t n = 0; n < rule.nodes.size(); ++n) {
        add(rule.nodes[n], rule.weights[n] * std::exp(exponent(rule.nodes[n])), sums);
      }
      return;
    }
    const double c = centre();
    const double root = std::sqrt(precision());
    const double sign = c < 0.0 ? -1.0 : 1.0;
    const ThreeNodeRule rule = cut_rule(root * (kHalfPi - std::abs(c)));
    for (std::size_t n = 0; n < 3; ++n) {
      const double x = rule.nodes[n];
      const double theta = std::clamp(c + sign * x / root, -kHalfPi, kHalfPi);
      add(theta, rule.weights[n] / root * std::exp(exponent(theta) + x * x), sums);
    }
  }

  void quadrature(LobeSums& sums) const {
    // E's maximum lies between the cone and theta', since E falls outside them. Bisection on its
    // slope.
    double low = std::min(cone_, light_theta_);
    double high = std::max(cone_, light_theta_);
    for (int step = 0; step < 60 && high > low; ++step) {
      const double middle = 0.5 * (low + high);
      (slope(middle) > 0.0 ? low : high) = middle;
    }
    const double peak = 0.5 * (low + high);
    std::vector<double> breaks;
    append_geometric_breaks(peak, 1.0 / std::sqrt(2.0 * precision() + 4.0), kPi, breaks);
    append_geometric_breaks(cone_, std::min(1.0, white_ ? 1.0 : beta_), kPi, breaks);
    append_geometric_breaks(light_theta_, 1.0 / std::sqrt(sharpness_ + 4.0), kPi, breaks);
    // Gn changes on the scale beta from the ends, I0(A) on the scale 1 / sqrt(sharpness) or slower.
    for (const double end : {-kHalfPi, kHalfPi}) {
      append_geometric_breaks(end, 0.5 / std::sqrt(2.0 * precision() + 4.0), kPi, breaks);
    }
    const QuadratureRule rule = gauss_legendre_panels(16, -kHalfPi, kHalfPi, breaks);
    const double top = exponent(peak);
    for (std::size_t n = 0; n < rule.nodes.size(); ++n) {
      const double e = exponent(rule.nodes[n]);
      if (e > top - 60.0) add(rule.nodes[n], rule.weights[n] * std::exp(e), sums);
    }
  }

 private:
  bool white_;
  bool is_tt_;
  double sharpness_;
  double light_theta_;
  double light_cosine_;
  double cone_;  // -theta_o
  double beta_;
  double inverse_variance_;
  double k_ = 0.0;
  double sum2_ = 0.0;         // |u' + u_o|^2, u the unit vectors of the azimuths
  double difference2_ = 0.0;  // |u' - u_o|^2
};

}  // namespace

const ThreeNodeRule* cut_rules() {
  static const auto all = [] {
    std::array<ThreeNodeRule, kCutRules> rules{};
    for (int k = 0; k < kCutRules; ++k) {
      rules[static_cast<std::size_t>(k)] = cut_gauss_hermite3(k * kCutReach / (kCutRules - 1));
    }
    return rules;
  }();
  return all.data();
}

ThreeNodeRule cut_rule(double cut) {
  const double position = std::clamp(cut / kCutReach, 0.0, 1.0) * (kCutRules - 1);
  const int row = std::min(static_cast<int>(position), kCutRules - 2);
  const double t = position - row;
  const ThreeNodeRule& a = cut_rules()[row];
  const ThreeNodeRule& b = cut_rules()[row + 1];
  ThreeNodeRule rule{};
  for (std::size_t n = 0; n < 3; ++n) {
    rule.nodes[n] = (1.0 - t) * a.nodes[n] + t * b.nodes[n];
    rule.weights[n] = (1.0 - t) * a.weights[n] + t * b.weights[n];
  }
  return rule;
}

Rgbd sg_scatter(const FiberScattering& fiber, const SphericalGaussian& light, const Vec3d& wo,
                SgMethod method, Lobe lobe) {
  assert(light.sharpness >= 0.0);
  LobeSums sums;
  for (const bool is_tt : {false, true}) {
    if (lobe == (is_tt ? Lobe::kR : Lobe::kTt) || (is_tt && fiber.isotropic_white)) continue;
    const LobeIntegrand integrand(fiber, light, wo, is_tt);
    switch (method) {
      case SgMethod::kPrinted:
        integrand.printed(sums);
        break;
      case SgMethod::kDefault:
        integrand.three_nodes(sums);
        break;
      case SgMethod::kQuadrature:
        integrand.quadrature(sums);
        break;
    }
  }
  return colored(fiber, sums);
}

}  // namespace heddle
