#ifndef HEDDLE_FIBERS_MATH_QUADRATURE_H_
#define HEDDLE_FIBERS_MATH_QUADRATURE_H_
// Gaussian quadrature in double precision. There are Gauss-Legendre on an interval or on a chain of
// panels, Gauss-Hermite for the weight exp(-x^2) on the real line, and the three-node Gauss rule
// for that weight cut off at one end.
//
// Nodes are ascending. Rules on [-1, 1] and Hermite rules are computed once per node count and kept
// (thread-safe). Tested in tests/math/quadrature_test.cpp.

#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace heddle {

struct QuadratureRule {
  std::vector<double> nodes;    // [count]
  std::vector<double> weights;  // [count]
};

/// Gauss-Legendre rule on [-1, 1]: exact for polynomials of degree 2 * count - 1. count >= 1.
const QuadratureRule& gauss_legendre(int count);

/// The same on [a, b].
QuadratureRule gauss_legendre(int count, double a, double b);

/// Gauss-Legendre with `count` nodes on each panel between successive breaks. Breaks are sorted
/// here. Those outside [a, b] are dropped, and a and b are added. So a caller may list every scale
/// at which its integrand changes.
QuadratureRule gauss_legendre_panels(int count, double a, double b, std::vector<double> breaks);

/// Breaks at centre and centre +- scale * 2^j until `reach`: panels that resolve a feature of that
/// width and what is around it. Appends to breaks. scale > 0.
void append_geometric_breaks(double centre, double scale, double reach,
                             std::vector<double>& breaks);

/// Gauss-Hermite rule for the weight exp(-x^2) on the real line.
const QuadratureRule& gauss_hermite(int count);

struct ThreeNodeRule {
  std::array<double, 3> nodes;
  std::array<double, 3> weights;
};

/// Gauss rule for the weight exp(-x^2) on (-infinity, cut]: exact for polynomials of degree 5. cut
/// >= -3.
ThreeNodeRule cut_gauss_hermite3(double cut);

/// Sum of weight * f(node). f returns a number or a fixed-size Eigen array by value.
template <typename Function>
auto integrate(const QuadratureRule& rule, Function&& f) {
  std::decay_t<decltype(f(0.0))> sum = f(rule.nodes[0]) * rule.weights[0];
  for (std::size_t k = 1; k < rule.nodes.size(); ++k) sum += f(rule.nodes[k]) * rule.weights[k];
  return sum;
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_QUADRATURE_H_
