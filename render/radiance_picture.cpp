#include "render/radiance_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "formats/file_ending.h"
#include "formats/hdr_file.h"
#include "formats/image_file.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

/// The pixel of `count` that holds `place` in [0, 1].
int pixel_at(double place, int count) {
  return std::clamp(static_cast<int>(place * count), 0, count - 1);
}

/// Length of [begin, end] (in pixels) within pixel k.
double length_within(int k, double begin, double end) {
  return std::max(0.0, std::min(end, k + 1.0) - std::max(begin, static_cast<double>(k)));
}

}  // namespace

const Rgb& RadiancePicture::at(double u, double v) const {
  return pixel(pixel_at(1 - v, height), pixel_at(u, width));
}

Rgb RadiancePicture::mean(double u0, double u1, double v0, double v1) const {
  const double left = u0 * width;
  const double right = u1 * width;
  const double top = (1 - v1) * height;
  const double bottom = (1 - v0) * height;
  Rgbd sum = Rgbd::Zero();
  for (int row = pixel_at(1 - v1, height); row <= pixel_at(1 - v0, height); ++row) {
    Rgbd of_row = Rgbd::Zero();
    for (int column = pixel_at(u0, width); column <= pixel_at(u1, width); ++column)
      of_row += length_within(column, left, right) * pixel(row, column).cast<double>();
    sum += length_within(row, top, bottom) * of_row;
  }
  return (sum / ((right - left) * (bottom - top))).cast<float>();
}

RadiancePicture read_radiance_picture(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  const Image image = ending == ".hdr" || ending == ".pic" ? read_hdr(path) : read_exr(path);
  RadiancePicture picture{image.width, image.height, {}};
  picture.pixels.resize(static_cast<std::size_t>(image.width) *
                        static_cast<std::size_t>(image.height));
  const char* names[] = {"R", "G", "B"};
  for (Eigen::Index c = 0; c < 3; ++c) {
    const auto channel = image.channels.find(names[c]);
    if (channel == image.channels.end() || channel->second.type == ChannelType::kUint) {
      throw FileError(fmt::format("{}: a picture of light needs channels R, G, B", path.string()));
    }
    for (std::size_t k = 0; k < picture.pixels.size(); ++k) {
      const float value = channel->second.values[k];
      if (!(std::isfinite(value) && value >= 0)) {
        throw FileError(fmt::format(
            "{}: radiance {} in channel {} at column {}, row {}", path.string(), value, names[c],
            k % static_cast<std::size_t>(image.width), k / static_cast<std::size_t>(image.width)));
      }
      picture.pixels[k][c] = value;
    }
  }
  return picture;
}

}  // namespace heddle
