#ifndef HEDDLE_RENDER_ENVIRONMENT_MAP_H_
#define HEDDLE_RENDER_ENVIRONMENT_MAP_H_
// Light from infinity as a latitude-longitude picture: radiance, constant on each pixel.
//
// Row 0 is at +z (up), the last one at -z, each of equal height in polar angle. The middle of the
// picture looks along +x. The view from inside is not mirrored: a quarter of the width to the right
// looks along -y, to the left along +y, and the seam along -x. Azimuth atan2(y, x) = pi (1 - 2 u)
// with u from 0 (left) to 1. Blender has the same convention.
//
// Pixels are constant, so the integral, the density of sampling and averages over areas are all
// exact. Thread-safe. Tested in tests/render/environment_map_test.cpp.

#include <filesystem>
#include <vector>

#include "fibers/math/random.h"
#include "fibers/math/vector.h"
#include "render/lights.h"

namespace heddle {

class EnvironmentMap {
 public:
  /// radiance [row][column], finite and not negative.
  EnvironmentMap(int width, int height, std::vector<Rgb> radiance);

  /// From a file (radiance_picture.h). Errors: FileError.
  static EnvironmentMap read(const std::filesystem::path& path);

  int width() const { return width_; }
  int height() const { return height_; }
  const Rgb& pixel(int row, int column) const { return radiance_[index(row, column)]; }
  /// Unit direction in the middle of a pixel's angles.
  Vec3d centre(int row, int column) const;
  /// Steradians of any pixel of a row.
  double solid_angle(int row) const;

  Rgb radiance(const Vec3& direction) const;

  /// The integral of radiance over the sphere.
  Rgbd integral() const;

  /// Draws a direction with density proportional to luminance; uniformly where all is black. The
  /// weight is radiance / pdf.
  LightSample sample(RandomStream& random) const;
  /// That density, 1/sr.
  float pdf(const Vec3& direction) const;

  /// The same light on fewer pixels: averages over areas, so the integral stays. Sizes at most the
  /// map's own.
  EnvironmentMap reduced(int width, int height) const;

 private:
  struct Cell {
    int row;
    int column;
  };
  Cell cell_of(const Vec3& direction) const;
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * width_ + column;
  }

  int width_;
  int height_;
  std::vector<Rgb> radiance_;  // [row][column]
  // [row] luminance times solid angle of all rows up to this one
  std::vector<double> row_cumulative_;
  // [row][column] luminance of the row's pixels up to this one
  std::vector<double> column_cumulative_;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_ENVIRONMENT_MAP_H_
