#include "render/bright_sources.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

/// Pixels of a source are brighter than this share of its brightest.
constexpr float kEdgeShare = 0.05F;

/// Brightest pixels that are looked at without finding a source.
constexpr int kMostMisses = 64;

constexpr double kSharpestSource = 1e6;

float brightness(const Rgb& radiance) {
  return 0.2126F * radiance[0] + 0.7152F * radiance[1] + 0.0722F * radiance[2];
}

struct MapPixel {
  int row;
  int column;
};

class SourceSearch {
 public:
  explicit SourceSearch(const EnvironmentMap& map)
      : width_(map.width()), height_(map.height()), map_(&map) {
    for (int row = 0; row < height_; ++row) {
      for (int column = 0; column < width_; ++column) {
        pixels_.push_back(map.pixel(row, column));
        all_ += map.solid_angle(row) * static_cast<double>(brightness(pixels_.back()));
      }
    }
    is_done_.assign(pixels_.size(), 0);
  }

  std::vector<Light> find(int most) {
    std::vector<Light> sources;
    int misses = 0;
    while (static_cast<int>(sources.size()) < most && misses < kMostMisses) {
      const auto [peak, value] = brightest();
      if (!(value > 0)) break;
      if (!take(peak, value, sources)) ++misses;
    }
    return sources;
  }

  EnvironmentMap rest() const { return {width_, height_, pixels_}; }

 private:
  std::size_t place(const MapPixel& pixel) const {
    return static_cast<std::size_t>(pixel.row) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(pixel.column);
  }

  std::pair<MapPixel, float> brightest() const {
    std::size_t best = 0;
    float value = -1;
    for (std::size_t k = 0; k < pixels_.size(); ++k) {
      if (is_done_[k] == 0 && brightness(pixels_[k]) > value) {
        value = brightness(pixels_[k]);
        best = k;
      }
    }
    const auto at = static_cast<int>(best);
    return {{at / width_, at % width_}, value};
  }

  /// Looks at what hangs together with a peak. Its pixels are not looked at again.
  bool take(const MapPixel& peak, float value, std::vector<Light>& sources) {
    std::vector<MapPixel> region = {peak};
    std::vector<Rgb> rim;
    is_done_[place(peak)] = 1;
    double solid_angle = 0;
    for (std::size_t next = 0; next < region.size(); ++next) {
      const MapPixel from = region[next];
      solid_angle += map_->solid_angle(from.row);
      for (int row = std::max(0, from.row - 1); row <= std::min(height_ - 1, from.row + 1); ++row) {
        for (const int step : {-1, 0, 1}) {
          const MapPixel to{row, (from.column + step + width_) % width_};
          const Rgb& color = pixels_[place(to)];
          if (brightness(color) < kEdgeShare * value) {
            rim.push_back(color);
          } else if (is_done_[place(to)] == 0) {
            is_done_[place(to)] = 1;
            region.push_back(to);
          }
        }
      }
    }
    if (solid_angle > kLargestSource || rim.empty()) return false;
    return split_off(region, mean(rim), sources);
  }

  static Rgb mean(const std::vector<Rgb>& colors) {
    Rgbd sum = Rgbd::Zero();
    for (const Rgb& color : colors) sum += color.cast<double>();
    return (sum / static_cast<double>(colors.size())).cast<float>();
  }

  bool split_off(const std::vector<MapPixel>& region, const Rgb& rim, std::vector<Light>& sources) {
    Rgbd energy = Rgbd::Zero();
    double luminance = 0;
    double own_depth = 0;  // of the pixels about their middles: half the variances
    Vec3d moment = Vec3d::Zero();
    for (const MapPixel& pixel : region) {
      const Rgb excess = (pixels_[place(pixel)] - rim).max(0.0F);
      const double solid_angle = map_->solid_angle(pixel.row);
      energy += solid_angle * excess.cast<double>();
      const double weight = solid_angle * static_cast<double>(brightness(excess));
      const double tall = kPi / height_;
      luminance += weight;
      moment += weight * map_->centre(pixel.row, pixel.column);
      own_depth += weight * (tall * tall + std::pow(solid_angle / tall, 2)) / 24;
    }
    if (!(luminance > kLeastShare * all_)) return false;
    for (const MapPixel& pixel : region) pixels_[place(pixel)] = pixels_[place(pixel)].min(rim);
    Light light;
    light.type = LightType::kSphericalGaussian;
    light.axis = moment.normalized().cast<float>();
    light.sharpness = static_cast<float>(std::min(
        kSharpestSource,
        sg_sharpness_of_mean_depth(1 - moment.norm() / luminance + own_depth / luminance)));
    light.irradiance = energy.cast<float>();
    sources.push_back(light);
    return true;
  }

  int width_;
  int height_;
  const EnvironmentMap* map_;
  std::vector<Rgb> pixels_;            // what is left
  std::vector<std::uint8_t> is_done_;  // [pixel]
  double all_ = 0;                     // luminance times solid angle
};

}  // namespace

SplitEnvironment split_bright_sources(const EnvironmentMap& map, int most) {
  SourceSearch search(map);
  std::vector<Light> sources = search.find(most);
  return {std::move(sources), search.rest()};
}

}  // namespace heddle
