#ifndef HEDDLE_TESTS_SUPPORT_STATISTICS_H_
#define HEDDLE_TESTS_SUPPORT_STATISTICS_H_
// Statistical checks for the tests of all modules: the chi-square test of a direction sampler
// against its density, and the z-test of two means. Both print the numbers they decide on.
//
// Directions are binned in (theta, phi) about the x axis: theta = asin(x), phi = atan2(z, y), the
// fiber frame. A window zooms in on narrow lobes; what falls outside is one more cell. Both a
// coarse and a fine grid are tested: a fine grid alone hides a density that is 2 % wrong, a coarse
// one hides structure. The Sidak correction keeps the chance of a false alarm of a whole family of
// tests at kSignificance. Tested in tests/math/statistics_test.cpp, which shows that each rejects a
// density wrong by 2 %.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "fibers/math/quadrature.h"
#include "fibers/math/vector.h"

namespace heddle {

inline constexpr double kSignificance = 0.01;

/// Probability that a chi-square variable with that many degrees of freedom exceeds `statistic`:
/// the regularised upper incomplete gamma function, by its series or its continued fraction.
inline double chi_square_tail(double statistic, int degrees) {
  const double a = 0.5 * degrees;
  const double x = 0.5 * statistic;
  if (x <= 0.0) return 1.0;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1.0) {
    double term = 1.0 / a;
    double sum = term;
    for (double n = a + 1.0; term > 1e-16 * sum; n += 1.0) {
      term *= x / n;
      sum += term;
    }
    return std::max(0.0, 1.0 - front * sum);
  }
  double b = x + 1.0 - a;
  double c = 1e300;
  double d = 1.0 / b;
  double h = d;
  for (int i = 1; i < 10000; ++i) {
    const double numerator = -i * (i - a);
    b += 2.0;
    d = 1.0 / (numerator * d + b);
    c = b + numerator / c;
    h *= c * d;
    if (std::abs(c * d - 1.0) < 1e-15) break;
  }
  return front * h;
}

/// Significance of one of `tests` tests whose family has kSignificance.
inline double sidak_significance(int tests) {
  return 1.0 - std::pow(1.0 - kSignificance, 1.0 / tests);
}

struct ChiSquareResult {
  double statistic;
  int degrees;
  double p_value;
};

