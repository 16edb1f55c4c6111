#ifndef HEDDLE_FIBERS_MATH_ADAPTIVE_CUBATURE_H_
#define HEDDLE_FIBERS_MATH_ADAPTIVE_CUBATURE_H_
// Integrals over a rectangle of functions that are smooth except along a few lines. The cell with
// the largest error is halved in both directions, until the errors sum to a share of the result. A
// cell's value comes from nine Gauss-Legendre points on each of its quarters. Its error is the
// difference to nine points on the whole. That is the error of the coarser rule, so it is
// pessimistic.
//
// A feature narrower than a first cell can be missed. The caller says with how many cells to start.
// Tested in tests/math/adaptive_cubature_test.cpp.

#include <algorithm>
#include <array>
#include <vector>

#include "fibers/math/quadrature.h"
#include "fibers/math/vector.h"

namespace heddle {

struct CubatureSettings {
  double tolerance = 1e-4;     // of the largest component of the result
  int columns = 4;             // first cells along x
  int rows = 4;                // first cells along y
  int max_points = 2'000'000;  // stops there
};

/// Integral of f(x, y) -> Rgbd over [x0, x1] x [y0, y1].
template <typename Function>
Rgbd integrate_rectangle(double x0, double x1, double y0, double y1,
                         const CubatureSettings& settings, Function&& f) {
  struct Cell {
    double x, y, width, height;  // lower corner and sizes
    // integrals: (x low, y low), (high, low), (low, high), (high, high)
    std::array<Rgbd, 4> quarter;
    double error;
    bool operator<(const Cell& other) const { return error < other.error; }
  };
  const QuadratureRule& rule = gauss_legendre(3);
  int points = 0;
  const auto simple = [&](double x, double y, double width, double height) {
    Rgbd sum = Rgbd::Zero();
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) {
        const double weight = rule.weights[a] * rule.weights[b];
        sum += weight *
               f(x + 0.5 * width * (1 + rule.nodes[a]), y + 0.5 * height * (1 + rule.nodes[b]));
      }
    }
    points += 9;
    return Rgbd(sum * (0.25 * width * height));
  };
  const auto cell_of = [&](double x, double y, double width, double height, const Rgbd& whole) {
    Cell cell{x, y, width, height, {}, 0};
    Rgbd sum = Rgbd::Zero();
    for (int k = 0; k < 4; ++k) {
      const Rgbd part =
          simple(x + 0.5 * width * (k % 2), y + 0.5 * height * (k / 2), 0.5 * width, 0.5 * height);
      cell.quarter[static_cast<std::size_t>(k)] = part;
      sum += part;
    }
    cell.error = (sum - whole).abs().maxCoeff();
    return cell;
  };
  std::vector<Cell> cells;  // a heap by error
  const double width = (x1 - x0) / settings.columns;
  const double height = (y1 - y0) / settings.rows;
  for (int row = 0; row < settings.rows; ++row) {
    for (int column = 0; column < settings.columns; ++column) {
      const double x = x0 + column * width;
      const double y = y0 + row * height;
      cells.push_back(cell_of(x, y, width, height, simple(x, y, width, height)));
    }
  }
  std::make_heap(cells.begin(), cells.end());
  Rgbd total = Rgbd::Zero();
  double error = 0;
  const auto add = [&](const Cell& cell, double sign) {
    for (const Rgbd& part : cell.quarter) total += sign * part;
    error += sign * cell.error;
  };
  for (const Cell& cell : cells) add(cell, 1);
  while (error > settings.tolerance * total.abs().maxCoeff() && points < settings.max_points) {
    std::pop_heap(cells.begin(), cells.end());
    const Cell worst = cells.back();
    cells.pop_back();
    add(worst, -1);
    for (int k = 0; k < 4; ++k) {
      cells.push_back(cell_of(worst.x + 0.5 * worst.width * (k % 2),
                              worst.y + 0.5 * worst.height * (k / 2), 0.5 * worst.width,
                              0.5 * worst.height, worst.quarter[static_cast<std::size_t>(k)]));
      add(cells.back(), 1);
      std::push_heap(cells.begin(), cells.end());
    }
  }
  // Summed anew: without the rounding of what was split.
  total = Rgbd::Zero();
  for (const Cell& cell : cells) add(cell, 1);
  return total;
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_ADAPTIVE_CUBATURE_H_
