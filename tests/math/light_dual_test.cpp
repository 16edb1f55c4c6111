#include "fibers/math/light_dual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fibers/math/quadrature.h"

namespace heddle {
namespace {

constexpr int kOrder = 5;
using Moments = std::array<double, sh_count(kOrder)>;

/// Calls visit(direction, weight) over a quadrature of the upper hemisphere.
void over_hemisphere(const std::function<void(const Vec3d&, double)>& visit) {
  const QuadratureRule rule = gauss_legendre(48, 0, 1);
  constexpr int kAzimuths = 96;
  for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
    const double z = rule.nodes[k];
    const double r = std::sqrt(1 - z * z);
    for (int a = 0; a < kAzimuths; ++a) {
      const double phi = 2 * kPi * (a + 0.5) / kAzimuths;
      visit(Vec3d(r * std::cos(phi), r * std::sin(phi), z), rule.weights[k] * 2 * kPi / kAzimuths);
    }
  }
}

Moments moments_of(const std::function<double(const Vec3d&)>& function) {
  Moments moments{};
  over_hemisphere([&](const Vec3d& w, double weight) {
    Moments y;
    evaluate_sh(kOrder, w, y.data());
    for (std::size_t j = 0; j < y.size(); ++j) moments[j] += weight * function(w) * y[j];
  });
  return moments;
}

double rebuilt(const Moments& moments, const Vec3d& w) {
  std::array<float, sh_count(kOrder)> dual;
  evaluate_sh(kOrder, w.cast<float>(), dual.data());
  LightDual::of(kOrder, false).apply(dual.data());
  double sum = 0;
  for (std::size_t j = 0; j < moments.size(); ++j) sum += moments[j] * static_cast<double>(dual[j]);
  return sum;
}

/// Root mean square over the hemisphere of (approximation - function), over that of the function.
double relative_error(const std::function<double(const Vec3d&)>& function,
                      const std::function<double(const Vec3d&)>& approximation) {
  double error = 0;
  double square = 0;
  over_hemisphere([&](const Vec3d& w, double weight) {
    error += weight * std::pow(approximation(w) - function(w), 2);
    square += weight * std::pow(function(w), 2);
  });
  return std::sqrt(error / square);
}

// A projection: what it rebuilds, it rebuilds again from its own moments. (Floats, eigenvalues from
// 0.09 on.)
TEST(LightDualLaw, RebuildingTwiceChangesNothing) {
  const Moments first =
      moments_of([](const Vec3d& w) { return std::exp(3 * (w.x() - 1)) + w.y(); });
  const auto once = [&](const Vec3d& w) { return rebuilt(first, w); };
  const Moments second = moments_of(once);
  EXPECT_LT(relative_error(once, [&](const Vec3d& w) { return rebuilt(second, w); }), 1e-5);
}

// Least squares: the error is orthogonal to everything rebuilt.
TEST(LightDualLaw, TheErrorIsOrthogonalToTheApproximation) {
  const auto function = [](const Vec3d& w) { return std::abs(w.x()) * w.z(); };
  const Moments moments = moments_of(function);
  double product = 0;
  double square = 0;
  over_hemisphere([&](const Vec3d& w, double weight) {
    const double approximation = rebuilt(moments, w);
    product += weight * (function(w) - approximation) * approximation;
    square += weight * approximation * approximation;
  });
  EXPECT_LT(std::abs(product / square), 1e-5);
}

// What it is for. Transfer of a fabric rises steeply from 0 at the horizon, where light begins to
// reach the crests, and has a lobe to one side. The plain expansion, and twice its part odd in z
// (which continues the function oddly), are the alternatives. (A function that falls to 0 like the
// cosine itself is odd, and the odd part alone better.)
TEST(LightDualLaw, BeatsThePlainAndTheOddExpansion) {
  for (const double lobe : {0.0, 2.0, 8.0}) {
    const auto function = [&](const Vec3d& w) {
      return (1 - std::exp(-w.z() / 0.15)) * (0.2 + std::exp(lobe * (w.x() - 1)));
    };
    const Moments moments = moments_of(function);
    const auto expansion = [&](const Vec3d& w, bool odd) {
      Moments y;
      evaluate_sh(kOrder, w, y.data());
      double sum = 0;
      for (int l = 0; l <= kOrder; ++l) {
        for (int m = -l; m <= l; ++m) {
          const auto j = static_cast<std::size_t>(l * (l + 1) + m);
          if (!odd || (l + m) % 2 != 0) sum += (odd ? 2 : 1) * moments[j] * y[j];
        }
      }
      return sum;
    };
    const double own =
        relative_error(function, [&](const Vec3d& w) { return rebuilt(moments, w); });
    const double plain =
        relative_error(function, [&](const Vec3d& w) { return expansion(w, false); });
    const double odd = relative_error(function, [&](const Vec3d& w) { return expansion(w, true); });
    std::printf("lobe %.0f: least squares %.4f, plain %.4f, odd %.4f\n", lobe, own, plain, odd);
    EXPECT_LT(own, 0.85 * plain);
    EXPECT_LT(own, 0.8 * odd);
  }
}

TEST(LightDual, OrderZeroIsTheMean) {
  float value = 1;
  LightDual::of(0, false).apply(&value);
  EXPECT_NEAR(value, 2, 1e-6);  // a constant's square lies half above the horizon
}

/// Root mean square over the whole sphere of (approximation - function), over that of the function.
double error_of_both(const std::function<double(const Vec3d&)>& function,
                     const std::function<double(const Vec3d&)>& approximation) {
  double error = 0;
  double square = 0;
  over_hemisphere([&](const Vec3d& w, double weight) {
    for (const Vec3d& side : {w, Vec3d(w.x(), w.y(), -w.z())}) {
      error += weight * std::pow(approximation(side) - function(side), 2);
      square += weight * std::pow(function(side), 2);
    }
  });
  return std::sqrt(error / square);
}

std::array<float, sh_count(kOrder)> weights_of_both(const Vec3d& w) {
  std::array<float, sh_count(kOrder)> dual;
  direction_moments(kOrder, true, w.cast<float>(), dual.data());
  LightDual::of(kOrder, true).apply(dual.data());
  return dual;
}

// Cloth that lets a share of the light through: from either side the response rises from 0 at the
// plane, more or less steeply, and has a lobe to one side.
TEST(TwoSidedDualLaw, BeatsThePlainExpansionAndDoesNotLeak) {
  for (const double through : {0.0, 0.3, 1.0}) {
    for (const double rise : {0.1, 0.4}) {
      const auto function = [&](const Vec3d& w) {
        const double z = std::abs(w.z());
        return (w.z() > 0 ? 1 : through) * z / (z + rise) * (0.2 + std::exp(2 * (w.x() - 1)));
      };
      Moments moments{};
      over_hemisphere([&](const Vec3d& w, double weight) {
        for (const Vec3d& side : {w, Vec3d(w.x(), w.y(), -w.z())}) {
          Moments y;
          evaluate_sh(kOrder, side, y.data());
          for (std::size_t j = 0; j < y.size(); ++j) moments[j] += weight * function(side) * y[j];
        }
      });
      const auto rebuilt_both = [&](const Vec3d& w) {
        const auto dual = weights_of_both(w);
        double sum = 0;
        for (std::size_t j = 0; j < moments.size(); ++j)
          sum += moments[j] * static_cast<double>(dual[j]);
        return sum;
      };
      const auto expansion = [&](const Vec3d& w) {
        Moments y;
        evaluate_sh(kOrder, w, y.data());
        double sum = 0;
        for (std::size_t j = 0; j < moments.size(); ++j) sum += moments[j] * y[j];
        return sum;
      };
      const double own = error_of_both(function, rebuilt_both);
      const double plain = error_of_both(function, expansion);
      const Vec3d along(1, 0, 0);
      std::printf("through %.1f, rise %.1f: %.4f, plain %.4f; along the plane %.4f, plain %.4f\n",
                  through, rise, own, plain, rebuilt_both(along), expansion(along));
      EXPECT_LT(own, 0.75 * plain);
      EXPECT_NEAR(rebuilt_both(along), 0, 1e-6);
      EXPECT_GT(expansion(along), 0.1) << "the plain expansion does leak";
    }
  }
}

// Light from everywhere brings the mean of the response, which the first moment is, and nothing
// else.
TEST(TwoSidedDualLaw, LightFromEverywhereIsTheMean) {
  std::array<double, sh_count(kOrder)> sum{};
  over_hemisphere([&](const Vec3d& w, double weight) {
    for (const Vec3d& side : {w, Vec3d(w.x(), w.y(), -w.z())}) {
      const auto dual = weights_of_both(side);
      for (std::size_t j = 0; j < sum.size(); ++j) sum[j] += weight * static_cast<double>(dual[j]);
    }
  });
  for (std::size_t j = 0; j < sum.size(); ++j)
    EXPECT_NEAR(sum[j], j == 0 ? std::sqrt(4 * kPi) : 0, 2e-4) << j;
}

// A cloth turned over is the same cloth: harmonics of odd l + m change their sign.
TEST(TwoSidedDualLaw, BothSidesAreTreatedAlike) {
  const Vec3d w = Vec3d(0.3, -0.5, 0.2).normalized();
  const auto above = weights_of_both(w);
  const auto below = weights_of_both(Vec3d(w.x(), w.y(), -w.z()));
  for (int l = 0; l <= kOrder; ++l) {
    for (int m = -l; m <= l; ++m) {
      const auto j = static_cast<std::size_t>(l * (l + 1) + m);
      EXPECT_NEAR(below[j], (l + m) % 2 == 0 ? above[j] : -above[j], 1e-5) << l << ", " << m;
    }
  }
}

}  // namespace
}  // namespace heddle
