#include "fibers/math/hemisphere_dual.h"

#include <cassert>
#include <cmath>

#include "fibers/math/quadrature.h"
#include "fibers/math/symmetric_eigen.h"

namespace heddle {

HemisphereDual::HemisphereDual(int order) : order_(order) {
  for (int m = 0; m <= order; ++m) {
    const int n = order + 1 - m;
    // Over z exactly; over the azimuth cos^2(m phi) integrates to pi (2 pi for m = 0), which phi =
    // 0 stands for.
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
    const QuadratureRule rule = gauss_legendre(order + 1, 0, 1);
    std::array<double, sh_count(kMaxShOrder)> y;
    for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
      const double z = rule.nodes[k];
      evaluate_sh(order, Vec3d(std::sqrt(1 - z * z), 0, z), y.data());
      Eigen::VectorXd values(n);
      for (int i = 0; i < n; ++i)
        values[i] = y[static_cast<std::size_t>((m + i) * (m + i + 1) + m)];
      gram += rule.weights[k] * (m == 0 ? 2 : 1) * kPi * values * values.transpose();
    }
    const SymmetricEigen eigen = symmetric_eigen(gram);
    Eigen::VectorXd inverse = eigen.values;
    for (int i = 0; i < n; ++i) inverse[i] = inverse[i] < kLeastShare ? 0.0 : 1 / inverse[i];
    const Eigen::MatrixXd block = eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
    std::vector<float>& stored = blocks_[static_cast<std::size_t>(m)];
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column < n; ++column)
        stored.push_back(static_cast<float>(block(row, column)));
    }
  }
}

const HemisphereDual& HemisphereDual::of_order(int order) {
  static const std::vector<HemisphereDual> all = [] {
    std::vector<HemisphereDual> result;
    for (int k = 0; k <= kMaxShOrder; ++k) result.push_back(HemisphereDual(k));
    return result;
  }();
  assert(order >= 0 && order <= kMaxShOrder);
  return all[static_cast<std::size_t>(order)];
}

void HemisphereDual::apply(float* values) const {
  std::array<float, kMaxShOrder + 1> result;
  for (int signed_m = -order_; signed_m <= order_; ++signed_m) {
    const int m = std::abs(signed_m);
    const float* row = blocks_[static_cast<std::size_t>(m)].data();
    for (int i = 0; i <= order_ - m; ++i) {
      float sum = 0;
      for (int l = m; l <= order_; ++l) sum += *row++ * values[l * (l + 1) + signed_m];
      result[static_cast<std::size_t>(i)] = sum;
    }
    for (int i = 0; i <= order_ - m; ++i) {
      const int l = m + i;
      values[l * (l + 1) + signed_m] = result[static_cast<std::size_t>(i)];
    }
  }
}

}  // namespace heddle
