#include "fibers/math/special_functions.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/vector.h"

namespace heddle {
namespace {

// Ratios of successive Bessel functions,
//   r_n = I_{n + shift} / I_{n - 1 + shift} = x / (2 (n + shift) + x r_{n+1})
// from high order downwards. The error of the start shrinks by r^2 in each step. For large x, 1 -
// r_n is about n / x, so 8 sqrt(x) steps suffice.
std::vector<double> ratios_by_downward_recurrence(int order, double x, double shift) {
  const int start = order + 30 + static_cast<int>(std::ceil(8.0 * std::sqrt(x)));
  double ratio = x / (2.0 * (start + shift) + x);
  std::vector<double> chain(static_cast<std::size_t>(order) + 1, 1.0);
  for (int n = start - 1; n >= 1; --n) {
    ratio = x / (2.0 * (n + shift) + x * ratio);
    if (n <= order) chain[static_cast<std::size_t>(n)] = ratio;
  }
  for (std::size_t n = 1; n < chain.size(); ++n) chain[n] *= chain[n - 1];
  return chain;
}

}  // namespace

double scaled_bessel_i0(double x) {
  assert(x >= 0.0 && "I0 is even: pass |x|");
  // From 20 on the asymptotic series has terms below 1e-17 before it diverges (its smallest is
  // about exp(-2 x)).
  if (x < 20.0) {
    const double quarter = 0.25 * x * x;
    double term = 1.0;
    double sum = 1.0;
    for (int k = 1; term > 1e-17 * sum; ++k) {
      term *= quarter / (static_cast<double>(k) * k);
      sum += term;
    }
    return sum * std::exp(-x);
  }
  double term = 1.0;
  double sum = 1.0;
  for (int k = 1; k < 40 && term > 1e-17; ++k) {
    term *= (2.0 * k - 1.0) * (2.0 * k - 1.0) / (8.0 * k * x);
    sum += term;
  }
  return sum / std::sqrt(2.0 * kPi * x);
}

float scaled_bessel_i0(float x) {
  if (x < 3.75F) {
    const float t = x * x * (1.0F / 14.0625F);
    const float i0 =
        1.0F + t * (3.5156229F +
                    t * (3.0899424F +
                         t * (1.2067492F + t * (0.2659732F + t * (0.0360768F + t * 0.0045813F)))));
    return i0 * std::exp(-x);
  }
  const float t = 3.75F / x;
  const float series =
      0.39894228F +
      t * (0.01328592F +
           t * (0.00225319F +
                t * (-0.00157565F +
                     t * (0.00916281F +
                          t * (-0.02057706F +
                               t * (0.02635537F + t * (-0.01647633F + t * 0.00392377F)))))));
  return series / std::sqrt(x);
}

std::vector<double> bessel_ratios(int order, double x) {
  assert(order >= 0 && order <= 16 && x >= 0.0);
  return ratios_by_downward_recurrence(order, x, 0.0);
}

std::vector<double> spherical_bessel_ratios(int order, double x) {
  assert(order >= 0 && order <= 10 && x >= 0.0);
  // Below 500 the finite sum cancels more and more; above it its terms fall by a factor of 9 or
  // more at order 10.
  if (x < 500.0) return ratios_by_downward_recurrence(order, x, 0.5);
  // i_l(x) = exp(x) / (2 x) * sum_k (-1)^k (l + k)! / (k! (l - k)! (2 x)^k), exp(-2 x) being 0
  // here.
  std::vector<double> ratios(static_cast<std::size_t>(order) + 1);
  for (int l = 0; l <= order; ++l) {
    double term = 1.0;
    double sum = 1.0;
    for (int k = 1; k <= l; ++k) {
      term *= -(l + k) * (l - k + 1.0) / (k * 2.0 * x);
      sum += term;
    }
    ratios[static_cast<std::size_t>(l)] = sum;
  }
  return ratios;
}

double erf_difference(double a, double b) {
  if (a > 0.0 && b > 0.0) return std::erfc(a) - std::erfc(b);
  if (a < 0.0 && b < 0.0) return std::erfc(-b) - std::erfc(-a);
  return std::erf(b) - std::erf(a);
}

float erf_difference(float a, float b) {
  if (a > 0.0F && b > 0.0F) return std::erfc(a) - std::erfc(b);
  if (a < 0.0F && b < 0.0F) return std::erfc(-b) - std::erfc(-a);
  return std::erf(b) - std::erf(a);
}

double gaussian_cos2_mean(double mu, double beta) {
  assert(beta > 0.0 && std::abs(mu) <= 0.5 * kPi + 1e-9);
  // 8.8 standard deviations leave 1e-18 of the Gaussian; 40 nodes integrate it on that range to
  // 1e-16.
  const double reach = 8.8 * beta;
  const double a = std::max(-0.5 * kPi, mu - reach);
  const double b = std::min(0.5 * kPi, mu + reach);
  const QuadratureRule& rule = []() -> const QuadratureRule& {
    static const QuadratureRule& kept = gauss_legendre(40);
    return kept;
  }();
  const double half = 0.5 * (b - a);
  const double middle = 0.5 * (b + a);
  double sum = 0.0;
  for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
    const double t = middle + half * rule.nodes[k];
    const double deviation = (t - mu) / beta;
    // cos as the sine of the distance from the nearer end keeps its relative accuracy at +-pi/2.
    const double cosine = std::sin(0.5 * kPi - std::abs(t));
    sum += rule.weights[k] * std::exp(-0.5 * deviation * deviation) * cosine * cosine;
  }
  return sum * half / (std::sqrt(2.0 * kPi) * beta);
}

}  // namespace heddle
