#ifndef HEDDLE_FIBERS_MATH_SPHERICAL_MAP_H_
#define HEDDLE_FIBERS_MATH_SPHERICAL_MAP_H_
// Binary function on the sphere, constant on the cells of a lat-long grid, as packed bits: which
// directions are open.
//
// There are N x N cells. Row r holds polar angles from pi r / N to pi (r + 1) / N, measured from
// +z. Column c holds azimuths atan2(y, x) in [2 pi c / N, 2 pi (c + 1) / N). Cell (r, c) is bit r N
// + c, least significant bit of each word first. Tested in tests/math/spherical_map_test.cpp.

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

/// The cells themselves: where they are and how large.
class LatLongGrid {
 public:
  struct Cell {
    int row;
    int column;
  };

  explicit LatLongGrid(int resolution) : resolution_(resolution) { assert(resolution >= 1); }

  int resolution() const { return resolution_; }
  std::size_t cell_count() const { return static_cast<std::size_t>(resolution_) * resolution_; }
  double row_step() const { return kPi / resolution_; }         // radians
  double column_step() const { return 2 * kPi / resolution_; }  // radians

  /// Cell that holds a direction of any positive length.
  Cell cell_of(const Vec3d& direction) const {
    const double polar = std::atan2(std::hypot(direction.x(), direction.y()), direction.z());
    double azimuth = std::atan2(direction.y(), direction.x());
    if (azimuth < 0) azimuth += 2 * kPi;
    return {std::min(static_cast<int>(polar / row_step()), resolution_ - 1),
            std::min(static_cast<int>(azimuth / column_step()), resolution_ - 1)};
  }

  /// Unit direction at the middle of the cell's polar angles and azimuths.
  Vec3d centre(int row, int column) const {
    const double polar = (row + 0.5) * row_step();
    const double azimuth = (column + 0.5) * column_step();
    return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
            std::cos(polar)};
  }

  /// Steradians of any cell of a row: column_step (cos a - cos b), written without cancellation.
  double solid_angle(int row) const {
    return column_step() * 2 * std::sin((row + 0.5) * row_step()) * std::sin(0.5 * row_step());
  }

 private:
  int resolution_;
};

class SphericalMap {
 public:
  /// All closed.
  explicit SphericalMap(int resolution) : grid_(resolution), words_(word_count(resolution)) {}
  SphericalMap(int resolution, std::span<const std::uint64_t> words)
      : grid_(resolution), words_(words.begin(), words.end()) {
    assert(words_.size() == word_count(resolution));
  }

  static constexpr std::size_t word_count(int resolution) {
    return (static_cast<std::size_t>(resolution) * resolution + 63) / 64;
  }

  const LatLongGrid& grid() const { return grid_; }
  int resolution() const { return grid_.resolution(); }
  std::span<const std::uint64_t> words() const { return words_; }

  bool open(int row, int column) const {
    const std::size_t bit = index(row, column);
    return ((words_[bit / 64] >> (bit % 64)) & 1U) != 0;
  }
  void set(int row, int column, bool open) {
    const std::size_t bit = index(row, column);
    const std::uint64_t mask = std::uint64_t{1} << (bit % 64);
    words_[bit / 64] = open ? words_[bit / 64] | mask : words_[bit / 64] & ~mask;
  }
  bool all_closed() const {
    return std::all_of(words_.begin(), words_.end(), [](std::uint64_t word) { return word == 0; });
  }

 private:
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * grid_.resolution() + column;
  }
  LatLongGrid grid_;
  std::vector<std::uint64_t> words_;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_SPHERICAL_MAP_H_
