#ifndef HEDDLE_RENDER_RADIANCE_PICTURE_H_
#define HEDDLE_RENDER_RADIANCE_PICTURE_H_
// A picture of linear radiance: what an environment or a textured light shows. Tested in
// tests/render/environment_map_test.cpp and tests/render/near_lights_test.cpp.

#include <filesystem>
#include <vector>

#include "fibers/math/vector.h"

namespace heddle {

struct RadiancePicture {
  int width = 0;
  int height = 0;
  std::vector<Rgb> pixels;  // [row from the top][column], finite and not negative

  const Rgb& pixel(int row, int column) const {
    return pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(column)];
  }
  /// The pixel at (u, v) in [0, 1]^2; u to the right, v up.
  const Rgb& at(double u, double v) const;
  /// The mean over [u0, u1] x [v0, v1], exactly: pixels are constant.
  Rgb mean(double u0, double u1, double v0, double v1) const;
};

/// Reads OpenEXR, or a Radiance picture where the name ends in .hdr or .pic; channels R, G, B.
/// Errors: FileError, also for values that are negative or not finite.
RadiancePicture read_radiance_picture(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_RENDER_RADIANCE_PICTURE_H_
