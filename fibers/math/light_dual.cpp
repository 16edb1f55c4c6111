#include "fibers/math/light_dual.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/symmetric_eigen.h"

namespace heddle {
namespace {

/// What the moments of light from both sides are trusted to: their noise, as a share of the mean
/// variance. It keeps the inverse from following it.
constexpr double kMomentNoise = 1e-4;

int index(int l, int m) {
  return l * (l + 1) + m;
}

/// Integrals over z > 0 of Y_lm Y_l'm, l and l' from m to `order`, with the weights of a rule in z.
Eigen::MatrixXd products_above(int m, int order, const QuadratureRule& rule) {
  const int n = order + 1 - m;
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(n, n);
  std::array<double, sh_count(kMaxShOrder)> y;
  for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
    const double z = rule.nodes[k];
    evaluate_sh(order, Vec3d(std::sqrt(1 - z * z), 0, z), y.data());
    Eigen::VectorXd values(n);
    for (int i = 0; i < n; ++i) values[i] = y[static_cast<std::size_t>(index(m + i, m))];
    // Over the azimuth cos^2(m phi) integrates to pi (2 pi for m = 0), which phi = 0 stands for.
    products += rule.weights[k] * (m == 0 ? 2 : 1) * kPi * values * values.transpose();
  }
  return products;
}

/// The same times sqrt(z), up to kMaxShOrder.
Eigen::MatrixXd rooted_products(int m) {
  // In sqrt(z) the integrand is a polynomial.
  QuadratureRule rule = gauss_legendre(2 * kMaxShOrder + 2, 0, 1);
  for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
    const double root = rule.nodes[k];
    rule.nodes[k] = root * root;
    rule.weights[k] *= 2 * root * root;
  }
  return products_above(m, kMaxShOrder, rule);
}

/// k_lm of light above the plane is the sum over l' of row l - m times sqrt(z) Y_l'm.
Eigen::MatrixXd prior_rows(int m) {
  Eigen::MatrixXd rows = rooted_products(m);
  for (int k = 0; k < rows.cols(); ++k) rows.col(k) *= std::pow(m + k + 1, -6);
  return rows;
}

Eigen::MatrixXd inverse_above(int m, int order) {
  const int n = order + 1 - m;
  const SymmetricEigen eigen =
      symmetric_eigen(products_above(m, order, gauss_legendre(order + 1, 0, 1)));
  Eigen::VectorXd inverse = eigen.values;
  for (int i = 0; i < n; ++i)
    inverse[i] = inverse[i] < LightDual::kLeastShare ? 0.0 : 1 / inverse[i];
  return eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
}

Eigen::MatrixXd inverse_of_both(int m, int order) {
  const int n = order + 1 - m;
  const Eigen::MatrixXd above = (prior_rows(m) * rooted_products(m)).topLeftCorner(n, n);
  // What lies below adds the same where l + l' is even, and takes it away where it is odd.
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
  for (int row = 0; row < n; ++row) {
    for (int column = row % 2; column < n; column += 2) gram(row, column) = 2 * above(row, column);
  }
  // Not for the mean: light from everywhere then gets all of it.
  const double noise = kMomentNoise * gram.trace() / n;
  for (int row = m == 0 ? 1 : 0; row < n; ++row) gram(row, row) += noise;
  const SymmetricEigen eigen = symmetric_eigen(gram);
  return eigen.vectors * eigen.values.cwiseInverse().asDiagonal() * eigen.vectors.transpose();
}

}  // namespace

LightDual::LightDual(int order, bool both_sides) : order_(order) {
  for (int m = 0; m <= order; ++m) {
    const Eigen::MatrixXd block = both_sides ? inverse_of_both(m, order) : inverse_above(m, order);
    std::vector<float>& stored = blocks_[static_cast<std::size_t>(m)];
    for (int row = 0; row < block.rows(); ++row) {
      for (int column = 0; column < block.cols(); ++column)
        stored.push_back(static_cast<float>(block(row, column)));
    }
  }
}

const LightDual& LightDual::of(int order, bool both_sides) {
  static const auto all = [] {
    std::array<std::vector<LightDual>, 2> result;
    for (int k = 0; k <= kMaxShOrder; ++k) {
      result[0].push_back(LightDual(k, false));
      result[1].push_back(LightDual(k, true));
    }
    return result;
  }();
  assert(order >= 0 && order <= kMaxShOrder);
  return all[both_sides ? 1 : 0][static_cast<std::size_t>(order)];
}

void LightDual::apply(float* values) const {
  std::array<float, kMaxShOrder + 1> result;
  for (int signed_m = -order_; signed_m <= order_; ++signed_m) {
    const int m = std::abs(signed_m);
    const float* row = blocks_[static_cast<std::size_t>(m)].data();
    for (int i = 0; i <= order_ - m; ++i) {
      float sum = 0;
      for (int l = m; l <= order_; ++l) sum += *row++ * values[index(l, signed_m)];
      result[static_cast<std::size_t>(i)] = sum;
    }
    for (int i = 0; i <= order_ - m; ++i) {
      values[index(m + i, signed_m)] = result[static_cast<std::size_t>(i)];
    }
  }
}

void two_sided_moments(int order, const float* above, const float* below, float* moments) {
  static const auto rows = [] {
    std::array<Eigen::MatrixXf, kMaxShOrder + 1> result;
    for (int m = 0; m <= kMaxShOrder; ++m)
      result[static_cast<std::size_t>(m)] = prior_rows(m).cast<float>();
    return result;
  }();
  for (int signed_m = -order; signed_m <= order; ++signed_m) {
    const int m = std::abs(signed_m);
    const Eigen::MatrixXf& block = rows[static_cast<std::size_t>(m)];
    for (int l = m; l <= order; ++l) {
      float sum = 0;
      float sign = (l - m) % 2 == 0 ? 1.0F : -1.0F;
      for (int k = m; k <= kMaxShOrder; ++k, sign = -sign) {
        const int j = index(k, signed_m);
        sum += block(l - m, k - m) * (above[j] + sign * below[j]);
      }
      moments[index(l, signed_m)] = sum;
    }
  }
}

void direction_moments(int order, bool both_sides, const Vec3& direction, float* moments) {
  const bool is_above = direction.z() > 0;
  if (!both_sides) {
    if (is_above) {
      evaluate_sh(order, direction, moments);
    } else {
      std::fill_n(moments, sh_count(order), 0.0F);
    }
    return;
  }
  std::array<float, sh_count(kMaxShOrder)> here;
  const std::array<float, sh_count(kMaxShOrder)> nothing{};
  evaluate_sh(kMaxShOrder, direction, here.data());
  const float root = std::sqrt(std::abs(direction.z()));
  for (float& value : here) value *= root;
  two_sided_moments(order, is_above ? here.data() : nothing.data(),
                    is_above ? nothing.data() : here.data(), moments);
}

}  // namespace heddle
