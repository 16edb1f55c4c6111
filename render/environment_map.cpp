#include "render/environment_map.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "fibers/math/sampling.h"
#include "render/radiance_picture.h"

namespace heddle {
namespace {

double luminance(const Rgb& radiance) {
  return 0.2126 * static_cast<double>(radiance[0]) + 0.7152 * static_cast<double>(radiance[1]) +
         0.0722 * static_cast<double>(radiance[2]);
}

// Share of source cells [k, k + 1) in target cell `target` of `count`, as (first source cell,
// shares).
struct Overlap {
  int first;
  std::vector<double> shares;
};
Overlap overlap(int target, int count, int source_count) {
  const double begin = static_cast<double>(target) * source_count / count;
  const double end = static_cast<double>(target + 1) * source_count / count;
  Overlap result{static_cast<int>(begin), {}};
  for (int k = result.first; k < source_count && k < end; ++k) {
    result.shares.push_back(std::min(end, k + 1.0) - std::max(begin, static_cast<double>(k)));
  }
  return result;
}

}  // namespace

EnvironmentMap::EnvironmentMap(int width, int height, std::vector<Rgb> radiance)
    : width_(width), height_(height), radiance_(std::move(radiance)) {
  assert(width >= 1 && height >= 1 && radiance_.size() == static_cast<std::size_t>(width) * height);
  double total = 0;
  column_cumulative_.reserve(radiance_.size());
  for (int row = 0; row < height_; ++row) {
    double sum = 0;
    for (int column = 0; column < width_; ++column) {
      sum += luminance(pixel(row, column));
      column_cumulative_.push_back(sum);
    }
    total += sum * solid_angle(row);
    row_cumulative_.push_back(total);
  }
}

EnvironmentMap EnvironmentMap::read(const std::filesystem::path& path) {
  RadiancePicture picture = read_radiance_picture(path);
  return {picture.width, picture.height, std::move(picture.pixels)};
}

Vec3d EnvironmentMap::centre(int row, int column) const {
  const double polar = kPi * (row + 0.5) / height_;
  const double azimuth = kPi * (1 - 2 * (column + 0.5) / width_);
  return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
          std::cos(polar)};
}

double EnvironmentMap::solid_angle(int row) const {
  // 2 pi / width (cos a - cos b), without cancellation.
  return 4 * kPi / width_ * std::sin(kPi * (row + 0.5) / height_) * std::sin(0.5 * kPi / height_);
}

EnvironmentMap::Cell EnvironmentMap::cell_of(const Vec3& direction) const {
  const Vec3d w = direction.cast<double>();
  const double polar = std::atan2(std::hypot(w.x(), w.y()), w.z());
  const double u = 0.5 - std::atan2(w.y(), w.x()) / (2 * kPi);
  return {std::clamp(static_cast<int>(polar / kPi * height_), 0, height_ - 1),
          std::clamp(static_cast<int>(u * width_), 0, width_ - 1)};
}

Rgb EnvironmentMap::radiance(const Vec3& direction) const {
  const Cell cell = cell_of(direction);
  return pixel(cell.row, cell.column);
}

Rgbd EnvironmentMap::integral() const {
  Rgbd sum = Rgbd::Zero();
  for (int row = 0; row < height_; ++row) {
    Rgbd of_row = Rgbd::Zero();
    for (int column = 0; column < width_; ++column) of_row += pixel(row, column).cast<double>();
    sum += of_row * solid_angle(row);
  }
  return sum;
}

LightSample EnvironmentMap::sample(RandomStream& random) const {
  const double total = row_cumulative_.back();
  if (!(total > 0)) {
    const Vec3 direction = sample_sphere(random);
    return {direction, Rgb::Zero(), pdf(direction)};
  }
  // Each choice leaves a fresh uniform number within what was chosen, which places the point in the
  // pixel.
  const auto choose = [](auto begin, auto end, double value) {
    const auto found = std::min(std::upper_bound(begin, end, value), end - 1);
    const double before = found == begin ? 0 : *(found - 1);
    const double rest = *found > before ? (value - before) / (*found - before) : 0.5;
    return std::pair(static_cast<int>(found - begin), std::clamp(rest, 0.0, 1.0));
  };
  const auto [row, down] =
      choose(row_cumulative_.begin(), row_cumulative_.end(), random.uniform_double() * total);
  const auto columns = column_cumulative_.begin() + static_cast<std::ptrdiff_t>(index(row, 0));
  const auto [column, across] =
      choose(columns, columns + width_, random.uniform_double() * *(columns + (width_ - 1)));
  // Uniform over the pixel's solid angle: in the cosine of the polar angle, and in azimuth.
  const double cosine =
      std::lerp(std::cos(kPi * row / height_), std::cos(kPi * (row + 1) / height_), down);
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const double azimuth = kPi * (1 - 2 * (column + across) / width_);
  const Rgb& value = pixel(row, column);
  const double density = luminance(value) / total;
  return {Vec3d(sine * std::cos(azimuth), sine * std::sin(azimuth), cosine).cast<float>(),
          (value.cast<double>() / density).cast<float>(), static_cast<float>(density)};
}

float EnvironmentMap::pdf(const Vec3& direction) const {
  const double total = row_cumulative_.back();
  return static_cast<float>(total > 0 ? luminance(radiance(direction)) / total : 0.25 / kPi);
}

EnvironmentMap EnvironmentMap::reduced(int width, int height) const {
  assert(width >= 1 && width <= width_ && height >= 1 && height <= height_);
  std::vector<Rgb> result;
  result.reserve(static_cast<std::size_t>(width) * height);
  std::vector<Overlap> columns;
  for (int column = 0; column < width; ++column) columns.push_back(overlap(column, width, width_));
  for (int row = 0; row < height; ++row) {
    // Bands of polar angle weigh by the difference of cosines, also where a target row cuts one.
    const Overlap rows = overlap(row, height, height_);
    std::vector<double> weights;
    double at = kPi * row / height;
    double whole = 0;
    for (const double share : rows.shares) {
      const double next = at + share * kPi / height_;
      weights.push_back(2 * std::sin(0.5 * (at + next)) * std::sin(0.5 * (next - at)));
      whole += weights.back();
      at = next;
    }
    for (const Overlap& across : columns) {
      Rgbd sum = Rgbd::Zero();
      double breadth = 0;
      for (const double share : across.shares) breadth += share;
      for (std::size_t r = 0; r < weights.size(); ++r) {
        Rgbd of_row = Rgbd::Zero();
        for (std::size_t c = 0; c < across.shares.size(); ++c) {
          of_row += across.shares[c] *
                    pixel(rows.first + static_cast<int>(r), across.first + static_cast<int>(c))
                        .cast<double>();
        }
        sum += weights[r] * of_row;
      }
      result.push_back((sum / (whole * breadth)).cast<float>());
    }
  }
  return {width, height, std::move(result)};
}

}  // namespace heddle
