#ifndef HEDDLE_FIBERS_MATH_DIRECTION_GRID_H_
#define HEDDLE_FIBERS_MATH_DIRECTION_GRID_H_
// Directions in cells of equal solid angle: n x n over each hemisphere about z, which the
// concentric map of Shirley and Chiu (1997) makes of a square. Cell (row, column) of the upper
// hemisphere is number row n + column; those of the lower one, its mirror image, follow. Tested in
// tests/math/direction_grid_test.cpp.

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

class DirectionGrid {
 public:
  explicit DirectionGrid(int resolution) : n_(resolution) { assert(resolution >= 1); }

  int resolution() const { return n_; }
  std::uint32_t per_side() const { return static_cast<std::uint32_t>(n_ * n_); }
  std::uint32_t count() const { return 2 * per_side(); }
  /// Edge of a square of the same solid angle as a cell, radians.
  float cell_edge() const { return std::sqrt(2 * kPif) / static_cast<float>(n_); }

  /// The middle of a cell; unit.
  Vec3 direction(std::uint32_t cell) const {
    const bool below = cell >= per_side();
    const int k = static_cast<int>(below ? cell - per_side() : cell);
    const float a = (2 * static_cast<float>(k % n_) + 1) / static_cast<float>(n_) - 1;
    const float b = (2 * static_cast<float>(k / n_) + 1) / static_cast<float>(n_) - 1;
    float radius = a;
    float angle = 0;
    if (std::abs(a) > std::abs(b)) {
      angle = kPif / 4 * (b / a);
    } else if (b != 0) {
      radius = b;
      angle = kPif / 2 - kPif / 4 * (a / b);
    }
    const float z = 1 - radius * radius;
    const float across = radius * std::sqrt(2 - radius * radius);
    return {across * std::cos(angle), across * std::sin(angle), below ? -z : z};
  }

  /// Cells about a direction and their shares, which add up to 1: linear between the middles of
  /// cells, constant beyond the outermost. All lie on the direction's side.
  struct Place {
    std::array<std::uint32_t, 4> cells;
    std::array<float, 4> shares;

    /// Of a value per cell.
    float mean(const std::vector<float>& of_cells) const {
      float sum = 0;
      for (std::size_t i = 0; i < 4; ++i) sum += shares[i] * of_cells[cells[i]];
      return sum;
    }
  };
  Place place(const Vec3& direction) const {
    const float radius = std::sqrt(std::max(0.0F, 1 - std::abs(direction.z())));
    float angle = std::atan2(direction.y(), direction.x());
    float a = 0;
    float b = 0;
    if (angle < -kPif / 4) angle += 2 * kPif;
    if (angle < kPif / 4) {
      a = radius;
      b = a * angle * (4 / kPif);
    } else if (angle < 3 * kPif / 4) {
      b = radius;
      a = -b * (angle - kPif / 2) * (4 / kPif);
    } else if (angle < 5 * kPif / 4) {
      a = -radius;
      b = a * (angle - kPif) * (4 / kPif);
    } else {
      b = -radius;
      a = -b * (angle - 3 * kPif / 2) * (4 / kPif);
    }
    const auto [column, column_share] = between(a);
    const auto [row, row_share] = between(b);
    const std::uint32_t side = direction.z() < 0 ? per_side() : 0;
    Place place;
    for (int i = 0; i < 4; ++i) {
      const int r = std::min(row + i / 2, n_ - 1);
      const int c = std::min(column + i % 2, n_ - 1);
      place.cells[static_cast<std::size_t>(i)] = side + static_cast<std::uint32_t>(r * n_ + c);
      place.shares[static_cast<std::size_t>(i)] =
          (i / 2 != 0 ? row_share : 1 - row_share) * (i % 2 != 0 ? column_share : 1 - column_share);
    }
    return place;
  }

 private:
  struct Between {
    int low;
    float share;  // of the next one
  };
  Between between(float coordinate) const {
    const float place = std::clamp(0.5F * (coordinate + 1) * static_cast<float>(n_) - 0.5F, 0.0F,
                                   static_cast<float>(n_ - 1));
    const int low = static_cast<int>(place);
    return {low, place - static_cast<float>(low)};
  }

  int n_;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_DIRECTION_GRID_H_
