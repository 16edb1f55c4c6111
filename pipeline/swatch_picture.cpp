#include "pipeline/swatch_picture.h"

#include <tbb/parallel_for.h>

#include <cmath>

#include "fibers/tracing/tile_trace.h"
#include "formats/image_file.h"
#include "render/tone_map.h"
#include "render/walked_light.h"

namespace heddle {
namespace {

constexpr double kViewDegrees = 30;

Light soft(const Vec3& axis, float sharpness, float irradiance) {
  Light light;
  light.axis = axis.normalized();
  light.irradiance = Rgb::Constant(irradiance);
  light.type = LightType::kSphericalGaussian;
  light.sharpness = sharpness;
  return light;
}

}  // namespace

std::vector<Light> swatch_lights(bool both_sides) {
  std::vector<Light> lights = {soft(Vec3(0.7F, 0.35F, 1), 10, 2.2F),
                               soft(Vec3(-0.5F, 0.4F, 1), 2, 1.2F)};
  if (both_sides) lights.push_back(soft(Vec3(0.1F, 0.4F, -1), 3, 2.0F));
  return lights;
}

std::vector<Rgb> trace_swatch(const TileScene& tile, bool both_sides, const SwatchView& view,
                              std::uint64_t seed, const std::function<void(double)>& progress) {
  const TileTrace trace(tile);
  const std::vector<BcsdfTable> materials = bcsdf_tables(tile.exemplar().scattering);
  const std::vector<Light> lights = swatch_lights(both_sides);
  const Rgb background = Rgb::Constant(both_sides ? 0.6F : 0.0F);
  const double tilt = radians(kViewDegrees);
  const Vec3 eye = Vec3d(0, -std::sin(tilt), std::cos(tilt)).cast<float>();
  const float start = (tile.exemplar().z_max + 1.0F) / eye.z();
  const double step = view.width_mm / view.pixels;

  const auto side = static_cast<std::size_t>(view.pixels);
  std::vector<Rgb> picture(side * side, Rgb::Zero());
  for (int sample = 0; sample < view.spp; ++sample) {
    progress(static_cast<double>(sample) / view.spp);
    tbb::parallel_for(std::size_t{0}, side, [&](std::size_t row) {
      for (std::size_t pixel = row * side; pixel < (row + 1) * side; ++pixel) {
        RandomStream random(seed, RandomStage::kPathTracer, pixel,
                            static_cast<std::uint64_t>(sample));
        const double right = static_cast<double>(pixel % side) + random.uniform_double();
        const double up = static_cast<double>(side - row) - random.uniform_double();
        const Vec3 on_cloth = Vec3d(right * step, up * step / std::cos(tilt), 0).cast<float>();
        const auto hit = trace.first(on_cloth + start * eye, -eye);
        if (!hit) {
          picture[pixel] += background;
          continue;
        }
        const EyeSample light =
            walked_light(trace, materials, lights, LightEstimator::kEscapes, {}, *hit, eye, random);
        picture[pixel] += light.single + light.multiple;
      }
    });
  }
  progress(1);
  for (Rgb& color : picture) color /= static_cast<float>(view.spp);
  return picture;
}

void write_swatch(const std::filesystem::path& path, const std::vector<Rgb>& colors, int pixels) {
  write_png(path, pixels, pixels, tone_map(colors, {}));
}

}  // namespace heddle
