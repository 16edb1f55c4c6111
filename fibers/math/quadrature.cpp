#include "fibers/math/quadrature.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <mutex>

#include "fibers/math/symmetric_eigen.h"
#include "fibers/math/vector.h"

namespace heddle {
namespace {

QuadratureRule make_gauss_legendre(int count) {
  QuadratureRule rule;
  rule.nodes.resize(static_cast<std::size_t>(count));
  rule.weights.resize(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    // Newton's iteration from the usual first guess for the roots of the Legendre polynomial.
    double x = -std::cos(kPi * (k + 0.75) / (count + 0.5));
    double derivative = 1.0;
    for (int step = 0; step < 100; ++step) {
      double previous = 1.0;
      double value = x;
      for (int n = 2; n <= count; ++n) {
        const double next = ((2 * n - 1) * x * value - (n - 1) * previous) / n;
        previous = value;
        value = next;
      }
      derivative = count * (x * value - previous) / (x * x - 1.0);
      const double change = value / derivative;
      x -= change;
      if (std::abs(change) < 1e-16) break;
    }
    rule.nodes[static_cast<std::size_t>(k)] = x;
    rule.weights[static_cast<std::size_t>(k)] = 2.0 / ((1.0 - x * x) * derivative * derivative);
  }
  return rule;
}

// Golub and Welsch 1969: the eigenvalues of the Jacobi matrix are the nodes, the first components
// of the eigenvectors give the weights.
QuadratureRule from_jacobi_matrix(const Eigen::VectorXd& diagonal,
                                  const Eigen::VectorXd& off_diagonal, double mass) {
  const SymmetricEigen eigen = symmetric_eigen(diagonal, off_diagonal);
  QuadratureRule rule;
  for (Eigen::Index k = 0; k < diagonal.size(); ++k) {
    rule.nodes.push_back(eigen.values[k]);
    const double first = eigen.vectors(0, k);
    rule.weights.push_back(mass * first * first);
  }
  return rule;
}

QuadratureRule make_gauss_hermite(int count) {
  Eigen::VectorXd off_diagonal(count - 1);
  for (int k = 1; k < count; ++k) off_diagonal[k - 1] = std::sqrt(0.5 * k);
  return from_jacobi_matrix(Eigen::VectorXd::Zero(count), off_diagonal, std::sqrt(kPi));
}

template <typename Make>
const QuadratureRule& cached(int count, std::map<int, QuadratureRule>& rules, std::mutex& mutex,
                             Make make) {
  assert(count >= 1 && "a quadrature rule needs a node");
  const std::lock_guard<std::mutex> lock(mutex);
  auto found = rules.find(count);
  if (found == rules.end()) found = rules.emplace(count, make(count)).first;
  return found->second;
}

}  // namespace

const QuadratureRule& gauss_legendre(int count) {
  static std::map<int, QuadratureRule> rules;
  static std::mutex mutex;
  return cached(count, rules, mutex, make_gauss_legendre);
}

QuadratureRule gauss_legendre(int count, double a, double b) {
  return gauss_legendre_panels(count, a, b, {});
}

QuadratureRule gauss_legendre_panels(int count, double a, double b, std::vector<double> breaks) {
  const QuadratureRule& base = gauss_legendre(count);
  std::erase_if(breaks, [a, b](double x) { return !(x > a && x < b); });
  breaks.push_back(a);
  breaks.push_back(b);
  std::sort(breaks.begin(), breaks.end());
  QuadratureRule rule;
  rule.nodes.reserve((breaks.size() - 1) * base.nodes.size());
  rule.weights.reserve(rule.nodes.capacity());
  for (std::size_t panel = 0; panel + 1 < breaks.size(); ++panel) {
    const double half = 0.5 * (breaks[panel + 1] - breaks[panel]);
    const double middle = 0.5 * (breaks[panel + 1] + breaks[panel]);
    for (std::size_t k = 0; k < base.nodes.size(); ++k) {
      rule.nodes.push_back(middle + half * base.nodes[k]);
      rule.weights.push_back(half * base.weights[k]);
    }
  }
  return rule;
}

void append_geometric_breaks(double centre, double scale, double reach,
                             std::vector<double>& breaks) {
  assert(scale > 0.0 && "a panel needs a width");
  breaks.push_back(centre);
  for (double offset = scale; offset < reach; offset *= 2.0) {
    breaks.push_back(centre - offset);
    breaks.push_back(centre + offset);
  }
}

const QuadratureRule& gauss_hermite(int count) {
  static std::map<int, QuadratureRule> rules;
  static std::mutex mutex;
  return cached(count, rules, mutex, make_gauss_hermite);
}

ThreeNodeRule cut_gauss_hermite3(double cut) {
  assert(cut >= -3.0 && "the cut weight would be negligible");
  // Stieltjes' procedure: recurrence coefficients of the orthogonal polynomials from inner products
  // on a fine rule.
  constexpr double kReach = 6.5;  // exp(-6.5^2) = 4e-19
  const QuadratureRule fine = gauss_legendre(80, -kReach, std::min(cut, kReach));
  Eigen::Vector3d diagonal;
  Eigen::Vector2d off_diagonal;
  std::vector<double> previous(fine.nodes.size(), 0.0);
  std::vector<double> current(fine.nodes.size(), 1.0);
  double mass = 0.0;
  double previous_norm = 1.0;
  for (int degree = 0; degree < 3; ++degree) {
    double norm = 0.0;
    double moment = 0.0;
    for (std::size_t k = 0; k < fine.nodes.size(); ++k) {
      const double w =
          fine.weights[k] * std::exp(-fine.nodes[k] * fine.nodes[k]) * current[k] * current[k];
      norm += w;
      moment += w * fine.nodes[k];
    }
    diagonal[degree] = moment / norm;
    if (degree == 0) mass = norm;
    const double ratio = degree == 0 ? 0.0 : norm / previous_norm;
    if (degree > 0) off_diagonal[degree - 1] = std::sqrt(ratio);
    for (std::size_t k = 0; k < fine.nodes.size(); ++k) {
      const double next = (fine.nodes[k] - diagonal[degree]) * current[k] - ratio * previous[k];
      previous[k] = current[k];
      current[k] = next;
    }
    previous_norm = norm;
  }
  const QuadratureRule rule = from_jacobi_matrix(diagonal, off_diagonal, mass);
  ThreeNodeRule result{};
  for (std::size_t k = 0; k < 3; ++k) {
    result.nodes[k] = rule.nodes[k];
    result.weights[k] = rule.weights[k];
  }
  return result;
}

}  // namespace heddle