/// Pearson's statistic; cells that expect less than 5 are pooled, smallest first, until the pool
/// expects 5.
inline ChiSquareResult chi_square(const std::vector<double>& expected,
                                  const std::vector<double>& observed) {
  std::vector<std::size_t> order(expected.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
  double statistic = 0.0;
  double pool_expected = 0.0;
  double pool_observed = 0.0;
  int cells = 0;
  for (const std::size_t k : order) {
    pool_expected += expected[k];
    pool_observed += observed[k];
    if (pool_expected < 5.0) continue;
    statistic += (pool_observed - pool_expected) * (pool_observed - pool_expected) / pool_expected;
    pool_expected = pool_observed = 0.0;
    ++cells;
  }
  // What is left expects less than 5 because everything does; a sample where nearly none may fall
  // is an error all the same.
  if (pool_observed > 50.0) statistic += 1e9;
  const int degrees = std::max(1, cells - 1);
  return {statistic, degrees, chi_square_tail(statistic, degrees)};
}

struct AngleWindow {
  double theta_min = -0.5 * kPi;
  double theta_max = 0.5 * kPi;
  double phi_min = -kPi;  // phi is taken in [phi_min, phi_min + 2 pi)
  double phi_max = kPi;
};

/// Chi-square test of `sample` against `density` (1/sr) with `count` samples, on 10 x 20 and 40 x
/// 80 cells of the window. `tests` is the number of calls in the family. Prints both statistics;
/// true when neither rejects.
inline bool chi_square_accepts(const std::string& name, const std::function<Vec3d()>& sample,
                               const std::function<double(const Vec3d&)>& density, int count,
                               int tests = 1, const AngleWindow& window = {}) {
  std::vector<double> thetas;
  std::vector<double> phis;
  for (int k = 0; k < count; ++k) {
    const Vec3d w = sample();
    thetas.push_back(std::atan2(w.x(), std::hypot(w.y(), w.z())));
    double phi = std::atan2(w.z(), w.y());
    while (phi < window.phi_min) phi += 2.0 * kPi;
    while (phi >= window.phi_min + 2.0 * kPi) phi -= 2.0 * kPi;
    phis.push_back(phi);
  }
  bool accepted = true;
  for (const int scale : {1, 4}) {
    const int rows = 10 * scale;
    const int columns = 20 * scale;
    const double row_height = (window.theta_max - window.theta_min) / rows;
    const double column_width = (window.phi_max - window.phi_min) / columns;
    const auto cells = static_cast<std::size_t>(rows * columns);
    std::vector<double> expected(cells + 1, 0.0);
    std::vector<double> observed(cells + 1, 0.0);
    const int nodes = scale == 1 ? 16 : 6;
    double inside = 0.0;
    for (int r = 0; r < rows; ++r) {
      const QuadratureRule theta_rule = gauss_legendre(nodes, window.theta_min + r * row_height,
                                                       window.theta_min + (r + 1) * row_height);
      for (int c = 0; c < columns; ++c) {
        const QuadratureRule phi_rule = gauss_legendre(nodes, window.phi_min + c * column_width,
                                                       window.phi_min + (c + 1) * column_width);
        const double share = integrate(theta_rule, [&](double theta) {
          return std::cos(theta) * integrate(phi_rule, [&](double phi) {
                   return density(Vec3d(std::sin(theta), std::cos(theta) * std::cos(phi),
                                        std::cos(theta) * std::sin(phi)));
                 });
        });
        expected[static_cast<std::size_t>(r * columns + c)] = share * count;
        inside += share;
      }
    }
    expected[cells] = std::max(0.0, 1.0 - inside) * count;
    for (std::size_t k = 0; k < thetas.size(); ++k) {
      const double row = std::floor((thetas[k] - window.theta_min) / row_height);
      const double column = std::floor((phis[k] - window.phi_min) / column_width);
      const bool is_inside = row >= 0.0 && row < rows && column >= 0.0 && column < columns;
      observed[is_inside ? static_cast<std::size_t>(row * columns + column) : cells] += 1.0;
    }
    const ChiSquareResult result = chi_square(expected, observed);
    // Two grids per call share the family's significance.
    const double significance = sidak_significance(2 * tests);
    const bool grid_accepts = result.p_value > significance && inside < 1.0 + 1e-3;
    std::printf(
        "  chi-square %-34s %2d x %2d: %9.1f, %4d degrees, p = %.3g (limit %.3g), window holds "
        "%.5f%s\n",
        name.c_str(), rows, columns, result.statistic, result.degrees, result.p_value, significance,
        inside, grid_accepts ? "" : "  REJECTED");
    accepted = accepted && grid_accepts;
  }
  return accepted;
}

/// Mean and its standard error, updated one value at a time (Welford 1962).
class RunningMean {
 public:
  void add(double value) {
    ++count_;
    const double step = value - mean_;
    mean_ += step / static_cast<double>(count_);
    squares_ += step * (value - mean_);
  }
  double mean() const { return mean_; }
  double standard_error() const {
    const auto n = static_cast<double>(count_);
    return std::sqrt(squares_ / (n * (n - 1.0)));
  }

 private:
  std::size_t count_ = 0;
  double mean_ = 0.0;
  double squares_ = 0.0;
};

/// True when two means agree within the Sidak-corrected two-sided limit of a family of `tests`; an
/// exact value has standard error 0. Prints the number of standard errors between them.
inline bool means_agree(const std::string& name, double mean_a, double standard_error_a,
                        double mean_b, double standard_error_b, int tests = 1) {
  const double standard_error = std::hypot(standard_error_a, standard_error_b);
  const double z =
      standard_error > 0.0 ? (mean_a - mean_b) / standard_error : (mean_a == mean_b ? 0.0 : 1e9);
  const double p_value = std::erfc(std::abs(z) / std::sqrt(2.0));
  const bool agree = p_value > sidak_significance(tests);
  std::printf(
      "  z-test %-38s %.6g +- %.2g against %.6g +- %.2g: %+.2f standard errors, p = %.3g (limit "
      "%.3g)%s\n",
      name.c_str(), mean_a, standard_error_a, mean_b, standard_error_b, z, p_value,
      sidak_significance(tests), agree ? "" : "  REJECTED");
  return agree;
}

}  // namespace heddle

#endif  // HEDDLE_TESTS_SUPPORT_STATISTICS_H_
